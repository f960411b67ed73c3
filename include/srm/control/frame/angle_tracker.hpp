// Angle, speed and load torque from an angle that comes in steps: a Luenberger observer of the
// rotor.
//
// The counter gives the angle in steps; its difference over a sample is useless as a speed: at 4096
// counts, 20 us and 1500 rpm a sample sees two counts or three. The observer turns as the torque
// that is asked for and the estimated load let the rotor turn, and is corrected by the difference d
// to the counted angle:
//
//   a = acceleration (tau - tau_load)
//   theta <- theta + omega T_s + a T_s^2/2
//   d = counted - theta
//   theta <- theta + g_1 d
//   omega <- omega + a T_s + g_2 d
//   tau_load <- tau_load - g_3 d
//
// Within half a step of the counter d may be nothing but the step: these gains are small. What d is
// beyond half a step is motion: those are large. So the estimates are quiet while the load is
// constant, and follow when it is not. L. Harnefors, H.-P. Nee, "A general algorithm for speed and
// position estimation of AC motors", IEEE Trans. Ind. Electron. 47(1), 2000, has the observer
// without load torque (g_3 = 0).
//
// The first samples are fitted by a straight line, least squares: a rotor that turns already is
// found within some of them. E. Brookner, Tracking and Kalman Filtering Made Easy, Wiley 1998, ch.
// 1 (growing-memory filter).
#pragma once

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"

namespace srm {

/// What a sample's difference d [rad] changes.
template <Real T>
struct TrackerGains {
  T angle;  // g_1 [1]
  T speed;  // g_2 [1/s]
  T load;   // g_3 [N m/rad]
  SRM_FIELDS(angle, speed, load)
};

template <Real T>
struct AngleTracker {
  T T_s;                   // control period [s]
  T half_step;             // of the angle sensor, electrical; 0: ideal [rad]
  T acceleration;          // by a torque, electrical: N_r/J; 0: not known [rad/s^2/(N m)]
  TrackerGains<T> within;  // of d up to half a step
  TrackerGains<T> beyond;  // of the rest
  int N_r;                 // electrical periods per revolution
  SRM_FIELDS(T_s, half_step, acceleration, within, beyond, N_r)

  struct State {
    T theta_e{};         // estimate at the last sample [rad]
    T omega_e{};         // electrical speed [rad/s]
    T tau_load{};        // [N m]
    int n = 0;           // samples that the line was fitted to
    bool near = false;   // the line is known to some steps over as many samples
    bool found = false;  // the line is as good as the gains keep it, and they hold
  };

  /// Starts at a speed that is known [rad/s].
  constexpr void start(State& x, T theta_e, T omega_m) const {
    x = {.theta_e = theta_e, .omega_e = static_cast<T>(N_r) * omega_m, .near = true, .found = true};
  }

  /// The sample's estimate replaces the state. theta_e: counted electrical angle in [0, 2 pi); tau:
  /// torque since the last sample [N m].
  // noinline: the target calls it in two places.
  [[gnu::noinline]] constexpr void step(State& x, T theta_e, T tau) const {
    const T a = acceleration * (tau - x.tau_load);
    const T ahead = wrap(x.theta_e + (x.omega_e + a * T_s / T(2)) * T_s);
    const T d = wrap(theta_e - ahead + pi<T>) - pi<T>;
    const T inside = clamp(d, -half_step, half_step);
    const T outside = d - inside;
    T angle = within.angle * inside + beyond.angle * outside;
    T speed = within.speed * inside + beyond.speed * outside;
    if (!x.found) {
      x.n = x.n + 1;
      const T n = static_cast<T>(x.n);
      const T line = T(6) / (n * (n + T(1)) * T_s);
      x.near = line < T(16) * beyond.speed;  // a quarter of the samples
      x.found = line < beyond.speed;
      angle = (T(4) * n - T(2)) / (n * (n + T(1))) * d;
      speed = x.n > 1 ? line * d : T(0);
    } else {
      x.tau_load = x.tau_load - (within.load * inside + beyond.load * outside);
    }
    x.theta_e = wrap(ahead + angle);
    x.omega_e = x.omega_e + a * T_s + speed;
  }

  /// Mechanical speed; 0 while two counted angles would be all that is known of it [rad/s].
  constexpr T omega_m(const State& x) const {
    return x.near ? x.omega_e / static_cast<T>(N_r) : T(0);
  }
};

}  // namespace srm
