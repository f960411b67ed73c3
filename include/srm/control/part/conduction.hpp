// When a phase may conduct: turn-on and turn-off angle, and a window of its own for starting.
//
// A window that is advanced for speed has angles at standstill where no phase gives torque. Below
// omega_start it is replaced by one centred on pi/2, where the phase gives most torque for its
// current, 10 % wider than the stroke 2 pi/N, so that every angle is covered with overlap.
//
// Braking (torque against speed) runs through the window backwards; mirroring it about pi/2 keeps
// the advance ahead of the motion. R. Krishnan, Switched Reluctance Motor Drives, CRC 2001, ch. 1
// and 5.
#pragma once

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"

namespace srm {

/// Electrical angles of a phase [rad]; theta_on may be negative.
template <Real T>
struct Window {
  T theta_on, theta_off;
};

template <Real T>
struct Conduction {
  T theta_on, theta_off;  // motoring, above omega_start [rad]
  T omega_start = T(10);  // below this speed: the start window [rad/s]
  SRM_FIELDS(theta_on, theta_off, omega_start)

  /// The window in the mirrored frame of `drive_angle`, where torque is positive.
  template <int N>
  constexpr Window<T> window(T omega_m, T tau_ref) const {
    if (abs(omega_m) < omega_start) {
      const T half = min(T(1.1) * pi<T> / T(N), pi<T> / T(2));
      return {pi<T> / T(2) - half, pi<T> / T(2) + half};
    }
    if (omega_m * tau_ref < T(0)) return {pi<T> - theta_off, pi<T> - theta_on};
    return {theta_on, theta_off};
  }
};

}  // namespace srm
