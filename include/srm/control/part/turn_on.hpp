// How far ahead a phase is turned on, so that its flux is there when its predecessor leaves.
//
// The flux psi with which a phase gives the torque alone takes the angle omega_e psi/u to build up,
// at any speed and dc-link voltage. psi is a table over the torque, made offline, with what the
// resistance takes of the voltage in it.
//
// From 90 % of the greatest torque on, and up to omega_from, a law keeps its fixed window, which
// was made for them.
#pragma once

#include <array>

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"
#include "srm/base/interpolate.hpp"
#include "srm/control/part/conduction.hpp"

namespace srm {

template <Real T>
struct TurnOn {
  static constexpr T working = T(0.9);  // of tau_max: from here on the fixed window serves [1]
  // Bounds of a window, motoring and braking: more of it would give torque of the wrong sign [rad].
  static constexpr T longest = T(1.05) * pi<T>, longest_brake = T(1.45) * pi<T>;

  T tau_max;                   // torque of the last entries [N m]; 0: never ahead
  T omega_from;                // from this speed on every torque is led [rad/s]
  T dwell, dwell_brake;        // of a window without lead [rad]
  std::array<T, 9> psi;        // motoring: flux for 0, tau_max/8, ... tau_max [Wb]
  std::array<T, 9> psi_brake;  // braking [Wb]
  SRM_FIELDS(tau_max, omega_from, dwell, dwell_brake, psi, psi_brake)

  /// Whether windows follow torque, speed and voltage here.
  constexpr bool leads(T tau, T omega_m) const {
    return tau < working * tau_max || (tau_max > T(0) && abs(omega_m) > omega_from);
  }

  /// The given window, entered earlier by the lead; the angle at which it is left stays. omega_e:
  /// electrical speed [rad/s]; more: factor on the lead, braking on the dwell [1]; braking, the
  /// window is entered at theta_off.
  constexpr Window<T> ahead(Window<T> window, T tau, T omega_e, T u_dc, T more,
                            bool braking) const {
    const T u = max(u_dc, T(1e-3));
    const T lead = abs(omega_e) * interpolate(braking ? psi_brake : psi, tau / tau_max) / u;
    if (braking) {
      window.theta_off = window.theta_on + min(more * dwell_brake + lead, longest_brake);
    } else {
      window.theta_on = window.theta_off - min(dwell + more * lead, longest);
    }
    return window;
  }
};

}  // namespace srm
