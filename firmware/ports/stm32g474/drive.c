/* The control interrupt and the main loop. All currents are converted: sample, step, order. */
#include "board.h"
#include "port.h"
#include "reluctance_recorder.h"

static reluctance_controller controller;
static reluctance_recorder recorder;
static reluctance_command orders; /* zeros are all off */

const reluctance_command* port_orders(void) { return &orders; }

/* The orders act when the next period begins, one sample late, as simulated: the timers load then
 * what is written here. */
void ADC1_2_IRQHandler(void) {
  static reluctance_outputs outputs;
  reluctance_measurement y;
  reluctance_request request;
  port_period_begins();
  board_read_currents(y.i_A);
  y.theta_e_rad = board_read_angle();
  y.omega_m_rad_s = board_read_speed();
  y.u_dc_V = board_read_dc_link();
  y.i_source_A = board_read_source_current();
  board_read_request(&request);
  if (request.clear) {
    port_clear_trip();
  }
  if (reluctance_run_recorded(&recorder, &controller, &y, &request, &orders, &outputs) ==
      RELUCTANCE_MODE_FAULT) {
    const reluctance_fault fault = reluctance_get_fault(&controller);
    board_trip(&fault);
  }
  board_write_orders(&orders);
  board_write_outputs(&outputs);
  port_period_ends();
}

int main(void) {
  uint32_t words;
  uint32_t* memory = port_spare_memory(&words);
  reluctance_init(&controller);
  /* Segments of 32 samples, as many as fit; 32 samples after a fault. */
  reluctance_recorder_start(&recorder, memory, words, 32, 32);
  board_init();
#ifndef REGISTERS_MOCKED
  for (;;) {
    /* Yours: take commands into port_request, send telemetry, keep parameters, send the dump. */
  }
#else
  return 0;
#endif
}
