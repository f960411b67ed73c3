// Predictive torque control with the switching instants inside the sample as variables.
//
// Torque is held within a band whose width follows from the cost of a turn-on (edge_plan.hpp), the
// flux linkages near the guide: the least-copper profile of zero torque ripple, computed offline.
// At each sample the legs are extrapolated; where the torque would leave its band, an edge is set
// at that instant: one phase goes to the level that is worth most from there. The timer gives four
// edges a phase and sample; in a sample that is long against a pulse the band is wider, so that
// they last.
//
// Far outside the band, after a step of the reference, every phase is driven towards it by all of
// the voltage until the torque is there, in whichever sample and at whichever instant that is
// (step_assist.hpp).
//
// Where the levels of the plan leave the torque far from its reference for a pulse, the voltage
// cannot hold it. From there on, for a period, each phase follows the guide by itself
// (profile_follower.hpp). In both modes feedback holds the mean torque.
//
// One law from "2 us, no delay" to "20 us, one sample late": the plan of a short sample almost
// always has no edge at all.
//
// Tuned numbers, and what they decide: docs/control/tuned_constants.md.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/coupled_prediction.hpp"
#include "srm/control/part/edge_plan.hpp"
#include "srm/control/part/profile_follower.hpp"
#include "srm/control/part/step_assist.hpp"

namespace srm {

template <Machine M, int N>
struct EdgeMpc {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  using Plan = EdgePlan<T, N>;
  static constexpr int n_phases = N;

  /// A phase may leave the guide by the flux that makes this many torque bands.
  static constexpr T looseness = T(16);
  /// Band of a sample of two pulses and more: this share of A T_s/pulse (0.4 would last for five
  /// edges).
  static constexpr T wide_band = T(0.53);
  /// What the feedback of the mean may add to the torque: the guide has as much more [1].
  static constexpr T held_part = T(0.1);
  /// A torque error of this many bands is far [1].
  static constexpr T far = T(5);

  M machine;
  ReferenceProfile<T> guide;  // flux linkage over torque reference, electrical angle and speed [Wb]
  T w_sw;                     // cost of a turn-on: switching_weight.hpp [N^2 m^2 s]
  View<T> psi_slack;          // most that a phase may leave the guide, at each of its speeds [Wb]
  T R;                        // phase resistance [ohm]
  T i_max;                    // current limit [A]
  T T_s;                      // control period [s]
  int delay;                  // samples from measurement to effect: 0 or 1
  SRM_FIELDS(machine, guide, w_sw, psi_slack, R, i_max, T_s, delay)

  enum class Mode { plan, follow, assist };

  struct State : Memory<T, N> {
    MeanTorqueFeedback<T> mean{};
    TorqueStep<T> steps{};
    T tau{};         // of the last sample, in the frame of positive torque [N m]
    T short_left{};  // angle for which the guide is still followed [rad]
  };

  constexpr bool is_consistent() const { return psi_slack.size == guide.omega.size; }

  Command<T, N> step(State& state, const Measurement<T, N>& y, T tau_ref) const {
    const bool braking = brakes(y.omega_m, tau_ref);
    const T turn = static_cast<T>(machine.N_r) * abs(y.omega_m) * T_s;
    state.steps.next(tau_ref, turn, two_pi<T> / static_cast<T>(N));
    const T most = min(guide.first.level_max, (T(1) + held_part) * abs(tau_ref));
    const T demand = state.mean.asked(abs(tau_ref), state.tau, turn, braking, most);
    const Profile<T> profile = guide.at(demand, y.omega_m, y.u_dc);
    const T slack = profile.of(psi_slack);
    const T ahead = max(T_s, T(10e-6));
    const Prediction<M, N> prediction{machine, profile, R, T_s, delay, ahead, slack / T(100)};
    const Phases phases = prediction.at(y, tau_ref, state);
    state.tau = torque_of(phases);
    const Band band = band_of(phases, demand, y.u_dc);
    const Mode mode = mode_of(state, phases, demand, band, turn, y.u_dc);
    if (mode == Mode::follow) {
      const T near = y.u_dc * band.pulse / T(8);  // half of what a pulse of even duty moves
      ProfileFollower<T, N>{R, i_max, T_s}.follow(phases, near, y.u_dc, state.ordered);
      return state.ordered;
    }
    plan_sample(state, phases, demand, band, slack, mode, y.u_dc);
    if (mode == Mode::assist && state.steps.lasts() && !braking) {
      const StepAssist<M, N> assist{i_max, T_s, delay};
      assist.magnetize_ahead(y, tau_ref, phases, profile, turn, state.ordered);
    }
    return state.ordered;
  }

