// Predictive torque control with the switching instants inside the sample as variables.
//
// Torque is held within a band whose width follows from the cost of a turn-on (edge_plan.hpp), the
// flux linkages near the guide: the least-copper profile of zero torque ripple, computed offline.
// At each sample the legs are extrapolated; where the torque would leave its band, an edge is set
// at that instant: one phase goes to the level that is worth most from there. The timer gives four
// edges a phase and sample, and the border between two samples is a fifth. A sample that is
// long against a pulse can run out of edges; so several plans compete, with bands stretched step by
// step and with or without a change at the border, and the one of least cost is ordered.
//
// One law from "2 us, no delay" to "20 us, one sample late": a short sample is almost always met by
// the first plan, which has no edge at all.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/edge_plan.hpp"

namespace srm {

template <Machine M, int N>
struct EdgeMpc {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  using Plan = EdgePlan<T, N>;
  static constexpr int n_phases = N;

  /// A phase may leave the guide by the flux that makes this many torque bands ...
  static constexpr T looseness = T(8);
  /// ... and leaving it so far for a pulse costs this share of the torque ripple.
  static constexpr T w_flux = T(0.3);
  /// Bands tried in a sample: A or, in a sample of two pulses and more, this share of A T_s/pulse
  /// (0.4 would last for five edges), then wider by `stretch` until a plan fits into it.
  static constexpr T start_band = T(0.6);
  static constexpr T stretch = T(1.2);
  static constexpr int n_bands = 3;
  /// No wider band is tried after so many decisions: this bounds the time of a step.
  static constexpr int enough = 8;

  M machine;
  Guide<T> guide;     // flux linkage over torque reference, electrical angle and speed [Wb]
  T w_sw;             // cost of a turn-on: switching_weight.hpp [N^2 m^2 s]
  View<T> psi_slack;  // most that a phase may leave the guide, at each of its speeds [Wb]
  T R;                // phase resistance [ohm]
  T i_max;            // current limit [A]
  T T_s;              // control period [s]
  int delay;          // samples from measurement to effect: 0 or 1
  SRM_FIELDS(machine, guide, w_sw, psi_slack, R, i_max, T_s, delay)

  using State = Memory<T, N>;

  constexpr bool is_consistent() const { return psi_slack.size == guide.omega.size; }

  Command<T, N> step(State& state, const Measurement<T, N>& y, T tau_ref) const {
    const T ahead = max(T_s, T(10e-6));
    const Profile<T> profile = guide.at(abs(tau_ref), y.omega_m, y.u_dc);
    const T slack = profile.of(psi_slack);
    const Outlook<M, N> outlook{machine, profile, R, T_s, delay, ahead, slack / T(100)};
    const auto phases = outlook.at(y, tau_ref, state);
    const Plan plan = problem(phases, y.u_dc, abs(tau_ref), slack);

    typename Plan::Point x;
    typename Plan::Levels last{};
    x.e = -abs(tau_ref);
    T along = T(0);
    for (const PhaseOutlook<T>& phase : phases) {
      x.e = x.e + phase.tau;
      if (!phase.idle) along = along + phase.gain * (phase.psi - phase.goal);
    }
    for (int j = 0; j < plan.n_active; ++j) {
      const typename Plan::Active& a = plan.phases[j];
      last[j] = static_cast<int>(state.ordered[a.k].leg.back());
      x.away[j] = (phases[a.k].psi - phases[a.k].goal) * a.per_slack - a.spread * along;
    }

    T band = max(plan.A, start_band * T_s / plan.pulse * plan.A);
    T least = T(1e30);
    int decisions = 0;
    for (int j = 0; j < n_bands && decisions < enough; ++j) {
      const Trial as_is = roll_out(plan, x, last, band, Border::free);
      if (as_is.n_decisions == 0) return state.ordered = as_is.command;  // nothing to decide
      const Trial changed = roll_out(plan, x, last, band, Border::change);
      const Trial& better = changed.cost < as_is.cost ? changed : as_is;
      if (better.cost < least) {
        least = better.cost;
        state.ordered = better.command;
      }
      if (as_is.fits && changed.fits) break;
      decisions += as_is.n_decisions + changed.n_decisions;
      band = band * stretch;
    }
    return state.ordered;
  }

 private:
  struct Trial {
    Command<T, N> command{};
    T cost{};
    int n_decisions = 0;
    bool fits = false;  // within its band to the end
  };

