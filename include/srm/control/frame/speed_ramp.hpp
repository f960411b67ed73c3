// The speed reference that the torque can follow: it moves to what is asked for no faster than the
// torque that the load leaves can accelerate the inertia, and says what torque this takes.
//
//   -tau - tau_load <= J d omega_ref/dt <= tau - tau_load
//
// So the torque does not stay at its limit, and the speed arrives together with the reference. Away
// from the load the reference never turns back: a load above `tau` holds it.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/base/real.hpp"

namespace srm {

template <Real T>
struct SpeedRamp {
  T J;     // [kg m^2]
  T tau;   // torque for load and acceleration; 0: the reference is used as it is [N m]
  T rate;  // greatest [rad/s^2]
  T T_s;   // [s]
  SRM_FIELDS(J, tau, rate, T_s)

  struct State {
    T omega_ref{};         // [rad/s]
    bool running = false;  // the first sample starts at the speed
  };

  /// The reference of this sample is in the state. Returns the torque of its acceleration [N m].
  // noinline: one copy for all laws in a library that has them.
  [[gnu::noinline]] constexpr T step(State& x, T omega_asked, T omega_m, T tau_load) const {
    if (!(tau > T(0))) {
      x.omega_ref = omega_asked;
      return T(0);
    }
    if (!x.running) x = {.omega_ref = omega_m, .running = true};
    const T up = clamp((tau - tau_load) / J, T(0), rate);
    const T down = clamp((tau + tau_load) / J, T(0), rate);
    const T change = clamp(omega_asked - x.omega_ref, -down * T_s, up * T_s);
    x.omega_ref = x.omega_ref + change;
    return J * change / T_s;
  }
};

}  // namespace srm
