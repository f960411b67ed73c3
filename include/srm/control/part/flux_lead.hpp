// Flux that is there when it is needed: the start of a braking phase.
//
// Braking, a phase takes its share over just past alignment, where a little torque needs much flux.
// Flux does not jump: per electrical radian it grows by at most s = (u - R i)/omega_e. So the phase
// must follow a line of that slope beforehand, the lowest one that nowhere passes below the flux of
// its share,
//
//   psi(x) = c + s x,  c = max over x >= 0 of psi_share(x) - s x,
//
// with x the angle travelled since the share starts. The line begins at -c/s, where the phase still
// gives torque of the wrong sign, and ends where it meets the flux of the share. c and the end are
// tables over torque and 1/s, made offline from the machine and its sharing function.
#pragma once

#include <array>

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"

namespace srm {

template <Real T>
struct FluxLead {
  static constexpr int points = 9;  // of the torques, and of the angles per flux

  T theta_start;  // where the share starts, in the frame of positive torque [rad]
  T tau_max;      // last torque of the tables [N m]
  T reach_max;    // last angle per flux, 1/s, of the tables [rad/Wb]
  std::array<T, points * points> psi_start;  // c, for each angle per flux over the torques [Wb]
  std::array<T, points * points> x_end;      // where the line meets the share [rad]
  SRM_FIELDS(theta_start, tau_max, reach_max, psi_start, x_end)

  /// Least flux at theta, of a rotor that turns towards smaller angles of this frame, for a torque
  /// tau > 0; 0 where the share decides. slope: of flux at full voltage [Wb/rad].
  constexpr T flux(T theta, T tau, T slope) const {
    if (!(slope * reach_max > T(0))) return T(0);
    const T row = clamp(T(1) / (slope * reach_max), T(0), T(1)) * T(points - 1);
    const T column = clamp(tau / tau_max, T(0), T(1)) * T(points - 1);
    const T x = wrap(theta_start - theta + pi<T>) - pi<T>;
    if (x >= between(x_end, row, column)) return T(0);
    return max(between(psi_start, row, column) + slope * x, T(0));
  }

 private:
  static constexpr T between(const std::array<T, points * points>& table, T row, T column) {
    const int j = row < T(points - 1) ? static_cast<int>(row) : points - 2;
    const int k = column < T(points - 1) ? static_cast<int>(column) : points - 2;
    const T a = row - static_cast<T>(j), b = column - static_cast<T>(k);
    const T* const low = table.data() + j * points + k;
    const T* const high = low + points;
    return (T(1) - a) * ((T(1) - b) * low[0] + b * low[1]) +
           a * ((T(1) - b) * high[0] + b * high[1]);
  }
};

}  // namespace srm
