// How far ahead a phase is turned on, so that its flux is there when its predecessor leaves.
//
// The flux psi with which a phase gives the torque alone takes the angle omega_e psi/u to build up,
// at any speed and dc-link voltage. psi is a table over the torque, made offline, with what the
// resistance takes of the voltage in it.
#pragma once

#include <array>

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"
#include "srm/base/interpolate.hpp"
#include "srm/control/part/conduction.hpp"

namespace srm {

template <Real T>
struct TurnOn {
  T tau_max;                   // torque of the last entries [N m]
  std::array<T, 9> psi;        // motoring: flux for 0, tau_max/8, ... tau_max; zeros: no lead [Wb]
  std::array<T, 9> psi_brake;  // braking [Wb]
  SRM_FIELDS(tau_max, psi, psi_brake)

  /// A window, entered earlier. omega_e: electrical speed [rad/s]; braking, the window is entered
  /// at theta_off.
  constexpr Window<T> ahead(Window<T> window, T tau, T omega_e, T u_dc, bool braking) const {
    if (!(tau_max > T(0) && u_dc > T(0))) return window;
    const T lead = abs(omega_e) * interpolate(braking ? psi_brake : psi, tau / tau_max) / u_dc;
    const T widest = (braking ? T(1.45) : T(1.05)) * pi<T>;
    const T room = max(widest - (window.theta_off - window.theta_on), T(0));
    if (braking) {
      window.theta_off = window.theta_off + min(lead, room);
    } else {
      window.theta_on = window.theta_on - min(lead, room);
    }
    return window;
  }
};

}  // namespace srm