 private:
  static constexpr int decisions_max = 2 * N + 2;
  using Phases = std::array<PhasePrediction<T>, N>;

  struct Band {
    T A;      // half width of the torque band [N m]
    T pulse;  // length of a pulse period at this band [s]
  };

  Band band_of(const Phases& phases, T demand, T u_dc) const {
    T ripple = max(demand * T(1e3), T(1));  // 0.1 % in a microsecond, where no phase acts
    for (const PhasePrediction<T>& x : phases) {
      if (!x.idle) ripple = max(ripple, ripple_rate(x.gain, x.goal_rate + R * x.i, u_dc));
    }
    const T A = max(cube_root(T(0.75) * w_sw * ripple), T(1e-6));
    return {A, T(2) * A / ripple};
  }

  Mode mode_of(State& state, const Phases& phases, T demand, const Band& band, T turn,
               T u_dc) const {
    if (state.steps.lasts()) return Mode::assist;
    state.short_left = max(state.short_left - turn, T(0));
    const bool judged = !(state.short_left > T(0)) && !(state.steps.left > T(0));
    if (judged && !can_hold(phases, demand, band, u_dc)) state.short_left = two_pi<T>;
    return state.short_left > T(0) ? Mode::follow : Mode::plan;
  }

  /// Whether the levels around the voltage of the guide bring a torque that is far from its
  /// reference back within a pulse.
  bool can_hold(const Phases& phases, T demand, const Band& band, T u_dc) const {
    T most = T(0), least = T(0);  // slopes of the torque [N m/s]
    for (const PhasePrediction<T>& p : phases) {
      const int low = p.idle || p.goal_rate + R * p.i < T(0) ? -1 : 0;
      const T a = p.gain * p.rate(low, u_dc, R);
      const T b = p.idle ? a : p.gain * p.rate(low + 1, u_dc, R);
      most = most + p.drift + max(a, b);
      least = least + p.drift + min(a, b);
    }
    const T e = torque_of(phases) - demand;
    const T t = max(T_s, band.pulse);
    return e + most * t >= -far * band.A && e + least * t <= far * band.A;
  }

  [[gnu::noinline]] void plan_sample(State& state, const Phases& phases, T demand, const Band& band,
                                     T slack, Mode mode, T u_dc) const {
    typename Plan::Point x;
    const Plan plan = problem(phases, u_dc, demand, mode == Mode::assist, slack, band, x);
    typename Plan::Levels last;
    for (int j = 0; j < plan.n_active; ++j) {
      const typename Plan::Active& p = plan.phases[j];
      last[j] = static_cast<int>(state.ordered[p.k].leg.back()) + 1;
      if (is_far(phases[p.k], x.e)) last[j] = x.e < T(0) ? p.highest : p.lowest;
    }
    plan_edges(plan, x, last, band.pulse, state.ordered);
    if (!(x.e * band.A < -TorqueStep<T>::lacks * demand)) state.steps.reached = true;
  }

