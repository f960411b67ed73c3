// When a phase may conduct: turn-on and turn-off angle, and a window of its own for starting.
//
// A window that is advanced for speed has angles at standstill where no phase gives torque. Below
// omega_start it is replaced by one centred on pi/2, where the phase gives most torque for its
// current, 10 % wider than the stroke 2 pi/N, so that every angle is covered with overlap.
//
// Braking (torque against speed) has a window of its own. Seen in the frame of positive torque it
// is passed backwards, from brake_off to brake_on. Flux must be there when the aligned rotor leaves
// the stator, so it is built up before alignment, where the phase still gives torque of the wrong
// sign: the window reaches further back than the mirror of the motoring one. R. Krishnan, Switched
// Reluctance Motor Drives, CRC 2001, ch. 1 and 5.
#pragma once

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"

namespace srm {

/// True where the torque reference is against the motion.
template <Real T>
constexpr bool brakes(T omega_m, T tau_ref) {
  return omega_m * tau_ref < T(0);
}

/// Electrical angles of a phase [rad]; theta_on may be negative.
template <Real T>
struct Window {
  T theta_on, theta_off;
};

template <Real T>
struct Conduction {
  T theta_on, theta_off;  // motoring, above omega_start [rad]
  T brake_on, brake_off;  // braking, in the frame of positive torque [rad]
  T omega_start = T(10);  // below this speed: the start window [rad/s]
  SRM_FIELDS(theta_on, theta_off, brake_on, brake_off, omega_start)

  /// The window in the mirrored frame of `drive_angle`, where torque is positive.
  template <int N>
  constexpr Window<T> window(T omega_m, T tau_ref) const {
    if (abs(omega_m) < omega_start) {
      const T half = min(T(1.1) * pi<T> / T(N), pi<T> / T(2));
      return {pi<T> / T(2) - half, pi<T> / T(2) + half};
    }
    if (brakes(omega_m, tau_ref)) return {brake_on, brake_off};
    return {theta_on, theta_off};
  }
};

}  // namespace srm
