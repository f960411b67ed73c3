// What a reluctance_controller holds: the state of the protection, of the law, and of the drive,
// and the parameters that may change at run time.
#pragma once

#include <array>
#include <new>

#include "parameters.hpp"
#include "reluctance_controller.h"

namespace reluctance {

inline constexpr int n_run_time = static_cast<int>(sizeof run_time / sizeof run_time[0]);

constexpr std::array<float, n_run_time> built_parameters() {
  std::array<float, n_run_time> value{};
  for (int n = 0; n < n_run_time; ++n) value[n] = run_time[n].built;
  return value;
}

struct State {
  decltype(protection)::State guard;
  decltype(control)::State law;
  decltype(sequence)::State<RELUCTANCE_PHASES> states;
  std::array<float, n_run_time> parameter = built_parameters();
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
