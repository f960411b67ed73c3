// The C interface over the control headers: protection, then speed loop and control law.
#include <cstddef>
#include <new>

#include "parameters.hpp"
#include "reluctance_controller.h"
#include "srm/control/frame/comparator.hpp"

namespace {

constexpr int N = RELUCTANCE_PHASES;
using reluctance::control;
using reluctance::protection;
using Measurement = srm::Measurement<float, N>;
using Command = srm::Command<float, N>;
using Phase = srm::PhaseCommand<float>;

struct State {
  decltype(protection)::State guard;
  decltype(control)::State law;
};

// The C structs are the C++ ones, so that nothing is copied.
static_assert(sizeof(State) <= sizeof(reluctance_controller));
static_assert(alignof(State) <= alignof(reluctance_controller));
static_assert(sizeof(Measurement) == sizeof(reluctance_measurement));
static_assert(offsetof(Measurement, theta_e) == offsetof(reluctance_measurement, theta_e_rad));
static_assert(offsetof(Measurement, i_source) == offsetof(reluctance_measurement, i_source_A));
static_assert(sizeof(Command) == sizeof(reluctance_command));
static_assert(offsetof(Phase, leg) == offsetof(reluctance_phase_command, leg));
static_assert(offsetof(Phase, t_edge) == offsetof(reluctance_phase_command, t_edge_s));
static_assert(offsetof(Phase, i_ref) == offsetof(reluctance_phase_command, i_ref_A));
static_assert(offsetof(Phase, chop) == offsetof(reluctance_phase_command, chop));
static_assert(offsetof(Phase, theta_off) == offsetof(reluctance_phase_command, theta_off_rad));

State& state_of(reluctance_controller* controller) {
  return *std::launder(reinterpret_cast<State*>(controller));
}
const State& state_of(const reluctance_controller* controller) {
  return *std::launder(reinterpret_cast<const State*>(controller));
}

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

}  // namespace

void reluctance_init(reluctance_controller* controller) { ::new (controller) State(); }

void reluctance_reset(reluctance_controller* controller) { reluctance_init(controller); }

[[gnu::flatten]] reluctance_status reluctance_step(reluctance_controller* controller,
                                                   const reluctance_measurement* measurement,
                                                   float reference, reluctance_command* command) {
  State& x = state_of(controller);
  const auto& given = *std::launder(reinterpret_cast<const Measurement*>(measurement));
  const Measurement& y = judged<control.motion>(given, x);
  if (protection.admits(x.guard, y, reference)) {
    const Command& orders = *::new (command) Command(
        control.step<control.outer == srm::Outer::pv>(x.law, given, reference));
    protection.remember(x.guard, y, orders);
  } else {
    ::new (command) Command(srm::all_off<float, N>());
  }
  return static_cast<reluctance_status>(x.guard.status);
}

reluctance_status reluctance_get_status(const reluctance_controller* controller) {
  return static_cast<reluctance_status>(state_of(controller).guard.status);
}

float reluctance_torque_reference(const reluctance_controller* controller) {
  return state_of(controller).law.tau_ref;
}

const char* reluctance_describe(reluctance_status status) {
  return srm::describe(static_cast<srm::Status>(status));
}

uint32_t reluctance_fingerprint(void) { return reluctance::fingerprint; }

int8_t reluctance_compared_leg(const reluctance_phase_command* order, int8_t leg, float i_A,
                               float theta_e_rad, int k) {
  const Phase& phase = *std::launder(reinterpret_cast<const Phase*>(order));
  const auto now = static_cast<srm::Leg>(leg);
  return static_cast<int8_t>(srm::compared<N>(phase, now, i_A, theta_e_rad, k));
}
