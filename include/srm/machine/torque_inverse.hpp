// Phase torque to current: the machine's own torque map, inverted where it is needed.
//
// On the motoring half torque grows with current: as i^2 before saturation, towards i after it, in
// general with the local exponent n = (i/tau) dtau/di. Newton's method is exact for a quadratic map
// if taken on sqrt(tau), and exact for a straight one if taken on tau; the step here is the mean of
// the two, weighted by n:
//
//   step = [(n - 1) 2 (sqrt(tau_ref tau) - tau) + (2 - n) (tau_ref - tau)]/(dtau/di)
//
// with dtau/di = d2W_c/didtheta = psi_theta, which `at` gives anyway. On the paper's machine three
// steps from i_max/8 leave 1e-4 of the torque for every i_max up to 300 A; Newton on sqrt(tau)
// alone leaves 7e-3. A table over torque and angle would be as quick, but it is steep where a phase
// starts, costs kilobytes, and is a second map that can contradict the first.
#pragma once

#include "srm/machine/magnetics.hpp"

namespace srm {

/// Least current >= 0 that gives phase torque tau >= 0 at theta_e; i_max where that does not
/// suffice, 0 where no current gives positive torque.
template <Machine M, class T = typename M::Scalar>
T current_for_torque(const M& machine, T tau, T theta_e, T i_max) {
  if (!(tau > T(0))) return T(0);
  T i = i_max / T(8);
  for (int steps = 0; steps < 3; ++steps) {
    const Magnetics<T> y = machine.at(i, theta_e);
    if (!(y.tau > T(0) && y.psi_theta > T(0))) return T(0);
    const T curved = clamp(i * y.psi_theta / y.tau - T(1), T(0), T(1));
    const T quadratic = T(2) * (sqrt(tau * y.tau) - y.tau);
    const T straight = tau - y.tau;
    const T step = (straight + curved * (quadratic - straight)) / y.psi_theta;
    i = clamp(i + step, i / T(4), i_max);
    if (abs(step) < i / T(32)) break;  // the error falls at least with the square of the step
  }
  return i;
}

}  // namespace srm
