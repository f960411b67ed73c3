// Angle and speed from an incremental encoder: a tracking observer on the counted angle.
//
// The counter gives the angle in steps; its difference over a sample is useless as a speed: at 4096
// counts, 20 us and 1500 rpm a sample sees two counts or three. The observer turns with the
// estimated speed and is pulled by the difference to the counted angle (type 2: no error at
// constant speed, a/bandwidth^2 at constant acceleration a):
//
//   theta <- theta + omega T_s,   d = counted - theta
//   theta <- theta + g1 d,   omega <- omega + g2 d/T_s,   g1 = 1 - r^2,  g2 = (1 - r)^2,  r =
//   e^(-bandwidth T_s)
//
// Both poles lie at r: no overshoot in the error of a ramp. L. Harnefors, H.-P. Nee, "A general
// algorithm for speed and position estimation of AC motors", IEEE Trans. Ind. Electron. 47(1),
// 2000.
#pragma once

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"

namespace srm {

template <Real T>
struct AngleTracker {
  T T_s;        // control period [s]
  T bandwidth;  // [rad/s]; 500 leaves 1/8 of a count of noise at 20 us, see test_angle_tracker.py
  int N_r;      // electrical periods per revolution
  SRM_FIELDS(T_s, bandwidth, N_r)

  struct State {
    T theta_e{};           // estimate at the last sample [rad]
    T omega_e{};           // electrical speed [rad/s]
    bool started = false;  // the first sample sets the angle
  };

  /// The sample's estimate replaces the state. theta_e: counted electrical angle in [0, 2 pi).
  constexpr void step(State& x, T theta_e) const {
    if (!x.started) {
      x = {.theta_e = theta_e, .omega_e = T(0), .started = true};
      return;
    }
    const T r = exp(-bandwidth * T_s);
    const T ahead = wrap(x.theta_e + x.omega_e * T_s);
    const T d = wrap(theta_e - ahead + pi<T>) - pi<T>;
    x.theta_e = wrap(ahead + (T(1) - r * r) * d);
    x.omega_e = x.omega_e + (T(1) - r) * (T(1) - r) * d / T_s;
  }

  /// Mechanical speed [rad/s].
  constexpr T omega_m(const State& x) const { return x.omega_e / static_cast<T>(N_r); }
};

}  // namespace srm