  /// The plan's units and x, where it starts. steps: after a step of the reference, where the guide
  /// counts for nothing while the torque is far from it.
  [[gnu::noinline]] Plan problem(const std::array<PhasePrediction<T>, N>& phases, T u_dc, T demand,
                                 bool steps, T slack, const Band& band,
                                 typename Plan::Point& x) const {
    const T A = band.A, pulse = band.pulse;
    Plan plan;
    const T per_A = T(1) / A;
    const T per_slack = T(1) / slack;
    T gain_squared = T(0);
    T e = -demand, along = T(0), drift = T(0);
    for (const PhasePrediction<T>& p : phases) {
      e = e + p.tau;
      drift = drift + p.drift + p.gain * (p.idle ? p.rate(-1, u_dc, R) : p.goal_rate);
      if (p.idle) continue;
      gain_squared = gain_squared + p.gain * p.gain;
      along = along + p.gain * (p.psi - p.goal);
    }
    x.e = e * per_A;
    x.along = along * per_A;
    plan.drift = drift * pulse * per_A;
    const T share = gain_squared > T(0) ? A / gain_squared : T(0);
    for (int k = 0; k < N; ++k) {
      const PhasePrediction<T>& p = phases[k];
      if (p.idle) continue;
      const int j = plan.n_active++;
      typename Plan::Active& a = plan.phases[j];
      const T per_flux =
          steps && is_far(p, x.e) ? T(0) : abs(p.gain) * (per_A / looseness) + per_slack;
      a.k = k;
      a.spread = p.gain * share * per_flux;
      plan.spread_squared = plan.spread_squared + a.spread * a.spread;
      const T per_volt = pulse * per_flux, tau_per_volt = p.gain * pulse * per_A;
      for (int level = 0; level < 3; ++level) {
        const T leaves = p.rate(level - 1, u_dc, R) - p.goal_rate;
        a.tau_rate[level] = leaves * tau_per_volt;
        a.z_rate[level] = leaves * per_volt;
      }
      x.z[j] = (p.psi - p.goal) * per_flux;
      set_levels(a, p, x.z[j], x.e);
      if (must_start(p, u_dc)) a.lowest = a.highest;
    }
    return plan;
  }

  /// The torque is far from its reference, and this phase can take it there.
  static bool is_far(const PhasePrediction<T>& p, T e) { return abs(e) > far && p.gain > T(0); }

  /// A phase without current that is behind the guide, where this takes more than half of the
  /// voltage. In a sample that it waits the guide gains goal_rate T_s, and in the next one it can
  /// make up (u_dc - goal_rate) T_s, which is less.
  bool must_start(const PhasePrediction<T>& p, T u_dc) const {
    const bool flows = !(p.i < no_current_part<T> * i_max);
    return !flows && p.psi < p.goal && p.goal_rate > u_dc / T(2);
  }

  /// The two levels around the voltage that the guide asks for; beyond twice its slack, or with the
  /// torque far away, also the third; and no magnetizing above the current limit.
  void set_levels(typename Plan::Active& a, const PhasePrediction<T>& p, T away, T e) const {
    const bool falling = p.goal_rate + R * p.i < T(0);
    const bool over = p.i > i_max;
    const bool low = is_far(p, e) && e < T(0), high = is_far(p, e) && e > T(0);
    a.lowest = falling || away > T(2) || over || high ? 0 : 1;
    a.highest = (falling && away > T(-2) && !low) || over ? 1 : 2;
  }

  /// Orders that keep the torque within its band, from legs on.
  void plan_edges(const Plan& plan, typename Plan::Point x, typename Plan::Levels level, T pulse,
                  Command<T, N>& command) const {
    for (PhaseCommand<T>& c : command) {
      c.leg = all_legs(Leg::demagnetize);
      c.t_edge.fill(never<T>);
    }
    const T end = T_s / pulse;
    const T band = max(T(1), wide_band * end);
    typename Plan::Levels edges{};
    T t = T(0);
    typename Plan::Point d = plan.slopes(level);
    T stay = plan.stay(x, d, level, band, end);
    for (int decision = 0; decision < decisions_max && t + stay < end; ++decision) {
      plan.advance(x, d, stay);
      t = t + stay;
      const typename Plan::Levels before = level;
      if (!plan.change(level, x, d, edges)) {  // best as they are: now only the torque can ask
        stay = Plan::torque_exit(x.e, d.e, band, end);
        if (stay > T(0)) continue;
        break;
      }
      for (int j = 0; j < plan.n_active; ++j) {
        if (level[j] == before[j] || !(t > T(0))) continue;
        PhaseCommand<T>& c = command[plan.phases[j].k];
        c.leg[edges[j]] = static_cast<Leg>(before[j] - 1);
        c.t_edge[edges[j]++] = t * pulse;
      }
      stay = plan.stay(x, d, level, band, end);
    }
    for (int j = 0; j < plan.n_active; ++j) {
      Legs& leg = command[plan.phases[j].k].leg;
      for (int n = edges[j]; n <= max_edges; ++n) leg[n] = static_cast<Leg>(level[j] - 1);
    }
  }
};

}  // namespace srm
