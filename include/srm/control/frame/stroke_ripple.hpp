// Adaptive notch filter at the stroke frequency: takes the ripple of the dc link out of its
// measured voltage.
//
// The ripple repeats with the strokes. A voltage controller that sees it passes it on to the torque
// reference, in step with the phase currents. The filter fits the first harmonic of the stroke to
// the voltage error, by steepest descent, and takes it away. The loop sees a notch of damping zeta,
// and next to nothing of it elsewhere: a mean over whole strokes would delay the loop by half a
// stroke, too long for the unstable side of the maximum power point.
// B. Widrow et al., "Adaptive noise cancelling", Proc. IEEE 63(12), 1975: the notch of a
// synthesised reference.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/base/real.hpp"

namespace srm {

template <Real T>
struct StrokeRipple {
  T learning;  // 2 zeta N N_r T_s: per sample, over the speed [s]
  SRM_FIELDS(learning)

  /// Amplitudes of the two waves in quadrature [V].
  struct State {
    T a{}, b{};
  };

  /// The error of a voltage that was measured, without its ripple [V]; learns from the sample.
  template <int N>
  constexpr T without(State& x, T error, T theta_e, T omega_m) const {
    const T strokes = theta_e * (static_cast<T>(N) / two_pi<T>);
    const T part = strokes - floor(strokes);
    const T p = wave(part), q = wave(part < T(0.75) ? part + T(0.25) : part - T(0.75));
    const T rest = error - (x.a * p + x.b * q);
    const T step = learning * abs(omega_m) * rest;
    x.a = x.a + step * p;
    x.b = x.b + step * q;
    return rest;
  }

 private:
  /// A sine of the part of a period, from 0 to 1, by two parabolas: its third harmonic is 4 %.
  static constexpr T wave(T part) {
    const T y = T(4) * part - T(2);
    return y * (abs(y) - T(2));
  }
};

}  // namespace srm
