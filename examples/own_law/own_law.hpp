// A control law of one's own in C++: deadbeat current control of pulses between two angles.
#pragma once

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"
#include "srm/control/part/mirror.hpp"
#include "srm/control/part/modulator.hpp"
#include "srm/control/part/per_phase.hpp"
#include "srm/machine/torque_inverse.hpp"

/// The duty cycle that brings the flux linkage to that of the wanted current in one sample.
template <srm::Machine M, int N>
struct DeadbeatPulse {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  static constexpr int n_phases = N;
  struct State {};

  M machine;
  T i_max, T_s;
  T theta_on, theta_off;  // of the pulse, electrical [rad]
  SRM_FIELDS(machine, i_max, T_s, theta_on, theta_off)

  srm::Command<T, N> step(State&, const srm::Measurement<T, N>& y, T tau_ref) const {
    const T turn = static_cast<T>(machine.N_r) * y.omega_m * T_s;
    return srm::per_phase<T, N>([&](int k) {
      const T theta = srm::drive_angle<N>(srm::wrap(y.theta_e + turn), k, tau_ref);
      if (!srm::conducts(theta, theta_on, theta_off)) return srm::hold<T>(srm::Leg::demagnetize);
      const T i_ref = srm::current_for_torque(machine, srm::abs(tau_ref), theta, i_max);
      const T psi = machine.at(y.i[k], srm::phase_angle<N>(y.theta_e, k)).psi;
      const T duty = (machine.at(i_ref, theta).psi - psi) / (T_s * y.u_dc);
      return srm::modulate(srm::clamp(duty, T(-1), T(1)), T_s);
    });
  }
};
