// Deadbeat flux control: the duty cycle that brings each phase to its reference in one sample.
//
// psi(t + T_s) = psi(t) + T_s (duty u_dc - R i), so duty = ((psi_ref - psi)/T_s + R i)/u_dc, with
// psi_ref the machine's flux at the shared torque and at the angle that the sample ends at. With
// one sample of delay psi is first carried through the sample that is under way, whose duty is
// known.
//
// What pairs of phases add, where the machine has any, is not shared.
//
// Where the voltage does not suffice for the shares (feasible.hpp), psi_ref is that of the
// reference profile, and feedback holds the mean torque.
//
// R. Mikail, I. Husain, Y. Sozer, M. S. Islam, T. Sebastian, "A fixed switching frequency
// predictive current control method for switched reluctance machines", IEEE Trans. Ind. Appl.
// 50(6), 2014; sharing: sharing.hpp.
//
// Tuned numbers, and what they decide: docs/control/tuned_constants.md.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/feasible.hpp"
#include "srm/control/part/mean_torque_feedback.hpp"
#include "srm/control/part/mirror.hpp"
#include "srm/control/part/modulator.hpp"
#include "srm/control/part/per_phase.hpp"
#include "srm/control/part/phase_profile.hpp"
#include "srm/control/part/sharing.hpp"
#include "srm/machine/torque_inverse.hpp"

namespace srm {

template <Machine M, int N>
struct Deadbeat {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  static constexpr int n_phases = N;
  /// A miss of the mean that is left alone: no current chops, so samples say more than elsewhere
  /// [1].
  static constexpr T dead = T(0.001);
  struct State {
    std::array<T, N> duty{};  // ordered in the sample before
    MeanTorqueFeedback<T> mean;
  };

  M machine;
  T R;  // phase resistance [ohm]
  Sharing<T> sharing;
  Feasible<T> feasible;
  ReferenceProfile<T> guide;  // flux linkage where the shares are not feasible [Wb]
  T i_max;                    // [A]
  T T_s;                      // control and carrier period [s]
  int delay = 0;              // samples from measurement to effect: 0 or 1
  Carriers carriers = Carriers::in_phase;
  SRM_FIELDS(machine, R, sharing, feasible, guide, i_max, T_s, delay, carriers)

  Command<T, N> step(State& x, const Measurement<T, N>& y, T tau_ref) const {
    const T omega_e = static_cast<T>(machine.N_r) * y.omega_m;
    const T theta_end = wrap(y.theta_e + omega_e * T_s * static_cast<T>(1 + delay));
    const bool braking = brakes(y.omega_m, tau_ref);
    if (feasible.at(abs(tau_ref), abs(omega_e), y.u_dc, braking)) {
      T shared = abs(tau_ref);
      if constexpr (has_pairs<M>) shared = max(shared - pair_torque(machine, y, tau_ref), T(0));
      for (int k = 0; k < N; ++k) {
        const T theta = drive_angle<N>(theta_end, k, tau_ref);
        const T tau = sharing.template share<N>(theta) * shared;
        const T i_ref = current_for_torque(machine, tau, theta, i_max);
        const T i = max(y.i[k], T(0));
        x.duty[k] = i_ref > T(0) ? duty(now(y, k).psi, x.duty[k], y, k,
                                        machine.at(i_ref, theta).psi, (i + i_ref) / T(2))
                                 : T(-1);
      }
    } else {
      follow(x, y, theta_end, tau_ref);
    }
    return per_phase<T, N>(
        [&](int k) { return modulate(x.duty[k], T_s, pulse_centre<N, T>(carriers, k)); });
  }

 private:
  [[gnu::noinline]] Magnetics<T> now(const Measurement<T, N>& y, int k) const {
    return machine.at(max(y.i[k], T(0)), phase_angle<N>(y.theta_e, k));
  }

  /// The duty cycle to psi_ref. psi: at the measurement; last: the duty cycle before.
  T duty(T psi, T last, const Measurement<T, N>& y, int k, T psi_ref, T i_mean) const {
    const T carried = psi + T_s * (last * y.u_dc - R * max(y.i[k], T(0)));
    const T begin = delay > 0 ? max(carried, T(0)) : psi;
    const T u = (psi_ref - begin) / T_s + R * i_mean;
    return clamp(u / y.u_dc, T(-1), T(1));
  }

  /// Duty cycles to the flux linkages of the reference profile.
  [[gnu::noinline]] void follow(State& x, const Measurement<T, N>& y, T theta_end,
                                T tau_ref) const {
    std::array<T, N> psi;
    T given = T(0);
    for (int k = 0; k < N; ++k) {
      const Magnetics<T> m = now(y, k);
      psi[k] = m.psi;
      given = given + m.tau;
    }
    if (tau_ref < T(0)) given = -given;
    if constexpr (has_pairs<M>) given = given + pair_torque(machine, y, tau_ref);
    const T turn = static_cast<T>(machine.N_r) * y.omega_m * T_s;
    const T asked = x.mean.asked(abs(tau_ref), given, turn, brakes(y.omega_m, tau_ref),
                                 guide.first.level_max, dead);
    const Profile<T> profile = guide.at(asked, y.omega_m, y.u_dc);
    for (int k = 0; k < N; ++k) {
      const T psi_ref = followed_flux<M>(phase_profile<M>(profile, k, tau_ref),
                                         drive_angle<N>(y.theta_e, k, tau_ref),
                                         drive_angle<N>(theta_end, k, tau_ref));
      x.duty[k] = psi_ref > T(0) ? duty(psi[k], x.duty[k], y, k, psi_ref, y.i[k]) : T(-1);
    }
  }
};

}  // namespace srm
