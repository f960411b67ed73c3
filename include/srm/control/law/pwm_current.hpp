// Conduction angles with PI current control and centre-aligned PWM.
//
// The winding is u = R i + L_inc di/dt + emf. Feed-forward of R i_ref and of the back-EMF leaves
// the inductance; K_p = L_inc bandwidth then gives a first-order loop of that bandwidth at every
// angle and current, and K_i = R bandwidth removes what the model misses. The integral stops while
// the voltage is at its limit. F. Blaabjerg, P. C. Kjaer, P. O. Rasmussen, C. Cossar, "Improved
// digital current control methods in switched reluctance motor drives", IEEE Trans. Power Electron.
// 14(3), 1999.
//
// A loop of that bandwidth lags where a pulse has few samples: the mean torque is held by feedback
// (mean_hold.hpp).
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/mean_hold.hpp"
#include "srm/control/part/mean_torque.hpp"
#include "srm/control/part/mirror.hpp"
#include "srm/control/part/modulator.hpp"
#include "srm/control/part/per_phase.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

template <Machine M, int N>
struct PwmCurrent {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  static constexpr int n_phases = N;
  struct State {
    std::array<T, N> u_integral{};  // [V]
    MeanHold<T> mean;
  };

  M machine;
  T R;  // phase resistance [ohm]
  Conduction<T> conduction;
  MeanTorque<T> reference;
  T bandwidth;  // of the current loop [rad/s]; below 0.3/T_s with one sample of delay
  T T_s;        // control and carrier period [s]
  SRM_FIELDS(machine, R, conduction, reference, bandwidth, T_s)

  constexpr Command<T, N> step(State& x, const Measurement<T, N>& y, T tau_ref) const {
    const Window<T> window = conduction.template window<N>(y.omega_m, tau_ref);
    const bool braking = brakes(y.omega_m, tau_ref);
    T given = T(0);
    for (int k = 0; k < N; ++k) {
      if (y.i[k] > T(0)) {
        given = given + machine.at(y.i[k], drive_angle<N>(y.theta_e, k, tau_ref)).tau;
      }
    }
    const T turn = static_cast<T>(machine.N_r) * y.omega_m * T_s;
    const T i_ref = reference.current(x.mean.asked(abs(tau_ref), given, turn, braking), braking);
    return per_phase<T, N>([&](int k) {
      const T theta = drive_angle<N>(y.theta_e, k, tau_ref);
      if (i_ref > T(0) && conducts(theta, window.theta_on, window.theta_off)) {
        return modulate(duty(x.u_integral[k], y, k, i_ref), T_s);
      }
      x.u_integral[k] = T(0);
      return hold<T>(Leg::demagnetize);
    });
  }

 private:
  constexpr T duty(T& u_integral, const Measurement<T, N>& y, int k, T i_ref) const {
    const T i = max(y.i[k], T(0));
    const Magnetics<T> at = machine.at(i, phase_angle<N>(y.theta_e, k));
    const T error = i_ref - i;
    const T u = bandwidth * at.L_inc * error + R * i_ref + y.omega_m * at.psi_theta + u_integral;
    if (abs(u) < y.u_dc) u_integral = u_integral + bandwidth * R * T_s * error;
    return clamp(u / y.u_dc, T(-1), T(1));
  }
};

}  // namespace srm
