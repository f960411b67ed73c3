// What the next sample brings where phases share iron: prediction.hpp with all phases at once.
//
// The flux linkage of a phase still follows its own leg alone, dpsi_k/dt = u_k - R i_k. But a
// current follows from all flux linkages, through the matrix L of incremental inductances, and so
// does the torque: its gains are
//
//   dtau/dpsi = L^-1 psi_theta
//
// over the phases that conduct. Gains and drift are secants to the point where the guide leads all
// of them together.
//
// The guide has the flux linkage of a phase alone at the guide's current, which is zero where it
// wants none, and apart from it what the neighbours add there. As seen by a law, `psi` is the flux
// linkage of the phase alone, too: no current, no flux. What the neighbours add now stands in the
// goal. The flux linkage of a phase without current follows its neighbours; its rates count from
// there.
//
// What the pairs add is a small part of it all. So they are computed once a sample, where its
// orders begin to act, and are a tangent from there: back to the measurement and on to where the
// guide leads.
//
// Of the torque of a pair each phase has half; where one is about to start it has all of it.
#pragma once

#include "srm/base/symmetric.hpp"
#include "srm/control/part/prediction.hpp"
#include "srm/machine/with_pairs.hpp"

namespace srm {

template <Machine M, int N>
struct Prediction<WithPairs<M>, N> {
  using T = typename M::Scalar;

  WithPairs<M> machine;
  Profile<T> guide;  // flux linkage over electrical angle [Wb]
  T R;               // phase resistance [ohm]
  T T_s;             // control period [s]
  int delay;         // samples from measurement to effect: 0 or 1
  T ahead;           // length of the secants [s]
  T off;             // a guide below this flux linkage wants no current [Wb]; 0: it has no say

  std::array<PhasePrediction<T>, N> at(const Measurement<T, N>& y, T tau_ref,
                                       Memory<T, N>& memory) const {
    const T sense = tau_ref < T(0) ? T(-1) : T(1);
    const T omega_e = static_cast<T>(machine.N_r) * y.omega_m, omega_m = sense * y.omega_m;
    const T begin = static_cast<T>(delay) * T_s;
    const Angles now{y.theta_e, omega_e * begin, sense};
    const Angles then{y.theta_e, omega_e * (begin + ahead), sense};
    Phases magnetized{}, i;
    Goals goals;
    Some taken;
    for (int k = 0; k < N; ++k) {
      const Profile<T> profile = guide.of_phase(k, now.mirrored);
      const T own = profile.at(now.of[k]), own_next = profile.at(then.of[k]);
      goals.idle[k] = max(own, own_next) < off;
      if (delay > 0) magnetized[k] = magnetizing_time(memory.ordered[k], T_s) * y.u_dc;
      const bool flows = y.i[k] > (goals.idle[k] ? machine.no_current() : T(0));
      i[k] = flows ? y.i[k] : T(0);
      taken[k] = flows || !goals.idle[k] || magnetized[k] > T(0);
      if (!taken[k]) continue;
      goals.now[k] = own + profile.mutual_at(now.of[k]);
      goals.next[k] = own_next + profile.mutual_at(then.of[k]);
    }
    if (delay == 0) {
      const Alone own = alone(taken, i, now);
      const Added pairs = added(taken, goals.idle, i, now);
      return phases(i, own, pairs, then, goals, omega_m, y.u_dc, {});
    }
    const Angles measured{y.theta_e, T(0), sense};
    Alone own;
    const Added pairs =
        carry(i, own, taken, goals.idle, magnetized, measured, now, omega_m, y.u_dc, memory);
    return phases(i, own, pairs, then, goals, omega_m, y.u_dc, memory.bias);
  }

 private:
  using Phases = std::array<T, N>;
  using Some = std::array<bool, N>;

  /// What the guide wants.
  struct Goals {
    Some idle;
    Phases now{}, next{};  // flux linkages [Wb]
  };

  /// Of all phases at one instant, mirrored for a negative torque.
  struct Angles {
    T theta_e;  // of phase 0, as it is [rad]
    Phases of;  // of each phase, mirrored

    Angles(T measured, T turned, T sense) {
      theta_e = wrap(measured + turned);
      for (int k = 0; k < N; ++k) {
        of[k] = wrap(sense * phase_angle<N>(measured, k) + sense * turned);
      }
      mirrored = sense < T(0);
    }
    bool mirrored;
  };

  /// Magnetics of the phases that are taken, without their neighbours.
  struct Alone {
    Phases psi{}, tau{}, psi_theta{}, L{};  // [Wb], [N m], [Wb/rad], [H]
  };

