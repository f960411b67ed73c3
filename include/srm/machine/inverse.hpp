// Current from flux linkage, for any machine.
#pragma once

#include "srm/machine/magnetics.hpp"

namespace srm {

/// The current in [0, i_max] whose flux linkage is psi at theta_e; the nearer end where there is
/// none.
///
/// Newton's method inside a bracket that shrinks every step, halved where Newton leaves it. The
/// count is fixed, so the time on the target is too. From zero current, on the paper's machine and
/// a map of it to 450 A, the flux settles to rounding in 8 steps (float) and 10 (double); 2 more
/// are a margin.
template <Machine M>
constexpr typename M::Scalar current_from_flux(const M& machine, typename M::Scalar psi,
                                               typename M::Scalar theta_e,
                                               typename M::Scalar i_max) {
  using T = typename M::Scalar;
  constexpr int n_steps = sizeof(T) == sizeof(float) ? 10 : 12;
  if (!(psi > T(0))) return T(0);
  if (psi >= machine.at(i_max, theta_e).psi) return i_max;
  T low = T(0);
  T high = i_max;
  T i = T(0);
  for (int step = 0; step < n_steps; ++step) {
    const Magnetics<T> here = machine.at(i, theta_e);
    if (here.psi > psi) {
      high = i;
    } else {
      low = i;
    }
    i = i + (psi - here.psi) / here.L_inc;
    if (!(i >= low && i <= high)) i = (low + high) / T(2);
  }
  return i;
}

}  // namespace srm
