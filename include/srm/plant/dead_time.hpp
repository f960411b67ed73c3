// Dead time: a switch turns on this much later than ordered, and off at once.
//
// With synchronous rectification the two transistors of a bridge arm must never conduct together:
// the one that turns on waits, and the diode of the other carries the current meanwhile. The
// turn-on delay of a gate driver has the same effect on the winding.
#pragma once

#include <array>

#include "srm/base/leg.hpp"

namespace srm {

/// What the switches of a leg do. Its level -1, 0 or 1 is the number of them that are on, less one.
struct SwitchedLeg {
  Leg leg = Leg::demagnetize;    // what the winding sees
  std::array<double, 2> t_on{};  // from when levels 0 and 1 can be reached [s]
};

/// The order changes: switches that it newly turns on are on from t_on.
constexpr void delay_turn_on(SwitchedLeg& switches, Leg before, Leg after, double t_on) {
  for (int level = static_cast<int>(before) + 1; level <= static_cast<int>(after); ++level) {
    switches.t_on[level] = t_on;
  }
}

/// The leg at time t under an order: an order that falls back in time turns nothing on.
constexpr Leg reached(const SwitchedLeg& switches, Leg order, double t) {
  int level = static_cast<int>(order);
  while (level >= 0 && switches.t_on[level] > t) --level;
  return static_cast<Leg>(level);
}

/// When a leg that lags behind its order rises next [s].
constexpr double next_rise(const SwitchedLeg& switches) {
  return switches.t_on[static_cast<int>(switches.leg) + 1];
}

}  // namespace srm
