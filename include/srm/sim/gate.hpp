// The gate drive of one phase: executes a PhaseCommand between two samples.
//
// Every switching instant is an event: a timer edge, a current that meets a comparator threshold,
// an angle that meets a position compare, a current that reaches zero. This file says which event
// comes next for a phase and what the leg does then; the loop locates the instant.
#pragma once

#include "srm/control/frame/comparator.hpp"

namespace srm {

/// A current threshold ahead of the phase, and the leg once it is met. direction: +1 the current
/// meets it from below, -1 from above, 0 there is none.
struct Crossing {
  double i = 0;
  int direction = 0;
  Leg then = Leg::demagnetize;
};

/// What the comparator waits for: up to two thresholds, one above and one below the current.
inline std::array<Crossing, 2> awaited(const PhaseCommand<double>& c, Leg leg) {
  if (!(c.i_ref > 0)) return {};
  switch (leg) {
    case Leg::magnetize:
      return {Crossing{c.i_upper, +1, c.chop}};
    case Leg::freewheel:
      return {Crossing{c.i_lower, -1, Leg::magnetize}, {c.i_runaway, +1, Leg::demagnetize}};
    case Leg::demagnetize:
      if (c.chop == Leg::freewheel) return {Crossing{c.i_centre, -1, Leg::freewheel}};
      return {Crossing{c.i_lower, -1, Leg::magnetize}};
  }
  return {};
}

/// What the gate drive of a phase remembers between events.
struct GateState {
  Leg leg = Leg::demagnetize;
  int edges = 0;        // timer edges already passed in this sample
  bool inside = false;  // of the conduction window
};

/// The leg that follows from the orders, the gate's memory and the present current.
inline Leg ordered(const PhaseCommand<double>& c, const GateState& gate, double i) {
  switch (c.gate) {
    case Gate::off:
      return Leg::demagnetize;
    case Gate::timer:
      return c.leg[gate.edges];
    case Gate::comparator:
      return compared(c, gate.leg, i);
    case Gate::window:
      return gate.inside ? compared(c, gate.leg, i) : Leg::demagnetize;
  }
  return Leg::demagnetize;
}

/// The currents the phase waits for: the comparator's thresholds while it is in charge.
inline std::array<Crossing, 2> awaited(const PhaseCommand<double>& c, const GateState& gate) {
  if (c.gate == Gate::off || c.gate == Gate::timer || (c.gate == Gate::window && !gate.inside))
    return {};
  return awaited(c, gate.leg);
}

}  // namespace srm
