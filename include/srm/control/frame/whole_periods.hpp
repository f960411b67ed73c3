// Means over whole electrical periods: the ripple of the dc link repeats with the strokes, so that
// a mean over whole periods is free of it.
#pragma once

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"

namespace srm {

template <Real T>
struct WholePeriods {
  T T_s;       // control period [s]
  T t_settle;  // samples are left out for so long after a start [s]
  T t_least;   // a mean takes at least this long, and then ends with its period [s]
  T t_most;    // or here, where the rotor stands or creeps [s]
  SRM_FIELDS(T_s, t_settle, t_least, t_most)

  /// Means of what was summed, and the time that they are over.
  struct Means {
    T u, i, p, tau;  // [V], [A], [W], [N m]
    T rise;          // of the voltage from the first sample to the last [V]
    T t;             // [s]
  };

  /// Sums are of differences to the first sample: a float keeps them exact enough for steps of a
  /// thousandth over 100 000 samples.
  struct State {
    T t{};                                // since the start [s]
    T turned{};                           // electrical angle since the first sample [rad]
    T theta_e{};                          // of the last sample [rad]
    T u_first{}, i_first{}, tau_first{};  // first sample
    T u{}, i{}, p{}, tau{};               // sums of differences
    T n{};                                // samples
  };

  /// Adds a sample; true where a mean is complete: read it, then restart.
  constexpr bool add(State& x, T u, T i, T tau, T theta_e) const {
    x.t = x.t + T_s;
    if (x.t < t_settle) return false;
    if (x.n == T(0)) {
      x.u_first = u;
      x.i_first = i;
      x.tau_first = tau;
    } else {
      x.turned = x.turned + (wrap(theta_e - x.theta_e + pi<T>) - pi<T>);
    }
    x.theta_e = theta_e;
    const T over = abs(x.turned) - two_pi<T>;
    const bool whole = over >= T(0);
    if (whole) x.turned = x.turned < T(0) ? -over : over;
    const T since = x.t - t_settle;
    if ((whole && since >= t_least) || since >= t_most) return true;
    x.u = x.u + (u - x.u_first);
    x.i = x.i + (i - x.i_first);
    x.p = x.p + (u * i - x.u_first * x.i_first);
    x.tau = x.tau + (tau - x.tau_first);
    x.n = x.n + T(1);
    return false;
  }

  /// u: voltage of the sample that completed the mean.
  constexpr Means means(const State& x, T u) const {
    const T n = max(x.n, T(1));
    return {.u = x.u_first + x.u / n,
            .i = x.i_first + x.i / n,
            .p = x.u_first * x.i_first + x.p / n,
            .tau = x.tau_first + x.tau / n,
            .rise = u - x.u_first,
            .t = n * T_s};
  }
};

}  // namespace srm