  Alone alone(const Some& taken, const Phases& i, const Angles& at) const {
    Alone m;
    for (int k = 0; k < N; ++k) {
      if (!taken[k]) continue;
      const Magnetics<T> own = machine.map.at(i[k], at.of[k]);
      m.psi[k] = own.psi;
      m.tau[k] = own.tau;
      m.psi_theta[k] = own.psi_theta;
      m.L[k] = own.L_inc;
    }
    return m;
  }

  /// What the pairs add to them.
  struct Added {
    Phases psi{}, psi_theta{};  // [Wb], [Wb/rad]
    Phases tau{}, tau_theta{};  // [N m], [N m/rad]
    Square<T, N> L{};           // [H]

    /// After changes of the currents and of the rotor angle, mirrored as these.
    T psi_after(int k, const Phases& d, T dtheta_m) const {
      T sum = psi[k] + psi_theta[k] * dtheta_m;
      for (int l = 0; l < N; ++l) sum = sum + L[k][l] * d[l];
      return sum;
    }
    T tau_after(int k, const Phases& d, T dtheta_m) const {
      return tau[k] + psi_theta[k] * d[k] + tau_theta[k] * dtheta_m;
    }
  };

  [[gnu::noinline]] Added added(const Some& taken, const Some& idle, const Phases& i,
                                const Angles& at) const {
    Added m;
    const Coupling<T>& pairs = machine.pairs;
    const T turn = at.mirrored ? T(-1) : T(1);
    for (int n = 0; n < pairs.n_pairs(); ++n) {
      const int k = pairs.first[n], l = pairs.second[n];
      if (!taken[k] || !taken[l]) continue;
      const PairMagnetics<T> both = pairs.at(n, i[k], i[l], at.theta_e);
      const bool k_starts = !idle[k] && !(i[k] > T(0)), l_starts = !idle[l] && !(i[l] > T(0));
      const T of_k = k_starts == l_starts ? T(0.5) : k_starts ? T(1) : T(0), of_l = T(1) - of_k;
      m.psi[k] = m.psi[k] + both.psi_first;
      m.psi[l] = m.psi[l] + both.psi_second;
      m.psi_theta[k] = m.psi_theta[k] + turn * both.psi_theta_first;
      m.psi_theta[l] = m.psi_theta[l] + turn * both.psi_theta_second;
      m.tau[k] = m.tau[k] + turn * of_k * both.tau;
      m.tau[l] = m.tau[l] + turn * of_l * both.tau;
      m.tau_theta[k] = m.tau_theta[k] + of_k * both.tau_theta;
      m.tau_theta[l] = m.tau_theta[l] + of_l * both.tau_theta;
      m.L[k][k] = m.L[k][k] + both.L_first;
      m.L[l][l] = m.L[l][l] + both.L_second;
      m.L[k][l] = m.L[l][k] = both.L_mutual;
    }
    return m;
  }

  static Square<T, N> sum(const Alone& own, const Added& pairs) {
    Square<T, N> L = pairs.L;
    for (int k = 0; k < N; ++k) L[k][k] = L[k][k] + own.L[k];
    return L;
  }

  /// The state after the sample under way, and its currents in i: a step along the straight lines
  /// of the flux linkages of each phase alone, and one of Newton's method for all. On the way the
  /// error of the last such prediction corrects the bias (prediction.hpp).
  [[gnu::noinline]] Added carry(Phases& i, Alone& own, const Some& taken, const Some& idle,
                                const Phases& magnetized, const Angles& measured, const Angles& end,
                                T omega_m, T u_dc, Memory<T, N>& memory) const {
    const Alone here = alone(taken, i, measured);
    Phases missed{}, i_end{}, back{};
    Some flows{};
    for (int k = 0; k < N; ++k) {
      flows[k] = i[k] > T(0) || magnetized[k] > T(0);  // else the diodes block
      if (!flows[k]) continue;
      if (i[k] > T(0) && memory.i_expected[k] > T(0)) missed[k] = i[k] - memory.i_expected[k];
      const T flux =
          magnetized[k] + T_s * (memory.bias[k] - R * i[k] - omega_m * here.psi_theta[k]);
      i_end[k] = max(i[k] + flux / here.L[k], T(0));
      back[k] = i[k] - i_end[k];
    }
    own = alone(taken, i_end, end);
    Added pairs = added(taken, idle, i_end, end);
    const Square<T, N> L = sum(own, pairs);
    Phases lacks{};
    for (int k = 0; k < N; ++k) {
      T& bias = memory.bias[k];
      if (!flows[k]) {
        bias = T(0);
        continue;
      }
      T flux = here.L[k] * missed[k];
      for (int l = 0; l < N; ++l) flux = flux + pairs.L[k][l] * missed[l];
      bias = clamp(bias + flux / T_s / T(8), -u_dc / T(10), u_dc / T(10));
      const T driven = magnetized[k] + T_s * (bias - R * (i[k] + i_end[k]) / T(2));
      const T before = here.psi[k] + pairs.psi_after(k, back, -omega_m * T_s);
      lacks[k] = before + driven - own.psi[k] - pairs.psi[k];
      flows[k] = i_end[k] > T(0) || lacks[k] > T(0);
    }
    Phases d = solved<T, N>(flows, L, lacks);
    for (int k = 0; k < N; ++k) {
      i[k] = max(i_end[k] + d[k], T(0));
      d[k] = i[k] - i_end[k];
      own.psi[k] = own.psi[k] + own.L[k] * d[k];
      own.tau[k] = own.tau[k] + own.psi_theta[k] * d[k];
    }
    for (int k = 0; k < N; ++k) {
      pairs.psi[k] = pairs.psi_after(k, d, T(0));
      pairs.tau[k] = pairs.tau_after(k, d, T(0));
    }
    memory.i_expected = i;
    return pairs;
  }

