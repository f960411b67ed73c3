// Where the rotor is by the flux linkages, next to the angle sensor: an extended Kalman filter of
// the rotor, of what the map and the resistance are wrong by, and of the zero of the sensor.
//
//   state    theta, omega, tau_load, k, rho, zero
//   motion   theta' = omega,  omega' = acceleration (tau - tau_load); the others drift
//   phase    psi_u - (rho - 1) psi_R = k psi(i, theta)
//   sensor   shown = theta + zero
//
// psi_u is the flux linkage that the ordered voltage has given a phase since it had none, with the
// resistance as the drive file states it; psi_R is what this resistance took. k scales the map, rho
// the resistance. tau is the torque of the map at the measured currents.
//
// Where phases couple and the control knows the pairs, psi and tau have what the currents of the
// others add. A phase without current has a flux linkage there, so psi_u is counted from what map
// and pairs say when the voltage begins to build one up. A pair takes as long as all else. So while
// pairs add something, every second sample computes one, by turns, and the samples between hear the
// sensor and one phase, by turns. Until the turn of a pair comes again, what it adds follows the
// angle and the current of the other phase.
//
// The map is wrong at an angle, not at a sample, and a counter shows the same step for a while. So
// a row weighs as one of all the samples in which its error stays the same: while the rotor turns
// by a twelfth of a period, or by a step of the sensor; `alike` samples at most. A count that the
// estimate has left by more than half a step is new, and weighs as one sample.
//
// S. Bolognani, L. Tubiana, M. Zigliotto, "Extended Kalman filter tuning in sensorless PMSM
// drives", IEEE Trans. Ind. Appl. 39(6), 2003, has the filter of a machine with constant
// inductances; the scale of the map and the rows of a sensor are ours.
#pragma once

#include <array>

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"
#include "srm/control/interface/interface.hpp"
#include "srm/machine/with_pairs.hpp"

namespace srm {

/// What is estimated, at a sample.
template <Real T>
struct FluxEstimate {
  T theta_hat{};        // angle of the rotor, electrical [rad]
  T omega_hat{};        // its speed, mechanical [rad/s]
  T tau_load_hat{};     // [N m]
  T psi_scale_hat{};    // flux linkage over that of the map [1]
  T R_scale_hat{};      // resistance over that of the drive file [1]
  T zero_hat{};         // by which the sensor shows more than the rotor's angle [rad]
  T theta_deviation{};  // standard deviation of theta_hat [rad]
  SRM_FIELDS(theta_hat, omega_hat, tau_load_hat, psi_scale_hat, R_scale_hat, zero_hat,
             theta_deviation)
};

/// What the voltage says of a phase.
template <Real T>
struct VoltageFlux {
  T psi{};          // flux linkage [Wb]
  T taken{};        // by the resistance since it had none [Wb]
  T left{};         // by which psi may have been wrong when it began [Wb]
  T error{};        // by which it may be wrong now, the resistance aside [Wb]
  bool is = false;  // it is known from when on there was none
};

template <Real T>
struct FluxAngle {
  T T_s;           // control period; 0: nothing is estimated [s]
  T acceleration;  // by a torque, electrical: N_r/J [rad/s^2/(N m)]
  T theta_step;    // of the angle sensor, electrical [rad]
  T theta_error;   // of its zero, electrical [rad]
  T zero_drift;    // by which it drifts in a root second, likewise [rad]
  T tau_drift;     // by which the load torque drifts in a second [N m]
  T omega_error;   // of the first speed, electrical [rad/s]
  T map_error;     // of the flux linkage that the map says [1]
  T R_error;       // of the resistance [1]
  T psi_error;     // flux linkage of the other phases [Wb]
  T i_noise;       // of a reading, rms [A]
  T i_zero;        // readings up to this one count as no current [A]
  T alike;         // samples that count as one, at most
  SRM_FIELDS(T_s, acceleration, theta_step, theta_error, zero_drift, tau_drift, omega_error,
             map_error, R_error, psi_error, i_noise, i_zero, alike)

  static constexpr int n = 6;

  struct Filter {
    std::array<T, n> x{};                 // theta, omega, tau_load, k, rho, zero
    std::array<std::array<T, n>, n> P{};  // their covariance: the upper triangle
    T tau{};                              // of the last sample, by the map [N m]
    bool begun = false;
  };

  /// How a phase is counted where pairs are known.
  struct Counted {
    T psi{};          // flux linkage when it began, beyond that of the voltage [Wb]
    T certain{};      // by which it was less wrong then than that of the voltage [Wb]
    bool is = false;  // it has begun
  };

