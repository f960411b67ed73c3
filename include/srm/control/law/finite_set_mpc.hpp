// Finite-control-set model predictive torque control, horizon 1 to 4, with or without a guide.
//
// Each sample the leg combination that begins the best sequence is held (leg_search.hpp). Over a
// few samples such a law is myopic: it does not see that flux must be built before the poles
// overlap, and that flux left past alignment brakes. The guide, the least-copper profile of zero
// torque ripple computed offline, says it through w_psi. With an empty guide and w_psi = 0 it is
// the law as the literature has it, with copper (w_i) to share the torque.
//
// A rule for the weights, from the switching frequency f: w_sw from switching_weight.hpp, which
// stands for a torque band A; with the pulse period p = 1/(4.8 f) of a phase that conducts 5/12 of
// the time, and with h = horizon T_s,
//
//   t_end = p^2/(24 h): a turn-on pays when (A + s h)^2 - (A - s h)^2, s = 2 A/p, lasts so long
//   w_psi = (tau_ref/(psi_max reserve))^2: with full voltage reserve the whole flux linkage counts
//   as the whole torque; where the guide takes all of the voltage no deviation is made good
//
// Where the guide has ripple of its own, or conducts nearly throughout, so that a small part of its
// flux linkage makes all of the torque, the mean is held by feedback (mean_torque_feedback.hpp).
// Where the torque has collapsed all the same, each phase follows its guide by itself.
//
// Measured with T_s = 2 us, h = 2..6 us, f = 18 kHz: 19 to 23 kHz. A long sample limits it by
// itself.
//
// Tuned numbers, and what they decide: docs/control/tuned_constants.md.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/coupled_prediction.hpp"
#include "srm/control/part/leg_search.hpp"
#include "srm/control/part/mean_torque_feedback.hpp"

namespace srm {

template <Machine M, int N>
struct FiniteSetMpc {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  static constexpr int n_phases = N;
  static constexpr int horizon_max = 4;
  static constexpr T dead = T(0.002);     // a miss of the mean that is left alone [1]
  static constexpr T held_part = T(0.1);  // what the feedback may add to the torque [1]
  // Where the torque has been off by this much for so long, only the guide counts.
  static constexpr T much = T(0.5);           // [1]
  static constexpr T lasting = T(8) * pi<T>;  // [rad]

  M machine;
  ReferenceProfile<T> guide;  // flux linkage over torque reference, electrical angle and speed [Wb]
  int horizon;                // samples, 1..horizon_max
  View<T> w_psi;     // distance to the guide, at each of its speeds [N^2 m^2/Wb^2]; 0: none
  View<T> feedback;  // 1 at those of its speeds at which feedback holds the mean, else 0 [1]
  T w_i;             // copper [N^2 m^2/A^2]
  T w_sw;            // cost of a turn-on [N^2 m^2 s]
  T t_end;           // weight of the last sample, at least T_s [s]
  T R;               // phase resistance [ohm]
  T i_max;           // current limit [A]
  T T_s;             // control period [s]
  int delay;         // samples from measurement to effect: 0 or 1
  SRM_FIELDS(machine, guide, horizon, w_psi, feedback, w_i, w_sw, t_end, R, i_max, T_s, delay)

  struct State : Memory<T, N> {
    MeanTorqueFeedback<T> hold{};
    T tau{};             // of the last sample, in the frame of positive torque [N m]
    bool holds = false;  // the mean, in the last sample
    T lost{};            // way on which the torque was far off since, less that on which not [rad]
  };

  constexpr bool is_consistent() const {
    return w_psi.size == guide.omega.size && feedback.size == guide.omega.size;
  }

  Command<T, N> step(State& state, const Measurement<T, N>& y, T tau_ref) const {
    const T ahead = T_s * static_cast<T>(horizon);
    const T demand = state.holds ? held(state, y.omega_m, tau_ref) : abs(tau_ref);
    const Profile<T> profile = guide.at(demand, y.omega_m, y.u_dc);
    const T w_goal = profile.of(w_psi);
    const T off = w_goal > T(0) ? y.u_dc * T(1e-7) : T(0);  // the flux of 0.1 us
    const Prediction<M, N> prediction{machine, profile, R, T_s, delay, ahead, off};
    LegSearch<T, N> search{.phases = prediction.at(y, tau_ref, state),
                           .tau_ref = demand,
                           .u_dc = y.u_dc,
                           .R = R,
                           .i_max = i_max,
                           .T_s = T_s,
                           .t_end = max(t_end, T_s),
                           .w_psi = w_goal,
                           .w_i = w_i,
                           .w_sw = w_sw,
                           .horizon = horizon};
    state.holds = profile.of(feedback) > T(0.5);  // between two speeds the nearer one decides
    if (state.holds) {
      remember(state, y.omega_m, abs(tau_ref), search.phases);
    } else {
      state.lost = T(0);
    }
    if (!(state.lost < lasting)) {
      for (int k = 0; k < N; ++k) {
        state.ordered[k] = hold<T>(nearest(search.phases[k], y.u_dc));
      }
      return state.ordered;
    }
    std::array<int, N> last;
    for (int k = 0; k < N; ++k) last[k] = static_cast<int>(state.ordered[k].leg.back());
    const auto best = search.best(last);
    for (int k = 0; k < N; ++k) state.ordered[k] = hold<T>(static_cast<Leg>(best.level[k]));
    return state.ordered;
  }

 private:
  /// The torque to ask for, so that the mean is that of the reference; no more than the guide has.
  [[gnu::noinline, gnu::cold]] T held(State& state, T omega_m, T tau_ref) const {
    const T demand = abs(tau_ref);
    const T turn = static_cast<T>(machine.N_r) * omega_m * T_s;
    const T most = min(guide.first.level_max, (T(1) + held_part) * demand);
    return state.hold.asked(demand, state.tau, turn, brakes(omega_m, tau_ref), most, dead);
  }

  [[gnu::noinline, gnu::cold]] void remember(
      State& state, T omega_m, T demand, const std::array<PhasePrediction<T>, N>& phases) const {
    state.tau = T(0);
    for (const PhasePrediction<T>& x : phases) state.tau = state.tau + x.tau;
    if (!(state.lost < lasting)) return;
    const T turn = static_cast<T>(machine.N_r) * abs(omega_m) * T_s;
    const bool off = abs(state.tau - demand) > much * demand;
    state.lost = max(state.lost + (off ? turn : -turn), T(0));
    if (!(state.lost < lasting)) state.hold = {};
  }

  /// The leg that brings a phase nearest to its guide at the end of the sample.
  [[gnu::noinline, gnu::cold]] Leg nearest(const PhasePrediction<T>& x, T u_dc) const {
    const T goal = x.goal + x.goal_rate * T_s;
    int best = -1;
    T least = abs(max(x.psi + x.rate(-1, u_dc, R) * T_s, T(0)) - goal);
    for (int level = 0; level < 2 && !(level > 0 && x.i > i_max); ++level) {
      const T away = abs(x.psi + x.rate(level, u_dc, R) * T_s - goal);
      if (away < least) {
        least = away;
        best = level;
      }
    }
    return static_cast<Leg>(best);
  }
};

}  // namespace srm
