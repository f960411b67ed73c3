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
// docs/control/paper_mpc.md has the reasons in full.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/frame/interface.hpp"
#include "srm/control/part/guide.hpp"
#include "srm/control/part/incremental_mpc.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

template <Machine M, int N, int Np_max, int Nc_max>
struct PaperMpc {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  using Mpc = IncrementalMpc<T, N, Np_max, Nc_max>;
  static constexpr int n_phases = N;

  M machine;
  Guide<T> guide;  // phase current over torque reference, electrical angle and speed [A]
  int N_p;         // prediction horizon, 1..Np_max
  int N_c;         // control horizon, 1..min(N_p, Nc_max)
  T r_w;           // weight of the moves
  T w_i;           // weight of the distance to the guide, against torque error squared
  T R;             // phase resistance [ohm]
  T i_max;         // current limit [A]
  T i_band;        // half width of the regulator's band [A]
  T T_s;           // control period [s]
  T delay;         // samples from measurement to effect
  SRM_FIELDS(machine, guide, N_p, N_c, r_w, w_i, R, i_max, i_band, T_s, delay)

  struct State {
    std::array<T, N> u{};  // last references [A]
  };

  Command<T, N> step(State& state, const Measurement<T, N>& y, T tau_ref) const {
    // A negative torque is the positive one of the mirrored machine.
    const T sense = tau_ref < T(0) ? T(-1) : T(1);
    const T demand = sense * tau_ref;
    const Profile<T> profile = guide.at(demand, y.omega_m, y.u_dc);
    const T turn = static_cast<T>(machine.N_r) * y.omega_m * T_s;  // electrical, per sample

    std::array<T, N> here;          // present current, as the regulator holds it
    std::array<T, N> lower, upper;  // what the dc link can make of it in one sample
    typename Mpc::Gains c, target;  // target: the guide along the horizon
    typename Mpc::Outputs error;
    for (int j = 0; j < N_p; ++j) error[j] = demand;

    for (int k = 0; k < N; ++k) {
      const T theta_k = phase_angle<N>(y.theta_e, k);
      const auto angle = [&](T samples) { return wrap(sense * (theta_k + turn * samples)); };
      // Mid-sample angles: there the mean torque of a sample is.
      const auto middle = [&](int j) { return angle(delay + static_cast<T>(j) + T(0.5)); };

      // Within reach of the regulator (twice its band, where it applies full voltage) the current
      // is as good as at its reference; outside, the prediction starts from what was reached.
      here[k] = max(clamp(state.u[k], y.i[k] - T(2) * i_band, y.i[k] + T(2) * i_band), T(0));

      T most = here[k];
      for (int j = 0; j < N_p; ++j) {
        target[j][k] = profile.at(middle(j));
        most = max(most, target[j][k]);
      }
      if (most == T(0)) {  // an idle phase that nobody asks for
        lower[k] = upper[k] = T(0);
        for (int j = 0; j < N_p; ++j) c[j][k] = T(0);
        continue;
      }

      // What a sample of full voltage makes of the flux linkage, as a current at its end. A secant
      // towards the guide serves upwards, where saturation makes the present slope too careful.
      const T goal = max(target[0][k], here[k] + i_band);
      const T psi = machine.at(here[k], angle(delay)).psi;
      const T drop = R * here[k];
      const Magnetics<T> from = machine.at(here[k], angle(delay + T(1)));
      const Magnetics<T> to = machine.at(goal, angle(delay + T(1)));
      const T L_rise = (to.psi - from.psi) / (goal - here[k]);
      upper[k] = here[k] + (psi + T_s * (y.u_dc - drop) - from.psi) / L_rise;
      lower[k] = here[k] + (psi - T_s * (y.u_dc + drop) - from.psi) / from.L_inc;

      for (int j = 0; j < N_p; ++j) {
        const T samples = static_cast<T>(j + 1);
        const T i = clamp(target[j][k], max(here[k] + samples * (lower[k] - here[k]), T(0)),
                          here[k] + samples * (upper[k] - here[k]));
        const Magnetics<T> m = machine.at(i, middle(j));
        c[j][k] = m.psi_theta;
        error[j] = error[j] - (m.tau + m.psi_theta * (here[k] - i));
      }
    }

    const Mpc mpc{N_p, N_c, r_w, T(0), T(1)};  // the regulator: a = 0, b = 1
    BoxQp<T, Mpc::n_max> qp = mpc.problem(c, error);
    std::array<T, Mpc::n_max> start{};
    for (int m = 0; m < N_c; ++m) {
      const T samples = static_cast<T>(m + 1);
      for (int k = 0; k < N; ++k) {
        const int v = m * N + k;
        start[v] = target[m][k] - here[k];
        qp.H[v][v] = qp.H[v][v] + w_i;
        qp.f[v] = qp.f[v] - w_i * start[v];
        qp.hi[v] = clamp(samples * (upper[k] - here[k]), -here[k], i_max - here[k]);
        qp.lo[v] = clamp(samples * (lower[k] - here[k]), -here[k], qp.hi[v]);
      }
    }
    const auto best = solve(qp, start);

    Command<T, N> command;
    for (int k = 0; k < N; ++k) {
      state.u[k] = here[k] + best.x[k];
      const T least = i_band / T(4);  // a smaller reference is off
      command[k] = regulate(state.u[k] > least ? state.u[k] : T(0), i_band);
    }
    return command;
  }
};

}  // namespace srm