  /// What a pair adds, where it was computed last.
  struct Pair {
    PairFlux<T> adds{};
    T i_first{}, i_second{};  // [A]
    T theta_e{};              // [rad]
    bool is = false;          // so it is still; else it adds nothing, or it is not known
  };

  template <int N>
  struct State : Filter {
    std::array<Counted, N> counted{};
    std::array<Pair, N*(N - 1)> pair{};
    std::array<T, N> tau_of{};     // phases alone, when they were heard [N m]
    std::array<int, N> unheard{};  // samples in which they had something to say since then
    int last = 0;                  // pair that was computed
    bool renews = false;           // the last sample computed one
  };

  constexpr bool on() const { return T_s > T(0); }

  /// One sample. pairs: as the control knows them; y: as the sensors show it; of(k): the
  /// VoltageFlux of phase k.
  template <Machine M, int N, class Of>
  constexpr void step(State<N>& s, const M& machine, const Coupling<T>& pairs,
                      const Measurement<T, N>& y, const Of& of) const {
    if (!s.begun) {
      begin(s, y.theta_e, y.omega_m * static_cast<T>(machine.N_r));
    } else {
      predict(s);
    }
    const T turned = abs(s.x[1]) * T_s;
    const T sixth = samples_of(pi<T> / T(6), turned);
    if (may_couple<M> && pairs.any()) {
      const bool renewed = s.renews;
      const int pair = asked_pair(pairs, s, y, of);
      s.renews = pair >= 0 && !renewed;
      if (s.renews) {
        renew(pairs, s, y, pair);
      } else {
        hear_one(s, machine, pairs, y, of, sixth);
        see(s, y.theta_e, turned, renewed ? T(2) : T(1));
      }
    } else {
      hear_all(s, machine, y, of, sixth);
      see(s, y.theta_e, turned, T(1));
    }
    s.x[0] = wrap(s.x[0]);
  }

  /// Whether the sensor shows an angle that is not the rotor's: its zero is off by more than is
  /// stated, and more than an error of the map can feign. Five deviations are more than any shape
  /// over the angle made of an error as great as is stated (tests/core/flux_angle_check.cpp).
  bool off(const Filter& s) const {
    return abs(s.x[5]) > theta_error + T(5) * sqrt(max(s.P[5][5], T(0)));
  }

  /// What is known by now.
  FluxEstimate<T> estimate(const Filter& s, int N_r) const {
    return {.theta_hat = s.x[0],
            .omega_hat = s.x[1] / static_cast<T>(N_r),
            .tau_load_hat = s.x[2],
            .psi_scale_hat = s.x[3],
            .R_scale_hat = s.x[4],
            .zero_hat = s.x[5],
            .theta_deviation = sqrt(max(s.P[0][0], T(0)))};
  }

 private:
  /// Samples in which the rotor turns by an angle, at `turned` a sample.
  constexpr T samples_of(T angle, T turned) const {
    return turned * alike > angle ? max(angle / turned, T(1)) : alike;
  }

  constexpr void begin(Filter& s, T theta_e, T omega_e) const {
    s = {.x = {theta_e, omega_e, T(0), T(1), T(1), T(0)}, .begun = true};
    const T zero = theta_error * theta_error;
    const std::array<T, n> variance{zero + theta_step * theta_step / T(12),
                                    omega_error * omega_error,
                                    tau_drift * tau_drift,
                                    map_error * map_error,
                                    R_error * R_error,
                                    zero};
    for (int j = 0; j < n; ++j) s.P[j][j] = variance[j];
    s.P[0][5] = -zero;
  }

  /// The rotor turns; what is not known of it grows. In a second each of the others may drift by
  /// what is stated of it. The drift of the zero must not follow the speed that is estimated: it
  /// would go along with the steps of the sensor, and the zero away with them.
  constexpr void predict(Filter& s) const {
    auto& [x, P, tau, begun] = s;
    const T a = acceleration * (tau - x[2]), b = -acceleration * T_s;
    x[0] = x[0] + (x[1] + a * T_s / T(2)) * T_s;
    x[1] = x[1] + a * T_s;
    P[0][0] = P[0][0] + (T(2) * P[0][1] + P[1][1] * T_s) * T_s;
    P[0][1] = P[0][1] + P[1][1] * T_s + b * (P[0][2] + P[1][2] * T_s);
    for (int j = 2; j < n; ++j) P[0][j] = P[0][j] + P[1][j] * T_s;
    P[1][1] = P[1][1] + b * (T(2) * P[1][2] + b * P[2][2]);
    for (int j = 2; j < n; ++j) P[1][j] = P[1][j] + b * P[2][j];
    const std::array<T, 3> drift{tau_drift, map_error, R_error};
    for (int j = 0; j < 3; ++j) P[j + 2][j + 2] = P[j + 2][j + 2] + drift[j] * drift[j] * T_s;
    P[5][5] = P[5][5] + zero_drift * zero_drift * T_s;
  }

