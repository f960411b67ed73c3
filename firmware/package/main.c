/* The control interrupt: measure, step, order. Call it once every @T_s_us@ us from the timer that
 * triggers the current converters. */
#include "board.h"

void control_start(void);
void control_interrupt(void);
void fast_loop(const float i_A[RELUCTANCE_PHASES], float theta_e_rad);

static reluctance_controller controller;

/* The step writes one buffer while the board reads the other. Zeros are all off. */
static reluctance_command buffers[2];
static const reluctance_command* volatile orders = &buffers[0]; /* in effect */

/* Once, before the interrupts. */
void control_start(void) {
  board_init();
  reluctance_init(&controller);
}

void control_interrupt(void) {
  static int next = 1;
  static reluctance_outputs outputs;
  reluctance_measurement y;
  reluctance_request request;
  if (RELUCTANCE_DELAY_SAMPLES > 0) {
    board_write_orders(orders); /* of the last step, now that its period begins */
  }
  board_read_currents(y.i_A);
  y.theta_e_rad = board_read_angle();
  y.omega_m_rad_s = board_read_speed();
  y.u_dc_V = board_read_dc_link();
  y.i_source_A = board_read_source_current();
  board_read_request(&request);
  if (reluctance_run(&controller, &y, &request, &buffers[next], &outputs) ==
      RELUCTANCE_MODE_FAULT) {
    const reluctance_fault fault = reluctance_get_fault(&controller);
    board_trip(&fault); /* before the orders are written */
  }
  orders = &buffers[next];
  next = 1 - next;
  if (RELUCTANCE_DELAY_SAMPLES == 0 || !outputs.gate_enable) {
    board_write_orders(orders);
  }
  board_write_outputs(&outputs);
}

/* Only on a board without analog comparators: some ten times a control period. A leg that is not
 * enabled must not switch, whatever is written. */
void fast_loop(const float i_A[RELUCTANCE_PHASES], float theta_e_rad) {
  static int8_t leg[RELUCTANCE_PHASES];
  const reluctance_command* now = orders;
  for (int k = 0; k < RELUCTANCE_PHASES; ++k) {
    const reluctance_phase_command* order = &now->phase[k];
    if (order->gate == RELUCTANCE_TIMER) {
      continue;
    }
    leg[k] = reluctance_compared_leg(order, leg[k], i_A[k], theta_e_rad, k);
    board_write_leg(k, leg[k]);
  }
}
