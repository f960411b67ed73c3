/* The control interrupt: measure, step, order. Call it once every @T_s_us@ us from the timer that
 * triggers the current converters. */
#include "board.h"

void control_start(void);
void control_interrupt(void);
void fast_loop(const float i_A[RELUCTANCE_PHASES], float theta_e_rad);

static reluctance_controller controller;
static reluctance_command orders;

/* Once, before the interrupts. */
void control_start(void) {
  board_init();
  reluctance_init(&controller);
}

void control_interrupt(void) {
  reluctance_measurement y;
  board_read_currents(y.i_A);
  y.theta_e_rad = board_read_angle();
  y.omega_m_rad_s = board_read_speed();
  y.u_dc_V = board_read_dc_link();
  y.i_source_A = board_read_source_current();
  const reluctance_status status =
      reluctance_step(&controller, &y, board_read_reference(), &orders);
  board_write_orders(&orders);
  if (status != RELUCTANCE_OK) {
    board_trip(status);
  }
}

/* Only on a board without analog comparators: some ten times a control period. */
void fast_loop(const float i_A[RELUCTANCE_PHASES], float theta_e_rad) {
  static int8_t leg[RELUCTANCE_PHASES];
  for (int k = 0; k < RELUCTANCE_PHASES; ++k) {
    if (orders.phase[k].gate == RELUCTANCE_TIMER) {
      continue;
    }
    leg[k] = reluctance_compared_leg(&orders.phase[k], leg[k], i_A[k], theta_e_rad, k);
    board_write_leg(k, leg[k]);
  }
}