  /// What the others add to a phase.
  struct Added {
    T psi{}, psi_theta{};  // [Wb], [Wb/rad]
    bool is = true;        // it is known
  };

  constexpr T current(T reading) const { return reading > i_zero ? reading : T(0); }

  /// The pair to compute next, of those whose phases flow or begin to be counted; none: -1. Forgets
  /// what was said of phases and pairs before a current began or ended.
  template <int N, class Of>
  constexpr int asked_pair(const Coupling<T>& pairs, State<N>& s, const Measurement<T, N>& y,
                           const Of& of) const {
    std::array<bool, N> flows{}, asked{};
    for (int k = 0; k < N; ++k) {
      const bool is = of(k).is;
      flows[k] = y.i[k] > i_zero;
      if (!is) s.counted[k].is = false;
      asked[k] = flows[k] || (is && !s.counted[k].is);
      s.unheard[k] = is || flows[k] ? s.unheard[k] + 1 : 0;
      if (s.unheard[k] == 0) s.tau_of[k] = T(0);
    }
    int after = -1, before = -1;
    for (int j = 0; j < pairs.n_pairs(); ++j) {
      const int k = pairs.first[j], l = pairs.second[j];
      Pair& known = s.pair[j];
      known.is =
          known.is && flows[k] == (known.i_first > T(0)) && flows[l] == (known.i_second > T(0));
      if (!asked[k] || !asked[l] || !(flows[k] || flows[l])) continue;
      if (j > s.last && after < 0) after = j;
      if (j <= s.last && before < 0) before = j;
    }
    return after >= 0 ? after : before;
  }

  template <int N>
  constexpr void renew(const Coupling<T>& pairs, State<N>& s, const Measurement<T, N>& y,
                       int j) const {
    const T a = current(y.i[pairs.first[j]]), b = current(y.i[pairs.second[j]]);
    const T theta_e = wrap(s.x[0]);
    s.pair[j] = {pairs.flux(j, a, b, theta_e), a, b, theta_e, true};
    s.last = j;
  }

  /// What the pairs add to phase k by now.
  template <int N>
  constexpr Added added(const Coupling<T>& pairs, const State<N>& s, const Measurement<T, N>& y,
                        T N_r, int k) const {
    Added sum;
    for (int j = 0; j < pairs.n_pairs(); ++j) {
      const bool first = pairs.first[j] == k;
      if (!first && pairs.second[j] != k) continue;
      const Pair& known = s.pair[j];
      const T other = current(y.i[first ? pairs.second[j] : pairs.first[j]]);
      if (!(other > T(0))) continue;
      sum.is = sum.is && known.is;
      if (!known.is) continue;
      const T part = other / (first ? known.i_second : known.i_first);
      const T psi_theta = first ? known.adds.psi_theta_first : known.adds.psi_theta_second;
      const T turned = (wrap(s.x[0] - known.theta_e + pi<T>) - pi<T>) / N_r;
      const T psi = first ? known.adds.psi_first : known.adds.psi_second;
      sum.psi = sum.psi + (psi + psi_theta * turned) * part;
      sum.psi_theta = sum.psi_theta + psi_theta * part;
    }
    return sum;
  }

  /// The rows of phases that do not couple. same: rows that count as one.
  template <Machine M, int N, class Of>
  constexpr void hear_all(Filter& s, const M& machine, const Measurement<T, N>& y, const Of& of,
                          T same) const {
    s.tau = T(0);
    for (int k = 0; k < N; ++k) {
      const VoltageFlux<T> v = of(k);
      if (!v.is && !(y.i[k] > i_zero)) continue;
      const Magnetics<T> m = machine.at(y.i[k], phase_angle<N>(s.x[0], k));
      s.tau = s.tau + m.tau;
      hear(s, m, static_cast<T>(machine.N_r), v, same);
    }
  }

