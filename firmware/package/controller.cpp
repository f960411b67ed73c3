// The C interface over the control headers: states, protection, then speed loop and control law.
#include <cstddef>
#include <new>

#include "reluctance_controller.h"
#ifdef RELUCTANCE_SELF_TEST
#include "reluctance_self_test.h"
#include "srm/base/crc32.hpp"
#endif
#include "srm/control/frame/comparator.hpp"
#include "state.hpp"

namespace {

constexpr int N = RELUCTANCE_PHASES;
using reluctance::control;
using reluctance::protection;
using reluctance::sequence_of;
using reluctance::State;
using reluctance::state_of;
using reluctance::trip_levels_of;
using reluctance::tuning_of;
using Measurement = srm::Measurement<float, N>;
using Command = srm::Command<float, N>;
using Phase = srm::PhaseCommand<float>;

// The C structs are the C++ ones, so that nothing is copied.
static_assert(sizeof(Measurement) == sizeof(reluctance_measurement));
static_assert(offsetof(Measurement, theta_e) == offsetof(reluctance_measurement, theta_e_rad));
static_assert(offsetof(Measurement, i_source) == offsetof(reluctance_measurement, i_source_A));
static_assert(sizeof(Command) == sizeof(reluctance_command));
static_assert(offsetof(Phase, leg) == offsetof(reluctance_phase_command, leg));
static_assert(offsetof(Phase, t_edge) == offsetof(reluctance_phase_command, t_edge_s));
static_assert(offsetof(Phase, i_ref) == offsetof(reluctance_phase_command, i_ref_A));
static_assert(offsetof(Phase, chop) == offsetof(reluctance_phase_command, chop));
static_assert(offsetof(Phase, gate) == offsetof(reluctance_phase_command, gate));
static_assert(offsetof(Phase, i_band) == offsetof(reluctance_phase_command, i_band_A));
static_assert(offsetof(Phase, theta_on) == offsetof(reluctance_phase_command, theta_on_rad));
static_assert(offsetof(Phase, theta_off) == offsetof(reluctance_phase_command, theta_off_rad));
static_assert(offsetof(Phase, i_lower) == offsetof(reluctance_phase_command, i_lower_A));
static_assert(offsetof(Phase, i_centre) == offsetof(reluctance_phase_command, i_centre_A));
static_assert(offsetof(Phase, i_upper) == offsetof(reluctance_phase_command, i_upper_A));
static_assert(offsetof(Phase, i_runaway) == offsetof(reluctance_phase_command, i_runaway_A));
static_assert(offsetof(Measurement, omega_m) == offsetof(reluctance_measurement, omega_m_rad_s));
static_assert(offsetof(Measurement, u_dc) == offsetof(reluctance_measurement, u_dc_V));

/// The sample as the protection judges it: with the observer's speed where there is an observer.
template <srm::Motion motion>
decltype(auto) judged(const Measurement& y, const State& x) {
  if constexpr (motion == srm::Motion::tracked) {
    Measurement tracked = y;
    tracked.omega_m = control.tracker.omega_m(x.law.tracker);
    return tracked;
  } else {
    return (y);
  }
}

void order_all_off(reluctance_command* command) {
  ::new (command) Command(srm::all_off<float, N>());
}

/// Protection, then the law; all legs off where the protection does not admit the sample.
[[gnu::always_inline]] inline void guarded_step(State& x, const Measurement& given, float reference,
                                                reluctance_command* command) {
  const Measurement& y = judged<control.motion>(given, x);
  if (protection.admits(x.guard, y, reference, trip_levels_of(x.parameter))) {
    const Command& orders = *::new (command) Command(
        control.step<control.uses()>(x.law, given, reference, tuning_of(x.parameter)));
    protection.remember(x.guard, y, orders);
  } else {
    order_all_off(command);
  }
}

/// Protection and observer go on while the legs are off; the dc link may still be low.
void watch(State& x, Measurement y, reluctance_command* command) {
  order_all_off(command);
  const auto levels = trip_levels_of(x.parameter);
  y.u_dc = srm::max(y.u_dc, levels.u_dc_min);
  if constexpr (control.uses().observer) control.follow(x.law, y, 0.0F);
  if (protection.admits(x.guard, y, 0.0F, levels)) {
    protection.remember(x.guard, y, srm::all_off<float, N>());
  }
}

/// A law that starts anew, with the rotor already followed.
void start_law(State& x) {
  const auto tracker = x.law.tracker;
  x.law = {};
  x.law.tracker = tracker;
}

reluctance_fault told(const srm::Fault<float>& fault) {
  return {static_cast<reluctance_status>(fault.status), fault.phase, fault.value, fault.limit,
          fault.age};
}

}  // namespace

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
  State fresh;
  fresh.parameter = x.parameter;
  fresh.changes = x.changes + 1;
  x = fresh;
}