  Plan problem(const std::array<PhaseOutlook<T>, N>& phases, T u_dc, T demand, T slack) const {
    Plan p;
    T ripple = demand * T(1e3);  // 0.1 % of the torque in a microsecond, where no phase acts
    T gain_squared = T(0);
    for (const PhaseOutlook<T>& x : phases) {
      p.drift = p.drift + x.drift + x.gain * (x.idle ? x.rate(-1, u_dc, R) : x.goal_rate);
      if (x.idle) continue;
      gain_squared = gain_squared + x.gain * x.gain;
      ripple = max(ripple, ripple_rate(x.gain, x.goal_rate + R * x.i, u_dc));
    }
    p.A = cube_root(T(0.75) * w_sw * ripple);
    p.pulse = T(2) * p.A / max(ripple, T(1));
    p.w_sw = w_sw;
    p.w_flux = w_flux;
    const T per_gain_squared = gain_squared > T(0) ? T(1) / gain_squared : T(0);
    const T per_loose = T(1) / (looseness * max(p.A, T(1e-6)));
    for (int k = 0; k < N; ++k) {
      const PhaseOutlook<T>& x = phases[k];
      if (x.idle) continue;
      typename Plan::Active& a = p.phases[p.n_active++];
      a.k = k;
      a.per_slack = abs(x.gain) * per_loose + T(1) / slack;
      a.spread = x.gain * per_gain_squared * a.per_slack;
      for (int level = -1; level <= 1; ++level) {
        const T leaves = x.rate(level, u_dc, R) - x.goal_rate;
        a.tau_rate[level + 1] = x.gain * leaves;
        a.away_rate[level + 1] = leaves * a.per_slack;
      }
      set_levels(a, x);
    }
    return p;
  }

  /// The two levels around the voltage that the guide asks for; beyond twice its slack also the
  /// third; and no magnetizing above the current limit.
  void set_levels(typename Plan::Active& a, const PhaseOutlook<T>& x) const {
    const bool falling = x.goal_rate + R * x.i < T(0);
    const T away = (x.psi - x.goal) * a.per_slack;
    a.lowest = falling || away > T(2) || x.i > i_max ? -1 : 0;
    a.highest = (falling && away > T(-2)) || x.i > i_max ? 0 : 1;
  }

  /// The orders that keep the torque within a band, and what they cost up to the sample's end and
  /// in the dwell that follows. border: with the sample before.
  Trial roll_out(const Plan& plan, typename Plan::Point x, typename Plan::Levels level, T band,
                 Border border) const {
    Trial trial;
    for (int j = 0; j < plan.n_active; ++j) {
      trial.command[plan.phases[j].k] = hold<T>(static_cast<Leg>(level[j]));
    }
    typename Plan::Levels edges{};
    T t = T(0);
    typename Plan::Point d = plan.slopes(level);
    T stay = border == Border::change ? T(0) : plan.stay(x, d, level, band, T_s);
    for (int decision = 0; decision < 2 * N + 2 && t + stay < T_s; ++decision) {
      trial.cost = trial.cost + Plan::squared(x.e, d.e, stay);
      plan.advance(x, d, stay);
      t = t + stay;
      ++trial.n_decisions;
      const auto next = plan.best(x, level, edges, decision == 0 ? border : Border::free);
      const T price = plan.switching(level, next);
      if (!(price > T(0))) {  // the legs are best as they are: now only the torque can ask again
        stay = Plan::torque_exit(x.e, d.e, band, T_s);
        if (!(stay > T(0))) break;
        continue;
      }
      trial.cost = trial.cost + price;
      for (int j = 0; j < plan.n_active; ++j) {
        if (next[j] != level[j]) order(trial.command[plan.phases[j].k], edges[j], next[j], t);
      }
      level = next;
      d = plan.slopes(level);
      stay = plan.stay(x, d, level, band, T_s);
    }
    trial.cost = trial.cost + Plan::squared(x.e, d.e, T_s - t);
    plan.advance(x, d, T_s - t);
    trial.cost = trial.cost + plan.dwell_at_end(x.e, d.e) + plan.flux_cost(x, d);
    trial.fits = abs(x.e) <= band * T(1.01);
    return trial;
  }

  /// A new level from time t on: from the start of the sample, or as the next edge.
  static void order(PhaseCommand<T>& c, int& edges, int level, T t) {
    const Leg leg = static_cast<Leg>(level);
    if (t > T(0)) c.t_edge[edges++] = t;
    for (int n = edges; n <= max_edges; ++n) c.leg[n] = leg;
  }
};

}  // namespace srm
