// The source paper's controller, mended: torque reference -> predictive controller -> phase current
// references -> hysteresis current regulator (its Fig. 3).
//
// Inputs u are the current references, the channel is the regulated phase current. Within a sample
// the regulator brings the current to its reference (a = 0, b = 1) unless the dc link cannot: that
// is a bound on u, from the flux linkage that u_dc can add or remove. The output is the torque,
// linearised anew at each sample: C_m = dtau/di = dpsi/dtheta.
//
// Around which currents? At i = 0 the torque has no slope, and around the present currents no
// linear model would ever start a phase. Nor does a horizon of a few samples see that flux must be
// built up before the poles overlap. Both are answered by a guide: the least-copper profile of
// zero torque ripple at this dc-link voltage, computed offline and stored over torque and angle.
// The prediction is linearised along the currents that lead from here to the guide as fast as the
// dc link allows, and among equal torques the guide's currents are preferred (weight w_i). So the
// guide decides turn-on and turn-off, and the torque error is what the optimiser removes.
//
// At high speed the guide takes all of the voltage, and the optimiser has nothing to choose. There
// the references keep the flux linkages on the guide (guide_currents.hpp).
//
// Where phases couple, each phase has its own guide, and the output has the torque of the pairs,
// linearised around the same currents.
// docs/control/paper_mpc.md has the reasons in full.
#pragma once

#include <type_traits>

#include "srm/base/fields.hpp"
#include "srm/control/interface/interface.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/guide_currents.hpp"
#include "srm/control/part/level_programme.hpp"
#include "srm/control/part/per_phase.hpp"
#include "srm/control/part/phase_profile.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

template <Machine M, int N, int Np_max, int Nc_max>
struct PaperMpc {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  static constexpr int n_phases = N;
  static constexpr int guesses = 5;  // of the bounds that act

  M machine;
  ReferenceProfile<T> guide;  // phase current over torque reference, electrical angle and speed [A]
  int N_p;                    // prediction horizon, 1..Np_max
  int N_c;                    // control horizon, 1..min(N_p, Nc_max)
  T r_w;                      // weight of the moves
  T w_i;                      // weight of the distance to the guide, against torque error squared
  T R;                        // phase resistance [ohm]
  T i_max;                    // current limit [A]
  T i_band;                   // half width of the regulator's band [A]
  T T_s;                      // control period [s]
  T delay;                    // samples from measurement to effect
  T short_from;               // speed over voltage from which the voltage is short [rad/(s V)]
  SRM_FIELDS(machine, guide, N_p, N_c, r_w, w_i, R, i_max, i_band, T_s, delay, short_from)

  struct State : FollowedCurrents<T, N> {
    std::array<std::array<std::int8_t, Nc_max>, N> side{};  // bounds that acted last
  };

  Command<T, N> step(State& state, const Measurement<T, N>& y, T tau_ref) const {
    // A negative torque is the positive one of the mirrored machine.
    const T sense = tau_ref < T(0) ? T(-1) : T(1);
    const T turn = sense * (static_cast<T>(machine.N_r) * y.omega_m * T_s);  // per sample
    if (abs(y.omega_m) > short_from * y.u_dc) {
      GuideCurrents<M, N>{machine, R, i_max, T_s, delay}.follow(state, guide, y, tau_ref);
    } else {
      plan(state, y, sense * tau_ref, sense, turn);
    }

    // Braking, the EMF raises the current of a phase that freewheels.
    const Leg chop = turn < T(0) ? Leg::demagnetize : Leg::freewheel;
    const T least = i_band / T(4);  // a smaller reference is off
    return per_phase<T, N>([&](int k) {
      return regulate(state.i_ref[k] > least ? state.i_ref[k] : T(0), i_band, chop);
    });
  }

 private:
  /// A phase in the samples to come, and what the dc link makes of its current in one.
  struct Ahead {
    std::array<T, Np_max> middle;  // angle of a sample, where its mean torque is
    std::array<T, Np_max> target;  // the guide there
    T here;                        // its current [A]
    T L_rise, L_fall;              // inductances towards the guide and at this current [H]
    T coasting;                    // change of flux linkage without a voltage, at this current [Wb]

