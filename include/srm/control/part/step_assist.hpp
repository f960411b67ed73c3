// A step of the torque reference: all of the voltage, and phases that help.
//
// After a step, deviations from the reference profile cost nothing, and a phase whose profile has
// not begun can help too: it is magnetized if the rotor takes it past the unaligned position before
// the phase in charge has the flux that the torque needs. Its own flux stays below what the profile
// has early in the stroke, where the torque over the flux is greatest; with more, a small step
// would overshoot.
//
// The step ends where the torque is there, or after a stroke: what the voltage does not give by
// then is given by no phase that waits, and would cost current for ever.
//
// Tuned numbers, and what they decide: docs/control/tuned_constants.md.
#pragma once

#include "srm/control/part/conduction.hpp"
#include "srm/control/part/mirror.hpp"
#include "srm/control/part/prediction.hpp"

namespace srm {

/// What a law remembers of the last step of its reference.
template <Real T>
struct TorqueStep {
  /// A change of the reference by more than this is a step, which ends where less is lacking [1].
  static constexpr T lacks = T(0.05);

  T reference{};         // of the last sample [N m]
  T left{};              // angle to the end of the stroke after the step [rad]
  bool reached = false;  // since the step

  /// turn: of a sample; stroke: electrical [rad].
  void next(T tau_ref, T turn, T stroke) {
    const bool steps = abs(tau_ref - reference) > lacks * abs(tau_ref);
    reference = tau_ref;
    reached = reached && !steps;
    left = steps ? stroke : max(left - turn, T(0));
  }

  bool lasts() const { return left > T(0) && !reached; }
};

template <Machine M, int N>
struct StepAssist {
  using T = typename M::Scalar;
  /// Flux at the end of a step, over that of the profile in the middle of the stroke [1].
  static constexpr T end_flux = T(1.2);

  T i_max;  // current limit [A]
  T T_s;    // control period [s]
  int delay;

  /// Magnetizes the idle phases that can give torque at the end of a step, up to the flux linkage
  /// of the profile early in its stroke. turn: of a sample [rad].
  [[gnu::noinline, gnu::cold]] void magnetize_ahead(const Measurement<T, N>& y, T tau_ref,
                                                    const std::array<PhasePrediction<T>, N>& phases,
                                                    const Profile<T>& profile, T turn,
                                                    Command<T, N>& command) const {
    const T early = profile.at(pi<T> / T(6)) - y.u_dc * T_s;
    T built = T(0);
    for (const PhasePrediction<T>& p : phases) built = p.gain > T(0) ? max(built, p.psi) : built;
    const T left = end_flux * profile.at(pi<T> / T(2)) - built;
    const T lead = clamp(turn / T_s * left / y.u_dc, T(0), pi<T> / T(2));
    for (int k = 0; k < N; ++k) {
      const PhasePrediction<T>& p = phases[k];
      const T theta = drive_angle<N>(y.theta_e, k, tau_ref) + turn * static_cast<T>(delay);
      if (!p.idle || !(wrap(theta + lead) < lead + pi<T> / T(2))) continue;
      command[k] = hold<T>(p.i < i_max && p.psi < early ? Leg::magnetize : Leg::freewheel);
    }
  }
};

}  // namespace srm
