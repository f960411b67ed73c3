// Current references that keep the flux linkages on the guide where the voltage is short.
//
// At high speed the guide takes all of the voltage for much of the period. A torque error can then
// no longer be removed within a few samples, and a phase that leaves the guide to do so lacks flux
// for the rest of the period. So each phase follows the flux linkage of the guide on its own, and
// feedback holds the mean torque (mean_torque_feedback.hpp).
//
// A phase that is to be on the guide at the end of the sample needs a mean voltage for it. Where
// that is most of what there is, the reference lies out of reach, so that the regulator applies all
// of the voltage throughout the sample. Elsewhere it is the guide's current in the middle.
//
// Tuned numbers, and what they decide: docs/control/tuned_constants.md.
#pragma once

#include <array>

#include "srm/control/interface/interface.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/mean_torque_feedback.hpp"
#include "srm/control/part/mirror.hpp"
#include "srm/control/part/phase_profile.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

/// What a law remembers of its current references.
template <Real T, int N>
struct FollowedCurrents {
  std::array<T, N> i_ref{};     // of the last sample [A]
  std::array<T, N> i_before{};  // currents a sample ago [A]
  MeanTorqueFeedback<T> mean{};
};

template <Machine M, int N>
struct GuideCurrents {
  using T = typename M::Scalar;

  /// Of the dc-link voltage: who needs more takes all of it [1].
  static constexpr T most = T(0.7);
  /// The mean current of a sample lies so far on the way from its begin to its end, by the machines
  /// of studies/quadrants.py. It makes 1 % of the mean torque at 90 samples a period [1].
  static constexpr T way = T(0.6);

  M machine;
  T R;      // phase resistance [ohm]
  T i_max;  // current limit [A]
  T T_s;    // control period [s]
  T delay;  // samples from measurement to effect

  /// References for the torque that feedback asks for.
  [[gnu::noinline]] void follow(FollowedCurrents<T, N>& x, const ReferenceProfile<T>& guide,
                                const Measurement<T, N>& y, T tau_ref) const {
    const T sense = tau_ref < T(0) ? T(-1) : T(1);
    const T turn = sense * (static_cast<T>(machine.N_r) * y.omega_m * T_s);  // in a sample
    std::array<T, N> psi;
    T given = T(0);
    for (int k = 0; k < N; ++k) {
      const T theta = drive_angle<N>(y.theta_e, k, tau_ref);
      const T i = max(y.i[k], T(0));
      const Magnetics<T> now = at(i, theta);
      psi[k] = now.psi;
      given = given + torque(x.i_ref[k], x.i_before[k], i, now.tau, theta, turn);
      x.i_before[k] = i;
    }
    if constexpr (has_pairs<M>) given = given + pair_torque(machine, y, tau_ref);
    const T asked = x.mean.asked(abs(tau_ref), given, turn, brakes(y.omega_m, tau_ref),
                                 guide.first.level_max, dead);
    const Profile<T> profile = guide.at(asked, y.omega_m, y.u_dc);
    for (int k = 0; k < N; ++k) {
      const T theta = drive_angle<N>(y.theta_e, k, tau_ref);
      const auto& own = phase_profile<M>(profile, k, tau_ref);
      x.i_ref[k] = reference(own, x.i_ref[k], x.i_before[k], psi[k], theta, turn, y.u_dc);
    }
  }

 private:
  static constexpr T dead = T(0.002);  // a miss of the mean that is left alone [1]

  /// The reference of a phase, from the one before [A]. i, psi: now; theta: its angle now, in the
  /// frame of positive torque; turn: what it turns in a sample [rad].
  T reference(const Profile<T>& guide, T before, T i, T psi, T theta, T turn, T u_dc) const {
    const T begin = wrap(theta + turn * delay), end = wrap(theta + turn * (delay + T(1)));
    if (delay > T(0)) {  // through the sample under way: to its reference, as far as it can go
      const T coasting = psi - T_s * R * i;
      psi = clamp(at(before, begin).psi, max(coasting - T_s * u_dc, T(0)),
                  max(coasting + T_s * u_dc, T(0)));
    }
    T rise = at(guide.at(end), end).psi - psi;
    if constexpr (has_pairs<M>) rise = rise + guide.mutual_at(end) - guide.mutual_at(begin);
    const T needed = rise / T_s + R * i;
    if (needed > most * u_dc) return i_max;
    if (needed < -most * u_dc) return T(0);
    return min(guide.at(wrap(theta + turn * (delay + T(0.5)))), i_max);
  }

  /// Mean torque of a phase over the sample that ends now, in the frame of positive torque [N m].
  /// tau: now. A regulated current arrives before the sample ends; under all of the voltage the
  /// torque is nearly linear in time.
  T torque(T reference, T i_before, T i, T tau, T theta, T turn) const {
    if (reference > T(0) && reference < i_max) {
      return at(i_before + way * (i - i_before), wrap(theta - turn / T(2))).tau;
    }
    return (tau + at(i_before, wrap(theta - turn)).tau) / T(2);
  }

  /// No current, no flux linkage and no torque.
  [[gnu::noinline]] Magnetics<T> at(T i, T theta) const {
    return i > T(0) ? machine.at(i, theta) : Magnetics<T>{};
  }
};

}  // namespace srm
