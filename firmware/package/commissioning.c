/* Commissioning on the board: call commissioning_interrupt from the timer, in the place of
 * control_interrupt, from commissioning_start until the finding is no longer RUNNING. A firmware
 * that is commissioned already leaves this file out. */
#include "board.h"
#include "reluctance_commission.h"

void commissioning_start(reluctance_routine routine, int32_t phase, int32_t pulses);
reluctance_finding commissioning_interrupt(void);

/* Yours: keeps or sends what was found. While `finding` is RUNNING, each call of `pulses` is a row
 * `t_s,u_mean_V,i_A,theta_m_deg` of the recording that `reluctance map identify` reads:
 * t_s = sample * RELUCTANCE_CONTROL_PERIOD_S, theta_m_deg = theta_e_rad * 180/(pi * @N_r@), an
 * angle just below 2 pi written as a negative one. The call with DONE is not a row. */
void board_write_found(const reluctance_found* found);

static reluctance_commissioner commissioner;
static reluctance_command buffers[2];

/* Not while commissioning_interrupt runs. */
void commissioning_start(reluctance_routine routine, int32_t phase, int32_t pulses) {
  reluctance_commission_start(&commissioner, routine, phase, pulses);
}

reluctance_finding commissioning_interrupt(void) {
  static int next = 1;
  static reluctance_outputs outputs;
  reluctance_measurement y;
  reluctance_request request;
  reluctance_found found;
  if (RELUCTANCE_DELAY_SAMPLES > 0) {
    board_write_orders(&buffers[1 - next]);
  }
  board_read_currents(y.i_A);
  y.theta_e_rad = board_read_angle();
  y.omega_m_rad_s = 0.0F;
  y.u_dc_V = board_read_dc_link();
  y.i_source_A = 0.0F;
  board_read_request(&request);
  const reluctance_mode mode =
      reluctance_commission(&commissioner, &y, &request, &buffers[next], &outputs);
  if (mode == RELUCTANCE_MODE_FAULT) {
    const reluctance_fault fault = reluctance_commission_fault(&commissioner);
    board_trip(&fault); /* before the orders are written */
  }
  if (RELUCTANCE_DELAY_SAMPLES == 0 || !outputs.gate_enable) {
    board_write_orders(&buffers[next]);
  }
  next = 1 - next;
  board_write_outputs(&outputs);
  reluctance_get_found(&commissioner, &found);
  if (mode == RELUCTANCE_MODE_RUN || found.finding != RELUCTANCE_FINDING_RUNNING) {
    board_write_found(&found);
  }
  return found.finding;
}
