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
// the voltage until the torque is there, in whichever sample and at whichever instant that is.
//
// Until the step ends or a stroke is over, a phase whose guide has not begun can help too: it is
// magnetized if the rotor takes it past the unaligned position before the phase in charge has the
// flux that the torque needs. Its own flux stays below what the guide has early in the stroke,
// where the torque over the flux is greatest; with more, a small step would overshoot. A stroke is
// the limit because torque that the voltage does not give would cost current for ever.
//
// At high speed the guide may keep a phase in current nearly throughout, and a sample may be a
// large part of the period. Flux linkage that a phase lacks there is lacking for the whole period.
// So each phase is brought to the guide by itself (guide_track.hpp), and the mean is held by
// feedback (mean_hold.hpp). The same is done where the guide conducts for much of the period and
// the plan has lost the torque for a period.
//
// One law from "2 us, no delay" to "20 us, one sample late": the plan of a short sample almost
// always has no edge at all.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/edge_plan.hpp"
#include "srm/control/part/guide_track.hpp"
#include "srm/control/part/mean_hold.hpp"
#include "srm/control/part/mirror.hpp"

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
  /// A sample that turns the rotor by more is coarse: the torque within it is no straight line
  /// [rad].
  static constexpr T coarse = T(0.1);
  /// When motoring, a guide that conducts in more than this part of the period is tracked [1].
  static constexpr T conducts_most = T(0.88);
  /// And one that conducts in more than this part, where the plan has lost the torque [1].
  static constexpr T conducts_much = T(0.7);
  /// Where the resistance takes more of the voltage, deviations from the guide decay by themselves,
  /// and the plan serves [1].
  static constexpr T damping = T(0.1);
  /// What the feedback of the mean may add to the torque or take from it [1].
  static constexpr T held_part = T(0.1);
  /// A torque error of this many bands is far [1].
  static constexpr T far = T(5);
  /// A change of the reference by more than this is a step, which ends where less is lacking [1].
  static constexpr T lacks = T(0.05);
  /// Flux at the end of a step, over that of the guide in the middle of the stroke [1].
  static constexpr T end_flux = T(1.2);

  M machine;
  Guide<T> guide;     // flux linkage over torque reference, electrical angle and speed [Wb]
  T w_sw;             // cost of a turn-on: switching_weight.hpp [N^2 m^2 s]
  View<T> psi_slack;  // most that a phase may leave the guide, at each of its speeds [Wb]
  View<T> conducts;   // part of the period in which the guide has current, at each speed [1]
  T R;                // phase resistance [ohm]
  T i_max;            // current limit [A]
  T T_s;              // control period [s]
  int delay;          // samples from measurement to effect: 0 or 1
  SRM_FIELDS(machine, guide, w_sw, psi_slack, conducts, R, i_max, T_s, delay)

  struct State : Memory<T, N> {
    MeanHold<T> hold{};
    T tau{};        // of the last sample, in the frame of positive torque [N m]
    T reference{};  // of the last sample [N m]
    // Angle that a step of the reference may still take; below zero: on which torque was lacking
    // since then, less that on which it was there [rad].
    T way{};
    bool tracks = false;  // in the last sample
  };

  constexpr bool is_consistent() const {
    return psi_slack.size == guide.omega.size && conducts.size == guide.omega.size;
  }

  Command<T, N> step(State& state, const Measurement<T, N>& y, T tau_ref) const {
    const T ahead = max(T_s, T(10e-6));
    T demand = abs(tau_ref);
    const bool motoring = (tau_ref < T(0)) == (y.omega_m < T(0));
    const T turn = static_cast<T>(machine.N_r) * abs(y.omega_m) * T_s;
    const bool jumps = abs(tau_ref - state.reference) > lacks * demand;
    state.reference = tau_ref;
    state.way = jumps ? stroke : max(state.way - turn, T(-4) * pi<T>);
    const bool tracked = state.tracks;
    if (tracked) demand = held(state, demand, turn, !motoring);
    const Profile<T> profile = guide.at(demand, y.omega_m, y.u_dc);
    const T slack = profile.of(psi_slack);
    const bool is_coarse = turn > coarse;
    const T most = state.way < T(-2) * pi<T> ? conducts_much : conducts_most;
    const bool lasts = guide.drop < damping * y.u_dc && profile.of(conducts) > most;
    state.tracks = is_coarse || (motoring && lasts);
    const Outlook<M, N> outlook{machine, profile, R, T_s, delay, ahead, slack / T(100)};
    const auto phases = outlook.at(y, tau_ref, state);
    if (state.tracks) {
      track_all(state, phases, is_coarse ? T(0) : slack, y.u_dc);
      return state.ordered;
    }
    if (tracked) state.hold = {};

    // Half width of the torque band [N m] and length of a pulse period at this band [s].
    T ripple = max(demand * T(1e3), T(1));  // 0.1 % in a microsecond, where no phase acts
    for (const PhaseOutlook<T>& x : phases) {
      if (!x.idle) ripple = max(ripple, ripple_rate(x.gain, x.goal_rate + R * x.i, y.u_dc));
    }
    const T A = max(cube_root(T(0.75) * w_sw * ripple), T(1e-6));
    const T pulse = T(2) * A / ripple;

    typename Plan::Point x;
    const Plan plan = problem(phases, y.u_dc, demand, state.way > T(0), slack, A, pulse, x);
    typename Plan::Levels last;
    for (int j = 0; j < plan.n_active; ++j) {
      const typename Plan::Active& p = plan.phases[j];
      last[j] = static_cast<int>(state.ordered[p.k].leg.back()) + 1;
      if (is_far(phases[p.k], x.e)) last[j] = x.e < T(0) ? p.highest : p.lowest;
    }

    plan_edges(plan, x, last, pulse, state.ordered);
    if (!(x.e * A < -lacks * demand)) state.way = min(state.way + T(2) * turn, T(0));
    if (motoring && state.way > T(0)) wake(state, y, tau_ref, phases, profile, turn);
    return state.ordered;
  }

 private:
  static constexpr int decisions_max = 2 * N + 2;
  static constexpr T stroke = T(2) * pi<T> / static_cast<T>(N);
  using Phases = std::array<PhaseOutlook<T>, N>;

  /// The torque to ask for while the guide is tracked, so that the mean of the torque is `demand`;
  /// no more than the guide has.
  [[gnu::noinline, gnu::cold]] T held(State& state, T demand, T turn, bool braking) const {
    state.hold.asked(demand, state.tau, turn, braking);
    T& part = state.hold.part[braking ? 1 : 0];
    const T most = max(guide.first.level_max / demand - T(1), T(0));
    part = clamp(part, -held_part, min(held_part, most));
    return demand * (T(1) + part);
  }

  /// Each phase to the guide, which it may leave by `slack`, a pulse inside the sample included.
  [[gnu::noinline, gnu::cold]] void track_all(State& state, const Phases& phases, T slack,
                                              T u_dc) const {
    const T near = max(slack / T(4) - u_dc * T_s / T(8), T(0));
    state.tau = T(0);
    for (int k = 0; k < N; ++k) {
      state.tau = state.tau + phases[k].tau;
      const Leg last = state.ordered[k].leg.back();
      state.ordered[k] = track(phases[k], last, near, u_dc, R, i_max, T_s);
    }
  }

  /// Magnetizes the idle phases that can give torque at the end of a step, up to the flux linkage
  /// of the guide early in its stroke. turn: of a sample [rad].
  [[gnu::noinline, gnu::cold]] void wake(State& state, const Measurement<T, N>& y, T tau_ref,
                                         const Phases& phases, const Profile<T>& profile,
                                         T turn) const {
    const T early = profile.at(pi<T> / T(6)) - y.u_dc * T_s;
    T built = T(0);
    for (const PhaseOutlook<T>& p : phases) built = p.gain > T(0) ? max(built, p.psi) : built;
    const T left = end_flux * profile.at(pi<T> / T(2)) - built;
    const T lead = clamp(turn / T_s * left / y.u_dc, T(0), pi<T> / T(2));
    for (int k = 0; k < N; ++k) {
      const PhaseOutlook<T>& p = phases[k];
      const T theta = drive_angle<N>(y.theta_e, k, tau_ref) + turn * static_cast<T>(delay);
      if (!p.idle || !(wrap(theta + lead) < lead + pi<T> / T(2))) continue;
      state.ordered[k] = hold<T>(p.i < i_max && p.psi < early ? Leg::magnetize : Leg::freewheel);
    }
  }

  /// The plan's units and x, where it starts. steps: after a step of the reference, where the guide
  /// counts for nothing while the torque is far from it.
  [[gnu::noinline]] Plan problem(const std::array<PhaseOutlook<T>, N>& phases, T u_dc, T demand,
                                 bool steps, T slack, T A, T pulse, typename Plan::Point& x) const {
    Plan plan;
    const T per_A = T(1) / A;
    const T per_slack = T(1) / slack;
    T gain_squared = T(0);
    T e = -demand, along = T(0), drift = T(0);
    for (const PhaseOutlook<T>& p : phases) {
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
      const PhaseOutlook<T>& p = phases[k];
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
    }
    return plan;
  }

  /// The torque is far from its reference, and this phase can take it there.
  static bool is_far(const PhaseOutlook<T>& p, T e) { return abs(e) > far && p.gain > T(0); }

  /// The two levels around the voltage that the guide asks for; beyond twice its slack, or with the
  /// torque far away, also the third; and no magnetizing above the current limit.
  void set_levels(typename Plan::Active& a, const PhaseOutlook<T>& p, T away, T e) const {
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
