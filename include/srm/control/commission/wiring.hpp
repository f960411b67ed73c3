// Which sensor shows the current of which leg, and with which sign: a short pulse of each leg.
//
// The first sensor that shows i_detect is the leg's, unless another one shows a third of it by
// then. The rotor may stand at any angle, and hardly moves.
#pragma once

#include "srm/control/commission/current_hold.hpp"
#include "srm/control/commission/finding.hpp"

namespace srm {

template <Real T>
struct Wiring {
  T duty;       // of the pulse [1]
  T i_detect;   // a current that is one [A]
  int n_pulse;  // longest pulse [samples]
  int n_rest;   // with all legs off after it; twice as long as the pulse at least [samples]
  SRM_FIELDS(duty, i_detect, n_pulse, n_rest)

  template <int N>
  struct State {
    Finding finding = Finding::running;
    int k = 0;              // leg that is tried
    int n = 0, pulsed = 0;  // samples of the pulse, or of the rest after it
    bool rests = false;
    std::array<std::int32_t, N> sensor{};  // of each leg
    std::array<std::int32_t, N> sign{};    // 1, or -1 where it shows a negative current
    constexpr T progress() const { return static_cast<T>(k) / T(N); }
  };

  template <int N>
  constexpr Command<T, N> step(State<N>& x, const Measurement<T, N>& y, T T_s) const {
    ++x.n;
    if (x.rests) {
      if (x.n > n_rest && x.n > 2 * x.pulsed) {
        x.rests = false;
        x.n = 0;
        if (++x.k == N) x.finding = Finding::done;
      }
      return drive_one<T, N>(0, T(-1), T_s);
    }
    int most = 0;
    for (int j = 1; j < N; ++j) {
      if (abs(y.i[j]) > abs(y.i[most])) most = j;
    }
    if (!(abs(y.i[most]) > i_detect)) {
      if (x.n > n_pulse) x.finding = Finding::open_phase;
      return drive_one<T, N>(x.k, duty, T_s);
    }
    for (int j = 0; j < N; ++j) {
      if (j != most && abs(y.i[j]) > abs(y.i[most]) / T(3)) x.finding = Finding::two_sensors;
    }
    for (int leg = 0; leg < x.k; ++leg) {
      if (x.sensor[leg] == most) x.finding = Finding::same_sensor;
    }
    x.sensor[x.k] = most;
    x.sign[x.k] = y.i[most] > T(0) ? 1 : -1;
    x.rests = true;
    x.pulsed = x.n;
    x.n = 0;
    return drive_one<T, N>(0, T(-1), T_s);
  }
};

}  // namespace srm
