// The cost of a turn-on that makes a wanted switching frequency.
//
// A phase at duty D makes torque ripple at the rate s = u_dc gain D (1 - D); held within +-A its
// pulse period is 2 A/s. With A^3 = (3/4) w_sw s (edge_plan.hpp) a phase turns on
// s^(2/3) (3 w_sw/4)^(-1/3)/2 times a second, and its two switches share that. So
//
//   w_sw = (4/3) (mean of s^(2/3) over an electrical period/(4 f_switch))^3
//
// taken along the guide at one torque and speed. Legs that switch for two phases at once make the
// frequency reached 10 to 20 % lower.
#pragma once

#include "srm/control/part/reference_profile.hpp"
#include "srm/machine/inverse.hpp"

namespace srm {

/// Cube root of x >= 0; 0 for anything else.
template <Real T>
constexpr T cube_root(T x) {
  if (!(x > T(1e-30) && x < T(1e30))) return T(0);
  T scale = T(1);
  for (; x > T(1); x = x / T(8)) scale = scale * T(2);
  for (; x < T(0.125); x = x * T(8)) scale = scale / T(2);
  T root = T(0.75);
  for (int n = 0; n < 4; ++n) root = root - (root * root * root - x) / (T(3) * root * root);
  return scale * root;
}

/// How fast one phase makes torque ripple [N m/s]. gain: dtau/dpsi; u: mean winding voltage. Duties
/// outside 0.1..0.9 count as these: near them the guide holds a leg anyway.
template <Real T>
constexpr T ripple_rate(T gain, T u, T u_dc) {
  const T duty = clamp(u < T(0) ? u / u_dc + T(1) : u / u_dc, T(0.1), T(0.9));
  return abs(gain) * u_dc * duty * (T(1) - duty);
}

/// guide: flux linkage at this torque and speed. f_switch: turn-ons per switch and second.
template <Machine M, class T = typename M::Scalar>
T switching_weight(const M& machine, const Profile<T>& guide, T R, T omega_m, T u_dc, T i_max,
                   T f_switch) {
  const int columns = guide.row.columns;
  const T step = two_pi<T> / static_cast<T>(columns);
  const T omega_e = static_cast<T>(machine.N_r) * omega_m;
  T sum = T(0);
  for (int j = 0; j < columns; ++j) {
    const T theta = step * (static_cast<T>(j) + T(0.5));
    const T psi = guide.at(theta);
    const T i = current_from_flux(machine, psi, theta, i_max);
    if (!(i > i_max / T(200))) continue;
    const T rise = guide.at(wrap(theta + step / T(2))) - guide.at(theta - step / T(2));
    const T u = R * i + rise / step * omega_e;
    if (abs(u) > T(0.98) * u_dc) continue;  // one long pulse: no switching here
    const Magnetics<T> m = machine.at(i, theta);
    const T root = cube_root(ripple_rate(m.psi_theta / m.L_inc, u, u_dc));
    sum = sum + root * root;
  }
  const T ratio = sum / static_cast<T>(columns) / (T(4) * f_switch);
  return T(4) / T(3) * ratio * ratio * ratio;
}

}  // namespace srm
