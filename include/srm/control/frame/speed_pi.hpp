// Speed control: proportional and integral action on the speed error, on top of a torque that is
// known ahead, give the torque reference.
//
// The integral stops while the torque is at a limit and the error pushes further, so it does not
// wind up (conditional integration). K. J. Astrom, T. Hagglund, Advanced PID Control, ISA 2006,
// ch. 3.5.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/base/real.hpp"

namespace srm {

template <Real T>
struct SpeedPi {
  struct State {
    T tau_integral{};  // [N m]
  };

  T K_p;               // [N m s/rad]
  T K_i;               // [N m/rad]
  T tau_min, tau_max;  // [N m]
  T T_s;               // [s]
  SRM_FIELDS(K_p, K_i, tau_min, tau_max, T_s)

  /// tau_ahead: of the load and of the acceleration that is asked for, as far as known [N m].
  constexpr T step(State& x, T omega_ref, T omega_m, T tau_ahead = T(0)) const {
    const T error = omega_ref - omega_m;
    const T tau = K_p * error + x.tau_integral + tau_ahead;
    const bool pushes_out = (tau >= tau_max && error > T(0)) || (tau <= tau_min && error < T(0));
    if (!pushes_out) x.tau_integral = clamp(x.tau_integral + K_i * T_s * error, tau_min, tau_max);
    return clamp(tau, tau_min, tau_max);
  }
};

}  // namespace srm
