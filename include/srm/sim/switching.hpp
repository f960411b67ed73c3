// What the switches make of the circuits of the windings.
#pragma once

#include <variant>

#include "srm/sim/broken.hpp"

namespace srm {

inline constexpr double arc_part = 2;  // voltage of an arc, of u_dc

/// The path of winding k by what its switches are now. i_small: as of `divide`.
template <Motor M, int N, PhaseByPhase B>
void connect(const Plant<M, N>& plant, const B& bridge, SimulationState<N>& now, int k,
             double i_small) {
  const BrokenPhase& is = now.condition.phase[k];
  const double u_dc = now.x().u_dc;
  const Leg leg = is.leg(now.gates.switches[k].leg);
  bridge.count(now.switchings, now.legs[k], leg, u_dc, now.x().i[k]);
  now.legs[k] = leg;
  Path& path = now.circuit.paths.phase[k];
  path = bridge.path(leg);
  path.R += is.R_contact;
  if (is.open) path = {0, arc_part * u_dc, 0};
  path.R += plant.R;
  now.rated = false;
  if (now.circuit.leaks) divide(plant, now, k, i_small);
}

/// Those of all windings, where each has a leg of its own: no other bridge breaks.
template <Motor M, int N>
void connect_all(const Plant<M, N>& plant, SimulationState<N>& now, double i_small) {
  const auto each = [&]<class B>(const B& bridge) {
    if constexpr (PhaseByPhase<B>) {
      for (int k = 0; k < N; ++k) connect(plant, bridge, now, k, i_small);
    }
  };
  std::visit(each, plant.bridge);
}

/// The switches of phase k do what they can by now, where its leg is its own.
template <Motor M, int N>
void settle(const Plant<M, N>& plant, SimulationState<N>& now, int k, double i_small) {
  if (!now.gates.settle(k, now.t)) return;
  const auto one = [&]<class B>(const B& bridge) {
    if constexpr (PhaseByPhase<B>) connect(plant, bridge, now, k, i_small);
  };
  std::visit(one, plant.bridge);
}

/// Those of all phases.
template <Motor M, int N>
void settle(const Plant<M, N>& plant, SimulationState<N>& now, double i_small) {
  if (is_phase_by_phase(plant.bridge)) {
    for (int k = 0; k < N; ++k) settle(plant, now, k, i_small);
    return;
  }
  if (!now.gates.settle(now.t)) return;
  const auto all = [&]<class B>(const B& bridge) {
    if constexpr (!PhaseByPhase<B>) {
      const AllLegs<N> legs = bridge.legs(now.gates.levels());
      bridge.count(now.switchings, now.legs, legs, now.x().u_dc, now.x().i);
      now.legs = legs;
      now.circuit.paths = with_windings(bridge.paths(legs), plant.R);
      now.rated = false;
    }
  };
  std::visit(all, plant.bridge);
}

}  // namespace srm