  /// The row of the phase that has waited longest, of those that couple.
  template <Machine M, int N, class Of>
  constexpr void hear_one(State<N>& s, const M& machine, const Coupling<T>& pairs,
                          const Measurement<T, N>& y, const Of& of, T same) const {
    int k = 0;
    for (int l = 1; l < N; ++l) {
      if (s.unheard[l] > s.unheard[k]) k = l;
    }
    if (s.unheard[k] > 0) {
      const T N_r = static_cast<T>(machine.N_r), every = static_cast<T>(s.unheard[k]);
      Magnetics<T> m = machine.at(y.i[k], phase_angle<N>(s.x[0], k));
      s.tau_of[k] = m.tau;
      s.unheard[k] = 0;
      const Added more = added(pairs, s, y, N_r, k);
      if (more.is) {
        VoltageFlux<T> v = of(k);
        if (v.is) count(s.counted[k], m, more.psi, v);
        m.psi = m.psi + more.psi;
        m.psi_theta = m.psi_theta + more.psi_theta;
        hear(s, m, N_r, v, max(same / every, T(1)));
      }
    }
    s.tau = T(0);
    for (const T tau : s.tau_of) s.tau = s.tau + tau;
    for (int j = 0; j < pairs.n_pairs(); ++j) {
      if (s.pair[j].is) s.tau = s.tau + s.pair[j].adds.tau;
    }
  }

  /// Counts a phase from what the map and the pairs say when it begins. m: of the phase alone; psi:
  /// what the pairs add.
  constexpr void count(Counted& x, const Magnetics<T>& m, T psi, VoltageFlux<T>& v) const {
    if (!x.is) {
      const T wrong = map_error * m.psi + m.L_inc * i_zero;
      x = {.psi = m.psi + psi - v.psi, .certain = v.left - wrong, .is = true};
    }
    v.psi = v.psi + x.psi;
    v.error = max(v.error - x.certain, T(0));
    v.left = v.left - x.certain;
  }

  /// The row of a phase with its magnetics at a reading. Where the voltage leaves more open than
  /// the map it says nothing: a current that does not return to zero leaves the same in each
  /// stroke. What a row counts and how much follows from its voltage: the noise of the reading
  /// would choose the rows in which it is high, and be taken for an angle (errors in variables).
  constexpr void hear(Filter& s, const Magnetics<T>& m, T N_r, const VoltageFlux<T>& v,
                      T same) const {
    if (!v.is || v.left > map_error * v.psi || !(m.psi > T(0))) return;
    const T psi = v.psi - (s.x[4] - T(1)) * v.taken, at_psi = psi / s.x[3];
    const T at_theta = psi / m.psi * m.psi_theta / N_r;
    const T noise = m.L_inc * i_noise, wrong = map_error * psi;
    const T variance =
        noise * noise + same * (wrong * wrong + psi_error * psi_error + v.error * v.error);
    std::array<T, n> g;
    for (int j = 0; j < n; ++j) {
      g[j] = at_theta * upper(s, 0, j) + at_psi * upper(s, 3, j) + v.taken * upper(s, 4, j);
    }
    const T S = at_theta * g[0] + at_psi * g[3] + v.taken * g[4] + variance;
    correct(s, g, S, psi - s.x[3] * m.psi);
  }

  /// The row of the sensor, one of `every` samples. A rotor turns by `turned` a sample.
  constexpr void see(Filter& s, T shown, T turned, T every) const {
    const T d = wrap(shown - s.x[0] - s.x[5] + pi<T>) - pi<T>;
    const T same =
        abs(d) > theta_step / T(2) ? T(1) : max(samples_of(theta_step, turned) / every, T(1));
    std::array<T, n> g;
    for (int j = 0; j < n; ++j) g[j] = upper(s, 0, j) + upper(s, 5, j);
    correct(s, g, g[0] + g[5] + same * theta_step * theta_step / T(12), d);
  }

  /// By a difference d that has variance S, and covariance g with the state.
  // noinline: called in two places.
  [[gnu::noinline]] constexpr void correct(Filter& s, const std::array<T, n>& g, T S, T d) const {
    const T once = T(1) / S;
    for (int j = 0; j < n; ++j) {
      const T gain = g[j] * once;
      s.x[j] = s.x[j] + gain * d;
      for (int l = j; l < n; ++l) s.P[j][l] = s.P[j][l] - gain * g[l];
    }
  }

  static constexpr T upper(const Filter& s, int j, int l) { return j < l ? s.P[j][l] : s.P[l][j]; }
};

}  // namespace srm