[[gnu::flatten]] reluctance_status reluctance_step(reluctance_controller* controller,
                                                   const reluctance_measurement* measurement,
                                                   float reference, reluctance_command* command) {
  State& x = state_of(controller);
  ++x.changes;
  guarded_step(x, *std::launder(reinterpret_cast<const Measurement*>(measurement)), reference,
               command);
  return static_cast<reluctance_status>(x.guard.fault.status);
}

reluctance_mode reluctance_run(reluctance_controller* controller,
                               const reluctance_measurement* measurement,
                               const reluctance_request* request, reluctance_command* command,
                               reluctance_outputs* outputs) {
  State& x = state_of(controller);
  Measurement y = *std::launder(reinterpret_cast<const Measurement*>(measurement));
  const srm::Request<float> ask{request->enable != 0, request->clear != 0, request->sequence,
                                request->reference};
  const auto sequence = sequence_of(x.parameter);
  ++x.changes;
  sequence.correct(x.states, y);
  const srm::Mode before = x.states.mode;
  const srm::Mode mode = sequence.step(x.states, y, ask);
  if (mode == srm::Mode::run) {
    if (before != mode) start_law(x);
    constexpr bool motors =
        control.outer == srm::Outer::torque || control.outer == srm::Outer::none;
    reluctance_measurement corrected;
    const Measurement& seen = *::new (&corrected) Measurement(y);
    reluctance_step(controller, &corrected, sequence.limited(ask, seen, motors), command);
  } else if (mode == srm::Mode::ready) {
    if (before != mode) x.guard = {};
    watch(x, y, command);
  } else if (mode == srm::Mode::fault) {
    x.guard = {};  // judges this sample alone
    watch(x, y, command);
    sequence.clear(x.states, ask, x.guard.fault.status == srm::Status::ok);
    x.guard = {};
  } else {
    x.guard = {};
    order_all_off(command);
  }
  if (x.guard.latched) sequence.fail(x.states, x.guard.fault);
  if (request->tripped != 0) {
    sequence.fail(x.states, {srm::Status::hardware_trip, -1, 0.0F, 0.0F, 0});
  }
  if (x.states.mode != srm::Mode::run) order_all_off(command);
  const auto now = static_cast<reluctance_mode>(x.states.mode);
  *outputs = {now, now == RELUCTANCE_MODE_RUN,
              now >= RELUCTANCE_MODE_CALIBRATE && now <= RELUCTANCE_MODE_RUN,
              x.states.chopper ? 1 : 0};
  return now;
}

reluctance_fault reluctance_get_fault(const reluctance_controller* controller) {
  const State& x = state_of(controller);
  return told(x.states.mode == srm::Mode::fault ? x.states.fault : x.guard.fault);
}

reluctance_status reluctance_get_status(const reluctance_controller* controller) {
  return static_cast<reluctance_status>(state_of(controller).guard.fault.status);
}

float reluctance_torque_reference(const reluctance_controller* controller) {
  return state_of(controller).law.tau_ref;
}

// Of a law that learns: what it has learned.@learned_code@

const char* reluctance_describe(reluctance_status status) {
  return srm::describe(static_cast<srm::Status>(status));
}

uint32_t reluctance_api(void) { return RELUCTANCE_API; }

uint32_t reluctance_fingerprint(void) { return reluctance::fingerprint; }

int8_t reluctance_compared_leg(const reluctance_phase_command* order, int8_t leg, float i_A,
                               float theta_e_rad, int k) {
  const Phase& phase = *std::launder(reinterpret_cast<const Phase*>(order));
  const auto now = static_cast<srm::Leg>(leg);
  return static_cast<int8_t>(srm::compared<N>(phase, now, i_A, theta_e_rad, k));
}
