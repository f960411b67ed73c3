// The C interface over the core's supervised step.
#include "_standard.hpp"
#include "border.hpp"
#include "reluctance_controller.h"
#ifdef RELUCTANCE_SELF_TEST
#include "reluctance_self_test.h"
#include "srm/base/crc32.hpp"
#endif
#include "srm/control/frame/comparator.hpp"
#include "state.hpp"

namespace reluctance {

[[gnu::noinline, gnu::flatten]] reluctance_status OnTarget::once(State& x, const Measurement& y,
                                                                 float reference, Command& orders) {
  return static_cast<reluctance_status>(
      drive.control.Guarded::step<used>(x, y, reference, orders, tuning_of(x)));
}

}  // namespace reluctance

using reluctance::drive;
using reluctance::State;
using reluctance::state_of;

#ifdef RELUCTANCE_SELF_TEST
/// Each word is read from where it lies: the compiler must not know it.
uint32_t reluctance_tables_crc(void) {
  uint32_t crc = 0;
  for (const reluctance::StoredTable& table : reluctance::stored_tables) {
    const auto* at = static_cast<const volatile unsigned char*>(table.at);
    for (uint32_t n = 0; n < table.bytes; n += 4) {
      uint32_t word = 0;
      for (uint32_t b = 0; b < 4 && n + b < table.bytes; ++b) {
        word |= static_cast<uint32_t>(at[n + b]) << (8 * b);
      }
      crc = srm::crc32(&word, 1, crc);
    }
  }
  return crc;
}
#endif

void reluctance_init(reluctance_controller* controller) { ::new (controller) State(); }

void reluctance_reset(reluctance_controller* controller) {
  State& x = state_of(controller);
  const auto parameter = x.control.parameter;
  const auto changes = x.changes + 1;
  srm::renew(x);
  x.control.parameter = parameter;
  x.changes = changes;
}

reluctance_status reluctance_step(reluctance_controller* controller,
                                  const reluctance_measurement* measurement, float reference,
                                  reluctance_command* command) {
  State& x = state_of(controller);
  ++x.changes;
  return reluctance::OnTarget::once(x.control, reluctance::seen(measurement), reference,
                                    reluctance::written(command));
}

reluctance_mode reluctance_run(reluctance_controller* controller,
                               const reluctance_measurement* measurement,
                               const reluctance_request* request, reluctance_command* command,
                               reluctance_outputs* outputs) {
  State& x = state_of(controller);
  ++x.changes;
  return reluctance::answered(
      drive.step(x, reluctance::seen(measurement), reluctance::asked(*request),
                 reluctance::written(command), reluctance::sequence_of(x.control.parameter), {}),
      outputs);
}

reluctance_fault reluctance_get_fault(const reluctance_controller* controller) {
  return reluctance::told(drive.fault(state_of(controller)));
}

reluctance_status reluctance_get_status(const reluctance_controller* controller) {
  return static_cast<reluctance_status>(drive.control.fault(state_of(controller).control).status);
}

float reluctance_torque_reference(const reluctance_controller* controller) {
  return drive.control.law(state_of(controller).control).frame.tau_ref;
}

// What it has learned, and where the rotor is by the flux linkages.@more_code@

const char* reluctance_describe(reluctance_status status) {
  return srm::describe(static_cast<srm::Status>(status));
}

uint32_t reluctance_api(void) { return RELUCTANCE_API; }

uint32_t reluctance_fingerprint(void) { return reluctance::fingerprint; }

int8_t reluctance_compared_leg(const reluctance_phase_command* order, int8_t leg, float i_A,
                               float theta_e_rad, int k) {
  const auto& phase = *std::launder(reinterpret_cast<const reluctance::Phase*>(order));
  const auto now = static_cast<srm::Leg>(leg);
  return static_cast<int8_t>(srm::compared<RELUCTANCE_PHASES>(phase, now, i_A, theta_e_rad, k));
}
