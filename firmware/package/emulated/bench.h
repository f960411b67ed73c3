/* One control period of the emulated board: what the simulated bench shows, and what the board
 * does. The program `bench` exchanges them with `reluctance emulate`, little-endian 32-bit words.
 */
#ifndef BENCH_H
#define BENCH_H

#include "reluctance_commission.h"

/* Readings are as the sensors show them: current channels in their order, the angle as counted. */
typedef struct {
  int32_t routine; /* of commissioning, begins before this period; -1: none does */
  int32_t phase;   /* of the pulses */
  int32_t pulses;
  int32_t held; /* phase that is held at held_A meanwhile; -1: none */
  float held_A;
  reluctance_measurement shown;
  reluctance_request request;
} bench_sample;

typedef struct {
  reluctance_command orders; /* of the legs, in effect from now on */
  reluctance_outputs outputs;
  reluctance_fault fault; /* that board_trip was called with; of status 0 where it was not */
  int32_t rows;           /* calls of board_write_found */
  reluctance_found found;
  char text[128]; /* the finding in words, or the fault */
} bench_answer;

/* Of timer.c: once, and then once a control period. */
void bench_start(void);
void bench_period(const bench_sample* sample, bench_answer* answer);

/* Of board.c, around a period: what its sensors show, and what it did. */
void board_show(const bench_sample* sample);
void board_answer(bench_answer* answer);

#endif
