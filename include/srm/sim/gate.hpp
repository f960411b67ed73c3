// The gate drive of one phase: executes a PhaseCommand between two samples.
#pragma once

#include <limits>

#include "srm/control/frame/comparator.hpp"

namespace srm {

/// The currents between which a phase stays as it is.
struct Span {
  double below = -std::numeric_limits<double>::infinity();
  double above = std::numeric_limits<double>::infinity();
};

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

/// True while the comparator is in charge, and has a reference.
inline bool compares(const PhaseCommand<double>& c, const GateState& gate) {
  const bool open = c.gate == Gate::comparator || (c.gate == Gate::window && gate.inside);
  return open && c.i_ref > 0;
}

/// The comparator's thresholds below and above the current.
inline Span awaited(const PhaseCommand<double>& c, const GateState& gate) {
  Span span;
  if (!compares(c, gate)) return span;
  switch (gate.leg) {
    case Leg::magnetize:
      span.above = c.i_upper;
      break;
    case Leg::freewheel:
      span = {c.i_lower, c.i_runaway};
      break;
    case Leg::demagnetize:
      span.below = c.chop == Leg::freewheel ? c.i_centre : c.i_lower;
  }
  return span;
}

/// The leg once the current meets the threshold below or above it.
inline Leg after(const PhaseCommand<double>& c, const GateState& gate, bool above) {
  switch (gate.leg) {
    case Leg::magnetize:
      return c.chop;
    case Leg::freewheel:
      return above ? Leg::demagnetize : Leg::magnetize;
    case Leg::demagnetize:
      return c.chop == Leg::freewheel ? Leg::freewheel : Leg::magnetize;
  }
  return Leg::demagnetize;
}

}  // namespace srm
