// Predictive torque control with the switching instants inside the sample as variables.
//
// Torque is held within a band whose width follows from the cost of a turn-on (edge_plan.hpp), the
// flux linkages near the guide: the least-copper profile of zero torque ripple, computed offline.
// At each sample the legs are extrapolated; where the torque would leave its band, an edge is set
// at that instant and the leg combination that is worth most goes on from there. The timer gives
// two edges a phase and sample, and the border between two samples is a third. A sample that is
// long against a pulse can run out of edges; so several plans compete, with bands stretched step by
// step and with or without a change at the border, and the one of least cost is ordered.
//
// One law from "2 us, no delay" to "20 us, one sample late": a short sample is almost always met by
// the first plan, which has no edge at all.
#pragma once

#include "srm/control/edge_plan.hpp"

namespace srm {

template <Machine M, int N>
struct EdgeMpc {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  using Plan = EdgePlan<T, N>;
  static constexpr int n_phases = N;

  /// Bands tried in a sample: A, 1.2 A, .. 3.6 A. Beyond that a 20 us sample has edges left at
  /// every operating point seen.
  static constexpr int n_bands = 8;
  static constexpr T stretch = T(1.2);
  /// A phase may leave the guide by the flux that makes this many torque bands ...
  static constexpr T looseness = T(8);
  /// ... and leaving it so far for a pulse costs this share of the torque ripple. From 0.03 to 1
  /// the rms error at equal switching frequency moves by 5 %, rms current by 0.3 %.
  static constexpr T w_flux = T(0.3);

  M machine;
  AngleTable<T> guide;  // flux linkage over torque reference and electrical angle [Wb]
  T w_sw;               // cost of a turn-on: switching_weight.hpp [N^2 m^2 s]
  T psi_slack;          // most that a phase may leave the guide [Wb]
  T R;                  // phase resistance [ohm]
  T i_max;              // current limit [A]
  T T_s;                // control period [s]
  int delay;            // samples from measurement to effect: 0 or 1

  struct State {
    Command<T, N> ordered{};  // in the sample before
  };

  Command<T, N> step(State& state, const Measurement<T, N>& y, T tau_ref) const {
    const Plan plan = problem(state, y, tau_ref);
    typename Plan::Point start;
    start.e = -abs(tau_ref);
    T along = T(0);
    for (int k = 0; k < N; ++k) {
      const PhaseOutlook<T>& x = plan.phases[k];
      start.e = start.e + x.tau;
      start.level[k] = static_cast<int>(state.ordered[k].leg[2]);
      if (!x.idle) start.away[k] = x.psi - x.goal;
      along = along + x.gain * start.away[k];
    }
    plan.without_torque(start.away, along);

    T band = plan.A;
    T least = T(1e30);
    for (int j = 0; j < n_bands; ++j) {
      for (const bool change : {false, true}) {
        const Trial trial = roll_out(plan, start, band, change);
        if (trial.cost < least) {
          least = trial.cost;
          state.ordered = trial.command;
        }
        if (trial.quiet) return state.ordered;  // nothing to decide in this sample
      }
      band = band * stretch;
    }
    return state.ordered;
  }

 private:
  struct Trial {
    Command<T, N> command{};
    T cost{};
    bool quiet = true;
  };

  Plan problem(const State& state, const Measurement<T, N>& y, T tau_ref) const {
    const T ahead = max(T_s, T(10e-6));
    const Outlook<M, N> model{machine, guide, R, T_s, delay, ahead, psi_slack / T(100)};
    Plan p;
    p.phases = model.at(y, tau_ref, state.ordered);
    p.u_dc = y.u_dc;
    p.R = R;
    p.w_sw = w_sw;
    p.w_flux = w_flux;
    T ripple = abs(tau_ref) * T(1e3);  // 0.1 % of the torque in a microsecond, where no phase acts
    for (const PhaseOutlook<T>& x : p.phases) {
      p.drift = p.drift + x.drift;
      if (x.idle) continue;
      p.gain_squared = p.gain_squared + x.gain * x.gain;
      ripple = max(ripple, ripple_rate(x.gain, x.goal_rate + R * x.i, y.u_dc));
    }
    p.A = cube_root(T(0.75) * w_sw * ripple);
    p.pulse = T(2) * p.A / max(ripple, T(1));
    for (int k = 0; k < N; ++k) levels(p, k);
    return p;
  }

  /// What phase k may do: the two levels around the voltage that the guide asks for; beyond twice
  /// its slack also the third; demagnetize where it has to.
  void levels(Plan& p, int k) const {
    const PhaseOutlook<T>& x = p.phases[k];
    p.slack[k] = T(1) / (abs(x.gain) / (looseness * max(p.A, T(1e-6))) + T(1) / psi_slack);
    p.lowest[k] = p.highest[k] = -1;
    if (x.idle) return;
    const T away = x.psi - x.goal;
    p.lowest[k] = x.goal_rate + R * x.i < T(0) || away > T(2) * p.slack[k] ? -1 : 0;
    p.highest[k] = x.goal_rate + R * x.i < T(0) && away > T(-2) * p.slack[k] ? 0 : 1;
    if (x.i > i_max) {
      p.lowest[k] = -1;
      p.highest[k] = 0;
    }
  }

  /// The orders that keep the torque within a band, and what they cost up to the sample's end and
  /// in the dwell that follows. change: other legs from the start.
  Trial roll_out(const Plan& plan, typename Plan::Point x, T band, bool change) const {
    Trial trial;
    for (int k = 0; k < N; ++k) trial.command[k] = hold<T>(static_cast<Leg>(x.level[k]));
    std::array<int, N> edges{};
    T t = T(0);
    typename Plan::Point d = plan.slopes(x.level);
    T stay = change ? T(0) : plan.stay(x, d, band);
    for (int decision = 0; decision < 2 * N + 2 && t + stay < T_s; ++decision) {
      trial.quiet = false;
      trial.cost = trial.cost + Plan::squared(x.e, d.e, stay);
      Plan::advance(x, d, stay);
      t = t + stay;
      const std::array<int, N> next = plan.best(x, edges, change && decision == 0);
      const int levels = Plan::distance(x.level, next);
      if (levels == 0) {  // the legs are best as they are: now only the torque can ask again
        stay = Plan::torque_exit(x.e, d.e, band, T_s);
        if (!(stay > T(0))) break;
        continue;
      }
      trial.cost = trial.cost + w_sw / T(2) * static_cast<T>(levels);
      for (int k = 0; k < N; ++k) {
        if (next[k] != x.level[k]) order(trial.command[k], edges[k], next[k], t);
      }
      x.level = next;
      d = plan.slopes(next);
      stay = plan.stay(x, d, band);
    }
    trial.cost = trial.cost + Plan::squared(x.e, d.e, T_s - t);
    Plan::advance(x, d, T_s - t);
    trial.cost = trial.cost + plan.dwell_at_end(x, d) + plan.flux_cost(x, d);
    return trial;
  }

  /// A new level from time t on: from the start of the sample, or as the next edge.
  static void order(PhaseCommand<T>& c, int& edges, int level, T t) {
    const Leg leg = static_cast<Leg>(level);
    if (!(t > T(0))) {
      c = hold<T>(leg);
      return;
    }
    c.t_edge[edges] = t;
    ++edges;
    for (int j = edges; j < 3; ++j) c.leg[j] = leg;
  }
};

}  // namespace srm
