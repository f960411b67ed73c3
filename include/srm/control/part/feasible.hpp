// Where the voltage suffices for what a law asks of a phase: the boundary of its textbook form.
//
// The flux linkage psi(theta_e) that a law asks for must rise by dpsi/dtheta_e in a radian. At the
// electrical speed omega_e that takes the voltage
//
//   omega_e dpsi/dtheta_e + R i <= u_dc,
//
// and where it is more than there is, the flux linkage lags behind. A table made offline has the
// greatest omega_e/u_dc at which the mean torque does not notice, at nominal voltage, for torques
// 0..tau_max, motoring and braking. Beyond it a law takes its reference from the profile of the
// limit at this speed and voltage (reference_profile.hpp), and feedback holds the mean torque
// (mean_torque_feedback.hpp).
#pragma once

#include <array>

#include "srm/base/fields.hpp"
#include "srm/base/interpolate.hpp"

namespace srm {

template <Real T>
struct Feasible {
  static constexpr int points = 9;  // of the torques

  T tau_max;                       // last torque of the tables [N m]
  std::array<T, points> motoring;  // greatest omega_e/u_dc [rad/Wb]
  std::array<T, points> braking;
  SRM_FIELDS(tau_max, motoring, braking)

  /// True where the law can be its textbook self. tau, omega_e >= 0.
  constexpr bool at(T tau, T omega_e, T u_dc, bool brakes) const {
    return !(omega_e > u_dc * interpolate(brakes ? braking : motoring, tau / tau_max));
  }
};

/// What every phase can follow: no speed is too high.
template <Real T>
constexpr Feasible<T> always_feasible() {
  Feasible<T> all{.tau_max = T(1), .motoring = {}, .braking = {}};
  all.motoring.fill(T(1e30));
  all.braking.fill(T(1e30));
  return all;
}

}  // namespace srm
