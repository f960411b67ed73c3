// Negative torque by the machine's mirror symmetry, so that every law is written for positive
// torque.
//
// Phase flux is even in the electrical angle: psi(i, 2 pi - theta) = psi(i, theta), torque is odd.
// So torque -tau at theta is torque +tau at 2 pi - theta with the speed reversed.
#pragma once

#include "srm/base/angle.hpp"

namespace srm {

/// Angle of phase k, mirrored where tau_ref < 0: torque of the wanted sign is on (0, pi) in both
/// cases.
template <int N, Real T>
constexpr T drive_angle(T theta_e, int k, T tau_ref) {
  const T theta = phase_angle<N>(theta_e, k);
  return tau_ref < T(0) ? wrap(two_pi<T> - theta) : theta;
}

}  // namespace srm
