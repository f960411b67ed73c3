// The supervised drive of this package, and what a reluctance_controller holds: its state, and the
// parameters that may change at run time.
#pragma once

#include <array>
#include <new>
#include <type_traits>

#include "parameters.hpp"
#include "reluctance_controller.h"
#include "srm/control/guard/@guarded_header@.hpp"
#include "srm/control/guard/supervised.hpp"

namespace reluctance {

inline constexpr int n_run_time = static_cast<int>(sizeof run_time / sizeof run_time[0]);

constexpr std::array<float, n_run_time> built_parameters() {
  std::array<float, n_run_time> value{};
  for (int n = 0; n < n_run_time; ++n) value[n] = run_time[n].built;
  return value;
}

template <class V>
using Plain = std::remove_const_t<V>;
using Undiagnosed = srm::Guarded<Plain<decltype(machine)>, Plain<decltype(control)>>;
using Guarded = @guarded@;

/// The same with the parameters that may change at run time: what the states of the drive call.
struct OnTarget : Guarded {
  struct State : Guarded::State {
    std::array<float, n_run_time> parameter = built_parameters();
  };
  struct Tuning {};
  static constexpr srm::Uses used = reluctance::control.uses();
  static constexpr Guarded::Tuning tuning_of(const State& x) {
    return {trip_levels_of(x.parameter), control_of(x.parameter)};
  }

  /// Once in flash, for both entries of the interface.
  static reluctance_status once(State& x, const srm::Measurement<float, N>& y, float reference,
                                srm::Command<float, N>& orders);
  reluctance_status step(State& x, const srm::Measurement<float, N>& y, float reference,
                         srm::Command<float, N>& orders, Tuning) const {
    return once(x, y, reference, orders);
  }
  float speed(const State& x, const srm::Measurement<float, N>& y) const {
    return Guarded::speed<used>(x, y);
  }
  void watch(State& x, const srm::Measurement<float, N>& y, Tuning) const {
    Guarded::watch<used>(x, y, tuning_of(x));
  }
};
using Drive = srm::Supervised<OnTarget>;
constexpr Drive drive{sequence, {@guarded_values@}};

struct State : Drive::State {
  std::uint32_t changes = 0;  // one more with each call that changes the state
};

static_assert(sizeof(State) <= sizeof(reluctance_controller));
static_assert(alignof(State) <= alignof(reluctance_controller));

inline State& state_of(reluctance_controller* controller) {
  return *std::launder(reinterpret_cast<State*>(controller));
}
inline const State& state_of(const reluctance_controller* controller) {
  return *std::launder(reinterpret_cast<const State*>(controller));
}

}  // namespace reluctance
