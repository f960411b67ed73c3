/* The control interrupt: measure, step, order. While commissioning, a routine takes the place of
 * the control. */
#include "board.h"

static reluctance_controller controller;

/* The step writes one buffer while the board reads the other. Zeros are all off. */
static reluctance_command buffers[2];
static const reluctance_command* volatile orders = &buffers[0]; /* in effect */

#if COMMISSIONING
static reluctance_commissioner commissioner;
static int commissions; /* a routine takes the place of the control */

void control_commission(reluctance_routine routine, int32_t phase, int32_t pulses, int32_t held,
                        float held_A) {
  reluctance_commission_start(&commissioner, routine, phase, pulses, held, held_A);
  commissions = 1;
}

void control_resume(void) {
  reluctance_init(&controller);
  commissions = 0;
}

static void write_found(reluctance_mode mode) {
  reluctance_found found;
  reluctance_get_found(&commissioner, &found);
  if (mode == RELUCTANCE_MODE_RUN || found.finding != RELUCTANCE_FINDING_RUNNING) {
    board_write_found(&found);
  }
}
#endif

void control_start(void) {
  board_init();
  reluctance_init(&controller);
}

static reluctance_mode step(const reluctance_measurement* y, const reluctance_request* request,
                            reluctance_command* command, reluctance_outputs* outputs,
                            reluctance_fault* fault) {
#if COMMISSIONING
  if (commissions) {
    const reluctance_mode mode = reluctance_commission(&commissioner, y, request, command, outputs);
    *fault = reluctance_commission_fault(&commissioner);
    return mode;
  }
#endif
  reluctance_run(&controller, y, request, command, outputs);
  *fault = reluctance_get_fault(&controller);
  return outputs->mode;
}

void control_interrupt(void) {
  static int next = 1;
  static reluctance_outputs outputs;
  reluctance_measurement y;
  reluctance_request request;
  reluctance_fault fault;
  if (RELUCTANCE_DELAY_SAMPLES > 0) {
    board_write_orders(orders); /* of the last step, now that its period begins */
  }
  board_read_currents(y.i_A);
  y.theta_e_rad = board_read_angle();
  y.omega_m_rad_s = board_read_speed();
  y.u_dc_V = board_read_dc_link();
  y.i_source_A = board_read_source_current();
  board_read_request(&request);
  const reluctance_mode mode = step(&y, &request, &buffers[next], &outputs, &fault);
  if (mode == RELUCTANCE_MODE_FAULT) {
    board_trip(&fault); /* before the orders are written */
  }
  orders = &buffers[next];
  next = 1 - next;
  if (RELUCTANCE_DELAY_SAMPLES == 0 || !outputs.gate_enable) {
    board_write_orders(orders);
  }
  board_write_outputs(&outputs);
#if COMMISSIONING
  if (commissions) {
    write_found(mode);
  }
#endif
}

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
