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
      const T own = guide.at(now.of[k]), own_next = guide.at(then.of[k]);
      goals.idle[k] = max(own, own_next) < off;
      if (delay > 0) magnetized[k] = magnetizing_time(memory.ordered[k], T_s) * y.u_dc;
      const bool flows = y.i[k] > (goals.idle[k] ? nothing * i_last(machine.pairs) : T(0));
      i[k] = flows ? y.i[k] : T(0);
      taken[k] = flows || !goals.idle[k] || magnetized[k] > T(0);
      if (!taken[k]) continue;
      goals.now[k] = own + guide.mutual_at(now.of[k]);
      goals.next[k] = own_next + guide.mutual_at(then.of[k]);
    }
    if (delay == 0) return phases(i, joint(taken, {}, i, now), then, goals, omega_m, y.u_dc, {});
    const Angles measured{y.theta_e, T(0), sense};
    const Joint here = carry(i, taken, magnetized, measured, now, omega_m, y.u_dc, memory);
    return phases(i, here, then, goals, omega_m, y.u_dc, memory.bias);
  }

 private:
  using Phases = std::array<T, N>;
  using Some = std::array<bool, N>;

  /// An idle phase with less counts as one without current: it makes 1e-5 of the torque. Of the last
  /// current of the tables [1].
  static constexpr T nothing = T(0.003);

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

  /// Magnetics of the phases that are taken.
  struct Joint {
    Phases psi{}, alone{};  // flux linkage, and that without the neighbours [Wb]
    Phases tau{};           // [N m]
    Phases psi_theta{};     // [Wb/rad]
    Square<T, N> L{};       // [H]
  };

  [[gnu::noinline]] Joint joint(const Some& taken, const Some& starts, const Phases& i,
                                const Angles& at) const {
    Joint m;
    for (int k = 0; k < N; ++k) {
      if (!taken[k]) continue;
      const Magnetics<T> own = machine.map.at(i[k], at.of[k]);
      m.psi[k] = m.alone[k] = own.psi;
      m.tau[k] = own.tau;
      m.psi_theta[k] = own.psi_theta;
      m.L[k][k] = own.L_inc;
    }
    const Coupling<T>& pairs = machine.pairs;
    for (int n = 0; n < pairs.n_pairs(); ++n) {
      const int k = pairs.first[n], l = pairs.second[n];
      if (!taken[k] || !taken[l]) continue;
      const PairMagnetics<T> both = pairs.at(n, i[k], i[l], at.theta_e);
      const T turn = at.mirrored ? T(-1) : T(1);
      const T share = starts[k] == starts[l] ? T(0.5) : starts[k] ? T(1) : T(0);
      m.psi[k] = m.psi[k] + both.psi_first;
      m.psi[l] = m.psi[l] + both.psi_second;
      m.tau[k] = m.tau[k] + turn * share * both.tau;
      m.tau[l] = m.tau[l] + turn * (T(1) - share) * both.tau;
      m.psi_theta[k] = m.psi_theta[k] + turn * both.psi_theta_first;
      m.psi_theta[l] = m.psi_theta[l] + turn * both.psi_theta_second;
      m.L[k][k] = m.L[k][k] + both.L_first;
      m.L[l][l] = m.L[l][l] + both.L_second;
      m.L[k][l] = m.L[l][k] = both.L_mutual;
    }
    return m;
  }

  /// The state after the sample under way, and its currents in i: a step along the straight lines of
  /// the flux linkages, and one of Newton's method. On the way the error of the last such prediction
  /// corrects the bias (prediction.hpp).
  [[gnu::noinline]] Joint carry(Phases& i, const Some& taken, const Phases& magnetized,
                                const Angles& measured, const Angles& end, T omega_m, T u_dc,
                                Memory<T, N>& memory) const {
    const Joint here = joint(taken, {}, i, measured);
    Phases missed{}, rises{}, driven{};
    Some flows{};
    for (int k = 0; k < N; ++k) {
      if (i[k] > T(0) && memory.i_expected[k] > T(0)) missed[k] = i[k] - memory.i_expected[k];
    }
    for (int k = 0; k < N; ++k) {
      flows[k] = i[k] > T(0) || magnetized[k] > T(0);  // else the diodes block
      T& bias = memory.bias[k];
      if (!flows[k]) {
        bias = T(0);
        continue;
      }
      T flux = T(0);
      for (int l = 0; l < N; ++l) flux = flux + here.L[k][l] * missed[l];
      bias = clamp(bias + flux / T_s / T(8), -u_dc / T(10), u_dc / T(10));
      rises[k] = magnetized[k] + bias * T_s - R * T_s * i[k] - omega_m * T_s * here.psi_theta[k];
      driven[k] = here.psi[k] + magnetized[k] + bias * T_s;
    }
    const Phases first = solved<T, N>(flows, here.L, rises);
    Phases i_end;
    for (int k = 0; k < N; ++k) i_end[k] = max(i[k] + first[k], T(0));
    Joint m = joint(taken, {}, i_end, end);
    Phases lacks{};
    for (int k = 0; k < N; ++k) {
      lacks[k] = driven[k] - R * T_s * (i[k] + i_end[k]) / T(2) - m.psi[k];
      flows[k] = flows[k] && (i_end[k] > T(0) || lacks[k] > T(0));
    }
    const Phases second = solved<T, N>(flows, m.L, lacks);
    for (int k = 0; k < N; ++k) {
      const T i_new = max(i_end[k] + second[k], T(0)), d = i_new - i_end[k];
      for (int l = 0; l < N; ++l) m.psi[l] = m.psi[l] + m.L[l][k] * d;
      m.alone[k] = m.alone[k] + m.L[k][k] * d;
      m.tau[k] = m.tau[k] + m.psi_theta[k] * d;
      i[k] = i_new;
    }
    memory.i_expected = i;
    return m;
  }

  std::array<PhasePrediction<T>, N> phases(const Phases& i, const Joint& here, const Angles& then,
                                           const Goals& goals, T omega_m, T u_dc,
                                           const Phases& bias) const {
    std::array<PhasePrediction<T>, N> x{};
    Some taken, starts, flows;
    bool any_starts = false;
    for (int k = 0; k < N; ++k) {
      x[k].idle = goals.idle[k];
      flows[k] = i[k] > T(0);
      starts[k] = !flows[k] && !goals.idle[k];
      taken[k] = flows[k] || starts[k];
      any_starts = any_starts || starts[k];
    }
    // A phase that starts takes all of the voltage; one far from the guide, too.
    const T most = u_dc * ahead;
    Phases move{}, moved{}, still{};
    for (int k = 0; k < N; ++k) {
      if (!taken[k]) continue;
      const T back = goals.next[k] - here.psi[k];
      move[k] = max(goals.next[k] - goals.now[k], -here.alone[k]);
      if (abs(back) > most) move[k] = back > T(0) ? most : -most;
      if (starts[k]) move[k] = most;
      moved[k] = move[k] - omega_m * here.psi_theta[k] * ahead;
    }
    if (any_starts) {
      const Phases rise = solved<T, N>(flows, here.L, moved);
      for (int k = 0; k < N; ++k) {
        if (!starts[k]) continue;
        for (int l = 0; l < N; ++l) {
          if (flows[l]) still[k] = still[k] + here.L[k][l] * rise[l];
        }
        still[k] = still[k] / ahead + omega_m * here.psi_theta[k];
      }
    }
    Phases i_next = solved<T, N>(taken, here.L, moved);
    for (int k = 0; k < N; ++k) i_next[k] = max(i[k] + i_next[k], T(0));
    const Joint next = joint(taken, starts, i_next, then);
    const Phases gain = solved<T, N>(taken, here.L, here.psi_theta);
    const Phases gain_next = solved<T, N>(taken, next.L, next.psi_theta);
    for (int k = 0; k < N; ++k) {
      if (!taken[k]) continue;
      PhasePrediction<T>& p = x[k];
      const T tau_next = next.tau[k] + gain_next[k] * (here.psi[k] + move[k] - next.psi[k]);
      const T L_inverse = T(1) / here.L[k][k];
      p.psi = flows[k] ? here.alone[k] : T(0);
      p.i = i[k];
      p.tau = here.tau[k];
      p.gain = (gain[k] + gain_next[k]) / T(2);
      p.drift = (tau_next - here.tau[k] - p.gain * move[k]) / ahead + p.gain * still[k];
      p.goal = goals.now[k] - (here.psi[k] - p.psi);
      p.goal_rate = (goals.next[k] - goals.now[k]) / ahead - still[k];
      p.i_gain = L_inverse;
      p.i_drift = -omega_m * here.psi_theta[k] * L_inverse;
      p.bias = bias[k] - still[k];
    }
    return x;
  }
};

}  // namespace srm
