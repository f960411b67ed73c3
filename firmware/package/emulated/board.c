/* The functions of board.h for a board whose hardware is a simulated bench: sensors are read from
 * the sample of this period, registers are written to its answer. */
#include "board.h"

#include "bench.h"
#include "wiring.h"

enum { N = RELUCTANCE_PHASES };

static const int leg_of[N] = WIRING_LEG;
static const int channel_of[N] = WIRING_CHANNEL;
static const int sign_of[N] = WIRING_SIGN;

static bench_sample now;
static bench_answer done;

static void tell(const char* text) {
  unsigned n = 0;
  for (; text[n] != '\0' && n < sizeof done.text - 1; ++n) {
    done.text[n] = text[n];
  }
  done.text[n] = '\0';
}

void board_init(void) {}

void board_read_currents(float i_A[RELUCTANCE_PHASES]) {
  for (int k = 0; k < N; ++k) {
    i_A[k] = (float)sign_of[k] * now.shown.i_A[channel_of[k]];
  }
}

float board_read_angle(void) {
  const float turn = 6.28318530717958648F;
  float theta = (float)(WIRING_DIRECTION)*now.shown.theta_e_rad - (WIRING_ZERO_RAD);
  while (theta < 0.0F) {
    theta += turn;
  }
  while (theta >= turn) {
    theta -= turn;
  }
  return theta;
}

float board_read_speed(void) { return (float)(WIRING_DIRECTION)*now.shown.omega_m_rad_s; }
float board_read_dc_link(void) { return now.shown.u_dc_V; }
float board_read_source_current(void) { return now.shown.i_source_A; }
void board_read_request(reluctance_request* request) { *request = now.request; }

void board_write_orders(const reluctance_command* command) {
  for (int k = 0; k < N; ++k) {
    done.orders.phase[leg_of[k]] = command->phase[k];
  }
}

void board_write_outputs(const reluctance_outputs* outputs) { done.outputs = *outputs; }

/* Of the fast loop, which this board does not need: the bench compares at any instant. */
void board_write_leg(int k, int8_t leg) {
  (void)k;
  (void)leg;
}

void board_trip(const reluctance_fault* fault) {
  done.fault = *fault;
  tell(reluctance_describe(fault->status));
}

void board_write_found(const reluctance_found* found) {
  ++done.rows;
  done.found = *found;
  if (found->finding > RELUCTANCE_FINDING_RUNNING) {
    tell(reluctance_describe_finding(found->finding));
  }
}

void board_show(const bench_sample* sample) {
  now = *sample;
  done.rows = 0;
  done.fault.status = RELUCTANCE_OK;
}

void board_answer(bench_answer* answer) { *answer = done; }
