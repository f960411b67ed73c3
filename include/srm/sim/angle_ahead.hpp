// Rotor angles ahead at which something happens: the end of the electrical period, the edge of a
// conduction window, a fault.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "srm/sim/simulation_state.hpp"
#include "srm/sim/window.hpp"

namespace srm {

/// The next end of an electrical period [rad].
template <Motor M, int N>
double next_period(const Plant<M, N>& plant, const SimulationState<N>& now) {
  const double pitch = two_pi<double> / plant.machine.N_r, theta_m = now.x().theta_m;
  const double passed = std::round(theta_m / pitch);
  const bool near = std::abs(theta_m - passed * pitch) <= angle_tolerance;
  const double periods = near ? passed : theta_m / pitch;
  return pitch * (now.direction() < 0 ? std::ceil(periods) - 1 : std::floor(periods) + 1);
}

/// How far the rotor is from the angle at which a fault begins [rad].
template <Motor M, int N>
double to_fault(const Plant<M, N>& plant, const SimulationState<N>& now, const BrokenPart& part) {
  const double theta_e = electrical_angle(plant, now.x().theta_m, part.phase);
  return wrap(now.direction() * (part.theta_e - theta_e)) / plant.machine.N_r;
}

/// The nearest of all of them [rad].
template <Motor M, int N>
double next_angle(const Plant<M, N>& plant, const SimulationState<N>& now,
                  const SensedAngle& sensed, const std::vector<BrokenPart>& faults) {
  const double theta_m = now.x().theta_m;
  double ahead = std::abs(now.theta_period - theta_m);
  const Condition<N>& is = now.condition;
  for (int k = 0; k < N; ++k) {
    const PhaseCommand<double>& c = now.gates.command[k];
    if (c.gate != Gate::window) continue;
    const double theta_e = electrical_angle(plant, is.rotor.at(theta_m), is.phase[k].ordered);
    ahead = std::min(ahead, sensed.to_edge(c, theta_e) / std::abs(is.rotor.slope));
  }
  for (std::size_t j = 0; j < faults.size(); ++j) {
    const double gap = now.awaits(faults[j], j) ? to_fault(plant, now, faults[j]) : 0;
    if (gap > angle_tolerance) ahead = std::min(ahead, gap);
  }
  return theta_m + now.direction() * ahead;
}

}  // namespace srm