  [[gnu::noinline]] std::array<PhasePrediction<T>, N> phases(const Phases& i, const Alone& own,
                                                             const Added& pairs, const Angles& then,
                                                             const Goals& goals, T omega_m, T u_dc,
                                                             const Phases& bias) const {
    std::array<PhasePrediction<T>, N> x{};
    const T most = u_dc * ahead;
    Some taken, starts, flows;
    Phases move{}, moved{}, psi_theta{};
    bool any_starts = false;
    for (int k = 0; k < N; ++k) {
      x[k].idle = goals.idle[k];
      flows[k] = i[k] > T(0);
      starts[k] = !flows[k] && !goals.idle[k];
      taken[k] = flows[k] || starts[k];
      any_starts = any_starts || starts[k];
      if (!taken[k]) continue;
      // A phase that starts takes all of the voltage; one far from the guide, too.
      const T back = goals.next[k] - (own.psi[k] + pairs.psi[k]);
      move[k] = max(goals.next[k] - goals.now[k], -own.psi[k]);
      if (abs(back) > most) move[k] = back > T(0) ? most : -most;
      if (starts[k]) move[k] = most;
      psi_theta[k] = own.psi_theta[k] + pairs.psi_theta[k];
      moved[k] = move[k] - omega_m * psi_theta[k] * ahead;
    }
    const Square<T, N> L = sum(own, pairs);
    Phases still{};  // voltage that the neighbours induce in a phase that starts
    if (any_starts) {
      const Phases rise = solved<T, N>(flows, L, moved);
      for (int k = 0; k < N; ++k) {
        if (!starts[k]) continue;
        for (int l = 0; l < N; ++l) {
          if (flows[l]) still[k] = still[k] + L[k][l] * rise[l];
        }
        still[k] = still[k] / ahead + omega_m * psi_theta[k];
      }
    }
    Phases i_next = solved<T, N>(taken, L, moved), d;
    for (int k = 0; k < N; ++k) {
      i_next[k] = max(i[k] + i_next[k], T(0));
      d[k] = i_next[k] - i[k];
    }
    const Alone next = alone(taken, i_next, then);
    const T turn = omega_m * ahead;
    Phases psi_theta_next;
    for (int k = 0; k < N; ++k) psi_theta_next[k] = next.psi_theta[k] + pairs.psi_theta[k];
    const Phases gain = solved<T, N>(taken, L, psi_theta);
    const Phases gain_next = solved<T, N>(taken, sum(next, pairs), psi_theta_next);
    for (int k = 0; k < N; ++k) {
      if (!taken[k]) continue;
      PhasePrediction<T>& p = x[k];
      const T psi_next = next.psi[k] + pairs.psi_after(k, d, turn);
      const T lacks = own.psi[k] + pairs.psi[k] + move[k] - psi_next;
      const T tau_next = next.tau[k] + pairs.tau_after(k, d, turn) + gain_next[k] * lacks;
      const T L_inverse = T(1) / L[k][k];
      p.psi = flows[k] ? own.psi[k] : T(0);
      p.i = i[k];
      p.tau = own.tau[k] + pairs.tau[k];
      p.gain = (gain[k] + gain_next[k]) / T(2);
      p.drift = (tau_next - p.tau - p.gain * move[k]) / ahead + p.gain * still[k];
      p.goal = goals.now[k] - pairs.psi[k];
      p.goal_rate = (goals.next[k] - goals.now[k]) / ahead - still[k];
      p.i_gain = L_inverse;
      p.i_drift = -omega_m * psi_theta[k] * L_inverse;
      p.bias = bias[k] - still[k];
    }
    return x;
  }
};

}  // namespace srm