    T rise(T full) const { return (coasting + full) / L_rise; }
    T fall(T full) const { return (coasting - full) / L_fall; }
    T to_target(T full) const { return clamp(target[0] - here, fall(full), rise(full)); }
    /// Pairs have an inductance, which saturates as the phase's own, and change its flux linkage.
    void add(T L, T psi) {
      L_rise = L_rise * (T(1) + L / L_fall);
      L_fall = L_fall + L;
      coasting = coasting - psi;
    }
  };

  /// References that remove the torque error; for the horizons of most drives the loops are written
  /// out.
  void plan(State& state, const Measurement<T, N>& y, T demand, T sense, T turn) const {
    using std::integral_constant;
    if (N_p == Np_max && N_c == Nc_max) {
      return plan(state, y, demand, sense, turn, integral_constant<int, Np_max>{},
                  integral_constant<int, Nc_max>{});
    }
    if constexpr (Np_max > 3 && Nc_max > 2) {
      if (N_p == 3 && N_c == 2) {
        return plan(state, y, demand, sense, turn, integral_constant<int, 3>{},
                    integral_constant<int, 2>{});
      }
    }
    plan(state, y, demand, sense, turn, N_p, N_c);
  }

  template <class Samples, class Moves>
  void plan(State& state, const Measurement<T, N>& y, T demand, T sense, T turn, Samples n_samples,
            Moves n_moves) const {
    const Profile<T> profile = guide.at(demand, y.omega_m, y.u_dc);

    // Of the phases that may carry current; an idle one that nobody asks for is left out.
    LevelProgramme<T, N, Np_max, Nc_max, Samples, Moves> programme;
    programme.N_p = n_samples;
    programme.N_c = n_moves;
    programme.r_w = r_w;
    programme.w_i = w_i;
    std::array<int, N> phase;
    std::array<Ahead, has_pairs<M> ? N : 1> ahead;  // of the channels; of one after the other
    [[maybe_unused]] std::array<std::array<T, Np_max>, N> along;  // currents of the channels [A]
    std::array<T, Np_max> error;
    for (int j = 0; j < n_samples; ++j) error[j] = demand;
    const T to_begin = turn * delay, to_end = turn * (delay + T(1));
    std::array<T, Np_max> to_middle;  // of the samples
    for (int j = 0; j < n_samples; ++j) {
      to_middle[j] = turn * (delay + static_cast<T>(j) + T(0.5));
    }

    const T full = T_s * y.u_dc;  // flux linkage that a sample of full voltage adds [Wb]
    const auto place = [&](int c, const Ahead& x) {
      auto& channel = programme.channels[c];
      const T here = x.here, rise = x.rise(full), fall = x.fall(full);
      state.i_ref[phase[c]] = here;
      channel.side = state.side[phase[c]];
      for (int j = 0; j < n_samples; ++j) {
        const T samples = static_cast<T>(j + 1);
        const T i = clamp(x.target[j], max(here + samples * fall, T(0)), here + samples * rise);
        const Magnetics<T> m = machine.at(i, x.middle[j]);
        channel.c[j] = m.psi_theta;
        if constexpr (has_pairs<M>) along[c][j] = i;
        error[j] = error[j] - (m.tau + m.psi_theta * (here - i));
        if (j >= n_moves) continue;
        channel.near[j] = x.target[j] - here;
        channel.hi[j] = clamp(samples * rise, -here, i_max - here);
        channel.lo[j] = clamp(samples * fall, -here, channel.hi[j]);
      }
    };

    for (int k = 0; k < N; ++k) {
      const T theta_k = sense * phase_angle<N>(y.theta_e, k);
      Ahead& x = ahead[has_pairs<M> ? programme.n : 0];

      // Within reach of the regulator (twice its band, where it applies full voltage) the current
      // is as good as at its reference; outside, the prediction starts from what was reached.
      const T here =
          max(clamp(state.i_ref[k], y.i[k] - T(2) * i_band, y.i[k] + T(2) * i_band), T(0));

      const auto& own = phase_profile<M>(profile, k, sense);
      T most = here;
      for (int j = 0; j < n_samples; ++j) {
        x.middle[j] = wrap(theta_k + to_middle[j]);
        x.target[j] = own.at(x.middle[j]);
        most = max(most, x.target[j]);
      }
      if (!(most > i_band / T(100))) {
        state.i_ref[k] = T(0);
        state.side[k] = {};
        continue;
      }

      // What a sample of full voltage makes of the flux linkage, as a current at its end. A secant
      // towards the guide serves upwards, where saturation makes the present slope too careful.
      const T theta_end = wrap(theta_k + to_end);
      const T goal = max(x.target[0], here + i_band);
      const T psi = machine.at(here, wrap(theta_k + to_begin)).psi;
      const Magnetics<T> from = machine.at(here, theta_end);
      x.here = here;
      x.L_rise = (machine.at(goal, theta_end).psi - from.psi) / (goal - here);
      x.L_fall = from.L_inc;
      x.coasting = psi - T_s * (R * here) - from.psi;
      phase[programme.n++] = k;
      if constexpr (!has_pairs<M>) place(programme.n - 1, x);
    }
    if constexpr (has_pairs<M>) {
      const auto for_each_pair = [&](const auto& act) {
        for (int n = 0; n < machine.pairs.n_pairs(); ++n) {
          const int a = channel_of(phase, programme.n, machine.pairs.first[n]);
          const int b = channel_of(phase, programme.n, machine.pairs.second[n]);
          if (a >= 0 && b >= 0) act(n, a, b);
        }
      };
      std::array<T, N> L{}, psi{};                         // what pairs add
      const T moved = turn / static_cast<T>(machine.N_r);  // mechanical [rad]
      for_each_pair([&](int n, int a, int b) {
        const PairMagnetics<T> m =
            machine.pairs.at(n, ahead[a].here, ahead[b].here, wrap(y.theta_e + sense * to_end));
        L[a] = L[a] + m.L_first;
        L[b] = L[b] + m.L_second;
        const T to_a = ahead[a].to_target(full), to_b = ahead[b].to_target(full);
        psi[a] = psi[a] + sense * m.psi_theta_first * moved + m.L_mutual * to_b;
        psi[b] = psi[b] + sense * m.psi_theta_second * moved + m.L_mutual * to_a;
      });
      for (int c = 0; c < programme.n; ++c) {
        ahead[c].add(L[c], psi[c]);
        place(c, ahead[c]);
      }
      for_each_pair([&](int n, int a, int b) {
        const T here_a = ahead[a].here, here_b = ahead[b].here;
        for (int j = 0; j < n_samples; ++j) {
          const T i_a = along[a][j], i_b = along[b][j];
          const PairMagnetics<T> m =
              machine.pairs.at(n, i_a, i_b, wrap(y.theta_e + sense * to_middle[j]));
          const T c_a = sense * m.psi_theta_first, c_b = sense * m.psi_theta_second;
          programme.channels[a].c[j] = programme.channels[a].c[j] + c_a;
          programme.channels[b].c[j] = programme.channels[b].c[j] + c_b;
          error[j] = error[j] - (sense * m.tau + c_a * (here_a - i_a) + c_b * (here_b - i_b));
        }
      });
    }
    programme.error = error;
    if (!programme.guess(guesses)) programme.solve_exactly();
    for (int j = 0; j < programme.n; ++j) {
      const int k = phase[j];
      state.i_ref[k] = state.i_ref[k] + programme.channels[j].v[0];
      state.side[k] = programme.channels[j].side;
    }
  }

  /// The channel of a phase, or -1.
  static constexpr int channel_of(const std::array<int, N>& phase, int n, int k) {
    int j = n;
    while (--j >= 0 && phase[j] != k) continue;
    return j;
  }
};

}  // namespace srm
