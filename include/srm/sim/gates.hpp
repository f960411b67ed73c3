// The gate drives of all phases, from the orders to what the windings see.
//
// Every switching instant is an event: a timer edge, a current that meets a comparator threshold,
// an angle that meets a position compare, a current that reaches zero. This file says which event
// comes next for a phase and what the leg does then; the loop locates the instant.
#pragma once

#include <algorithm>
#include <utility>

#include "srm/plant/dead_time.hpp"
#include "srm/sim/gate.hpp"

namespace srm {

/// A plain value.
template <int N>
struct Gates {
  std::array<GateState, N> gate;
  std::array<SwitchedLeg, N> switches;
  Command<double, N> command, pending;
  double t_orders = 0;  // since when the orders are in effect [s]

  /// Orders from a sample at time t, in effect at once or, with a delay, at the next one.
  void take(const Command<double, N>& orders, bool late, double t) {
    command = late ? std::exchange(pending, orders) : orders;
    t_orders = t;
    for (GateState& g : gate) g.edges = 0;
  }

  /// Brings the gate of phase k to what the orders ask for at time t and current i.
  void follow(int k, double t, double i, double t_dead) {
    if (command[k].gate == Gate::timer) {
      int& edges = gate[k].edges;
      while (edges < max_edges && t_orders + command[k].t_edge[edges] <= t) ++edges;
    }
    order(k, ordered(command[k], gate[k], i), t + t_dead);
  }

  /// t_on: from when switches that turn on are on [s].
  void order(int k, Leg leg, double t_on) {
    if (leg == gate[k].leg) return;
    delay_turn_on(switches[k], gate[k].leg, leg, t_on);
    gate[k].leg = leg;
  }

  /// True while a dead time of phase k runs.
  bool lags(int k) const { return switches[k].leg != gate[k].leg; }

  /// The switches of phase k do what its gate orders, as far as dead time lets them at time t. True
  /// where one did something.
  bool settle(int k, double t) {
    if (!lags(k)) return false;
    const Leg leg = reached(switches[k], gate[k].leg, t);
    return std::exchange(switches[k].leg, leg) != leg;
  }

  /// Those of all phases.
  bool settle(double t) {
    bool changed = false;
    for (int k = 0; k < N; ++k) changed = settle(k, t) || changed;
    return changed;
  }

  std::array<Leg, N> levels() const {
    std::array<Leg, N> leg;
    for (int k = 0; k < N; ++k) leg[k] = switches[k].leg;
    return leg;
  }

  /// The next instant that is known for phase k; infinity where there is none [s].
  double next_instant(int k) const {
    double t = std::numeric_limits<double>::infinity();
    if (lags(k)) t = next_rise(switches[k]);
    const int edges = gate[k].edges;
    if (command[k].gate == Gate::timer && edges < max_edges) {
      t = std::min(t, t_orders + command[k].t_edge[edges]);
    }
    return t;
  }
};

}  // namespace srm
