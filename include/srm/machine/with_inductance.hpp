// A machine with a constant inductance in addition: psi = psi_map(i, theta) + L_more i. It does not
// change with the angle, so it makes no torque.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

template <Machine M>
struct WithInductance {
  using Scalar = typename M::Scalar;
  using T = Scalar;

  M map;
  int N_r;   // rotor poles
  T L_more;  // may be negative, but less than the least of the map's [H]
  SRM_FIELDS(map, N_r, L_more)

  /// i >= 0 [A], theta_e in [0, 2 pi).
  [[gnu::always_inline]] constexpr Magnetics<T> at(T i, T theta_e) const {
    Magnetics<T> m = map.at(i, theta_e);
    m.psi = m.psi + L_more * i;
    m.W_c = m.W_c + L_more * i * i * T(0.5);
    m.L_inc = m.L_inc + L_more;
    return m;
  }
};

}  // namespace srm
