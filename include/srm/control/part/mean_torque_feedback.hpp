// Feedback of the mean torque: scales what a law asks of its phases until the mean of the estimated
// torque equals the reference.
//
// Where the voltage no longer follows the references, at high speed, the mean is off by what was
// missed, and a table made offline predicts only a part of it. The machine model knows what torque
// the measured currents give. Its error is smoothed and integrated over the angle, not over time,
//
//   d miss/d theta_e = (1 - given/tau_ref - miss)/smooth
//   d part/d theta_e = gain miss,     asked = tau_ref (1 + part),
//
// so that ripple, which repeats with the angle, averages out at every speed, and at standstill
// nothing winds up. A miss below half a percent is left alone: samples of a current that chops say
// no more, and where the voltage suffices the law is as it is without feedback. While the reference
// moves nothing is integrated: the torque follows a step within about two radians, and what it
// lacks until then is no error of the mean. Motoring and braking have a part each.
//
// Tuned numbers, and what they decide: docs/control/tuned_constants.md.
#pragma once

#include <array>

#include "srm/base/angle.hpp"

namespace srm {

/// What a law remembers; all zeros after reset.
template <Real T>
struct MeanTorqueFeedback {
  static constexpr T gain = T(0.1);        // [1/rad]: an error decays by half in a period
  static constexpr T smooth = T(3);        // half a period: more than a stroke [rad]
  static constexpr T dead = T(0.005);      // a miss that is left alone [1]
  static constexpr T part_min = T(-0.95);  // some torque is always asked for
  static constexpr T moves = T(0.1);  // off its mean over the last radian: the reference moves [1]

  std::array<T, 2> part{};  // asked over tau_ref, less one: motoring, braking [1]
  T miss{};                 // of the mean, smoothed [1]
  T tau_before{};           // the reference, signed by the motion, smoothed over a radian [N m]

  /// The torque to ask for. given: by the measured currents [N m], in the frame of positive torque;
  /// turn: electrical angle since the last sample [rad]; most: what the law can ask for [N m].
  constexpr T asked(T tau, T given, T turn, bool braking, T most, T alone = dead) {
    const T angle = abs(turn);
    const T moving = braking ? -tau : tau;
    tau_before = tau_before + min(angle, T(1)) * (moving - tau_before);
    if (!(tau > T(0))) return T(0);
    T& own = part[braking ? 1 : 0];
    if (abs(moving - tau_before) < moves * tau) {
      const T error = T(1) - given / tau;
      miss = clamp(miss + min(angle / smooth, T(1)) * (error - miss), T(-2), T(2));
      const T much = miss - clamp(miss, -alone, alone);
      own = clamp(own + gain * angle * much, part_min, max(most / tau - T(1), T(0)));
    }
    return tau * (T(1) + own);
  }
};

}  // namespace srm
