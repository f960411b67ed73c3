// Resistance of each phase, from the mean voltage at two currents: R = (u_2 - u_1)/(i_2 - i_1).
//
// The rotor is clamped: the swing of a free one changes the mean voltage. What a dead time and the
// thresholds of the devices take is the same at both currents; so the leg only freewheels between
// its pulses. The slopes of the devices are part of the result.
#pragma once

#include "srm/control/commission/current_hold.hpp"
#include "srm/control/commission/finding.hpp"

namespace srm {

template <Real T>
struct Resistance {
  CurrentHold<T> hold;
  T i_1, i_2;    // [A]
  int n_settle;  // samples until the current, and the rotor, are at rest
  int n_mean;    // samples of the means
  SRM_FIELDS(hold, i_1, i_2, n_settle, n_mean)

  template <int N>
  struct State {
    Finding finding = Finding::running;
    int k = 0, level = 0, n = 0;
    typename CurrentHold<T>::State current;
    T base{}, u_sum{}, i_sum{};  // of the level [V], [V], [A]
    std::array<T, 2> u{}, i{};   // means [V], [A]
    std::array<T, N> R{};        // [ohm]
    constexpr T progress() const { return static_cast<T>(2 * k + level) / T(2 * N); }
  };

  template <int N>
  constexpr Command<T, N> step(State<N>& x, const Measurement<T, N>& y, T T_s) const {
    const T i_ref = x.level == 0 ? i_1 : i_2;
    const int k = x.k;
    const T duty = hold.step(x.current, i_ref, y.i[k], y.u_dc, T(0));
    if (++x.n == n_settle) x.base = x.current.integral;
    if (x.n > n_settle) {  // sums about what is nearly the mean, for the digits of a float
      x.u_sum = x.u_sum + (x.current.u - x.base);
      x.i_sum = x.i_sum + (y.i[k] - i_ref);
    }
    if (x.n >= n_settle + n_mean) take(x, i_ref);
    return drive_one<T, N>(k, duty, T_s);
  }

 private:
  template <int N>
  constexpr void take(State<N>& x, T i_ref) const {
    x.u[x.level] = x.base + x.u_sum / static_cast<T>(n_mean);
    x.i[x.level] = i_ref + x.i_sum / static_cast<T>(n_mean);
    x.u_sum = x.i_sum = T(0);
    x.n = 0;
    if (abs(x.i[x.level] - i_ref) > i_ref / T(4)) {
      x.finding = Finding::no_current;
      return;
    }
    if (++x.level < 2) return;
    x.R[x.k] = (x.u[1] - x.u[0]) / (x.i[1] - x.i[0]);
    x.level = 0;
    x.current = {};
    if (++x.k == N) x.finding = Finding::done;
  }
};

}  // namespace srm
