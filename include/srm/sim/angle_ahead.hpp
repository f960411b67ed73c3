// Rotor angles ahead at which something happens: the end of the electrical period, the edge of a
// conduction window.
#pragma once

#include <algorithm>
#include <cmath>

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

/// The nearest of all of them [rad].
template <Motor M, int N>
double next_angle(const Plant<M, N>& plant, const SimulationState<N>& now,
                  const SensedAngle& sensed) {
  const double theta_m = now.x().theta_m;
  double ahead = std::abs(now.theta_period - theta_m);
  for (int k = 0; k < N; ++k) {
    const PhaseCommand<double>& c = now.gates.command[k];
    if (c.gate != Gate::window) continue;
    ahead = std::min(ahead, sensed.to_edge(c, electrical_angle(plant, theta_m, k)));
  }
  return theta_m + now.direction() * ahead;
}

}  // namespace srm
