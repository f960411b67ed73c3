/* The timer of the emulated board: it calls the control as the interrupts of a board do. Calls run
 * one way: this file calls main.c, and main.c calls board.c. */
#include "bench.h"
#include "board.h"

void bench_start(void) { control_start(); }

void bench_period(const bench_sample* sample, bench_answer* answer) {
  board_show(sample);
  if (sample->routine >= 0) {
    control_commission(sample->routine, sample->phase, sample->pulses, sample->held,
                       sample->held_A);
  }
  control_interrupt();
  board_answer(answer);
}
