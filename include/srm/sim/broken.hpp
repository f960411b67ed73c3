// What the faults of a run (plant/faults.hpp) make of circuit, sensors and comparators by now.
#pragma once

#include <algorithm>
#include <cstddef>
#include <variant>
#include <vector>

#include "srm/sim/angle_ahead.hpp"

namespace srm {

/// Whether fault j of the list is present.
template <Motor M, int N>
bool is_present(const Plant<M, N>& plant, const SimulationState<N>& now, const BrokenPart& part,
                std::size_t j) {
  if (!now.awaits(part, j)) return now.t >= part.start && now.t < part.end;
  const double gap = to_fault(plant, now, part) * plant.machine.N_r;
  return std::min(gap, two_pi<double> - gap) <= 2 * plant.machine.N_r * angle_tolerance;
}

/// When the next one begins or ends, at the latest [s].
inline double next_fault(const std::vector<BrokenPart>& faults, double now) {
  double t = never<double>;
  for (const BrokenPart& part : faults) {
    if (part.start > now) t = std::min(t, part.start);
    if (part.end > now) t = std::min(t, part.end);
  }
  return t;
}

/// What the terminals of winding k carry, over its current: none where the diodes block and the
/// current goes on through shorted turns.
template <Motor M, int N>
Line terminal(const Plant<M, N>& plant, const SimulationState<N>& now, int k) {
  if (!now.circuit.leaks) return {};
  const BrokenPhase& is = now.condition.phase[k];
  const Path& path = now.circuit.paths.phase[k];
  const double G = is.open ? 0 : is.G_turns, u_dc = now.x().u_dc;
  return {1 - G * (path.R - plant.R),
          G * (path.level * u_dc - path.v) + now.circuit.leak[k].G_ground * u_dc};
}

/// What the current channel of phase k shows, over the current of its winding.
template <Motor M, int N>
Line channel(const Plant<M, N>& plant, const SimulationState<N>& now, int k) {
  return terminal(plant, now, now.condition.channel[k]).then(now.condition.phase[k].channel);
}

/// What the sensor of a fault shows.
template <Motor M, int N>
double shown_by(const Plant<M, N>& plant, const SimulationState<N>& now, const BrokenPart& part) {
  const State<N>& x = now.x();
  if (part.kind != Broken::sensor_stuck) return now.condition.rotor.at(x.theta_m);
  return channel(plant, now, part.phase).at(x.i[now.condition.channel[part.phase]]);
}

/// The state as the sensors show it.
template <Motor M, int N>
State<N> shown(const Plant<M, N>& plant, const SimulationState<N>& now) {
  State<N> y = now.x();
  const Condition<N>& is = now.condition;
  for (int k = 0; k < N; ++k) y.i[k] = channel(plant, now, k).at(now.x().i[is.channel[k]]);
  y.theta_m = is.rotor.at(y.theta_m);
  y.omega_m *= is.rotor.slope;
  return y;
}

/// The current of winding k with which its terminals carry none [A].
template <Motor M, int N>
double blocks_at(const Plant<M, N>& plant, const SimulationState<N>& now, int k) {
  const Leak& leak = now.circuit.leak[k];
  const Path& path = now.circuit.paths.phase[k];
  const double v = path.v - path.level * now.x().u_dc;
  return leak.G * v / (1 - leak.G * (path.R - plant.R));
}

/// The current past winding k, and its path. Its diodes can block while it carries current.
/// i_small: a difference that does not matter [A].
template <Motor M, int N>
void divide(const Plant<M, N>& plant, SimulationState<N>& now, int k, double i_small) {
  const BrokenPhase& is = now.condition.phase[k];
  Leak& leak = now.circuit.leak[k];
  Path& path = now.circuit.paths.phase[k];
  const auto outer_path = [&]<class B>(const B& bridge) {
    if constexpr (PhaseByPhase<B>) return bridge.path(now.legs[k]);
    return Path{};
  };
  Path outer = std::visit(outer_path, plant.bridge);
  outer.R += is.R_contact;
  const bool upper = is.upper_on(now.gates.switches[k].leg);
  leak = {0, outer.level, upper ? is.G_link : 0, upper ? is.G_ground : 0};
  now.rated = false;
  if (!(is.G_turns > 0) || is.open) return;
  const double part = 1 / (1 + outer.R * is.G_turns);
  path = {part * outer.level, part * outer.v, part * outer.R + plant.R};
  leak.G = is.G_turns;
  if (now.legs[k] == Leg::magnetize || now.x().i[k] > blocks_at(plant, now, k) + i_small) return;
  path = {0, 0, 1 / is.G_turns + plant.R};
  leak.G = leak.level = 0;
}

}  // namespace srm
