// Electrical angles: 0 unaligned, pi aligned, torque positive on (0, pi).
#pragma once

#include "srm/base/real.hpp"

namespace srm {

/// theta brought into [0, 2 pi). Rounding can land on either edge; both are caught here.
/// Angles past 1e6 rad, and NaN, give 0: a wrong angle must not become a wild table index.
template <Real T>
constexpr T wrap(T theta) {
  if (theta >= T(0) && theta < two_pi<T>) return theta;
  if (!(abs(theta) < T(1e6))) return T(0);
  T turn = theta - floor(theta / two_pi<T>) * two_pi<T>;
  if (turn < T(0)) turn = turn + two_pi<T>;
  if (turn >= two_pi<T>) turn = turn - two_pi<T>;
  return turn < T(0) ? T(0) : turn;
}

/// Electrical angle of phase k of N, given that of phase 0 in [0, 2 pi): phase k lags by k strokes.
template <int N, Real T>
constexpr T phase_angle_in_turn(T theta_e, int k) {
  const T theta = theta_e - static_cast<T>(k) * (two_pi<T> / static_cast<T>(N));
  if (!(theta < T(0))) return theta;
  const T turned = theta + two_pi<T>;
  return turned < two_pi<T> ? turned : T(0);
}

/// The same of any angle.
template <int N, Real T>
constexpr T phase_angle(T theta_e, int k) {
  const T theta = theta_e - static_cast<T>(k) * (two_pi<T> / static_cast<T>(N));
  if (theta < T(0) && theta >= -two_pi<T>) {  // the same as `wrap` does, without its division
    const T turned = theta + two_pi<T>;
    return turned < two_pi<T> ? turned : T(0);
  }
  return wrap(theta);
}

/// True while theta_on <= theta_e < theta_off. Safe across the 2 pi wrap and for theta_on < 0.
template <Real T>
constexpr bool conducts(T theta_e, T theta_on, T theta_off) {
  return wrap(theta_e - theta_on) < wrap(theta_off - theta_on);
}

}  // namespace srm
