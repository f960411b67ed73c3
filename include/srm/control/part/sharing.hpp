// Torque sharing functions: which part of the torque each phase gives at an angle.
//
// A rise F from 0 to 1 over the overlap, started at theta_on and again, for the next phase, one
// stroke later:  share(theta) = F(theta - theta_on) - F(theta - theta_on - 2 pi/N).  Summed over
// the phases every F meets its own negative, so the shares sum to one for every F and every N,
// however many phases overlap.
//
// M. Ilic-Spong, T. J. E. Miller, S. R. MacMinn, J. S. Thorp, "Instantaneous torque control of
// electric motor drives", IEEE Trans. Power Electron. 2(1), 1987 (exponential); I. Husain, M.
// Ehsani, "Torque ripple minimization in switched reluctance motor drives by PWM current control",
// IEEE Trans. Power Electron. 11(1), 1996 (sinusoidal); X. D. Xue, K. W. E. Cheng, S. L. Ho,
// "Optimization and evaluation of torque-sharing functions for torque ripple minimization in
// switched reluctance motor drives", IEEE Trans. Power Electron. 24(9), 2009.
#pragma once

#include <array>

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"
#include "srm/base/interpolate.hpp"

namespace srm {

enum class Shape : std::int8_t { linear, cubic, sinusoidal, exponential, table };

/// sin z for |z| <= pi/2: Taylor to z^11, error below 6e-8.
template <Real T>
constexpr T sine(T z) {
  const T q = z * z;
  T sum = T(-1.0 / 39916800);
  sum = sum * q + T(1.0 / 362880);
  sum = sum * q - T(1.0 / 5040);
  sum = sum * q + T(1.0 / 120);
  sum = sum * q - T(1.0 / 6);
  return (sum * q + T(1)) * z;
}

/// sin^2(pi x/2) = (1 + sin(pi (x - 1/2)))/2, scaled to run from 0 to 1 without the error of
/// `sine`.
template <Real T>
constexpr T sinusoidal_rise(T x) {
  constexpr T scale = T(0.5) / sine(pi<T> / T(2));
  return T(0.5) + scale * sine(pi<T> * (x - T(0.5)));
}

/// 1 - e^(-5 x^2), scaled to end at 1: the published form stops 0.7 % short and then jumps.
template <Real T>
constexpr T exponential_rise(T x) {
  constexpr T scale = T(1) / (T(1) - exp(T(-5)));
  return (T(1) - exp(T(-5) * x * x)) * scale;
}

template <Real T>
struct Sharing {
  Shape shape;
  T theta_on;                 // where a phase starts [rad]
  T theta_ov;                 // overlap: the angle over which its share rises to one [rad]
  std::array<T, 33> table{};  // Shape::table: F at 0, 1/32, ... 1; starts at 0 and ends at 1
  SRM_FIELDS(shape, theta_on, theta_ov, table)

  /// Every phase with a share can give torque: it starts after 0 and ends before pi. No other
  /// parameters are to reach a law.
  template <int N>
  constexpr bool is_feasible() const {
    return theta_on >= T(0) && theta_ov > T(0) && theta_on + two_pi<T> / T(N) + theta_ov <= pi<T>;
  }

  /// Share of the phase at theta_e in [0, 2 pi).
  template <int N>
  constexpr T share(T theta_e) const {
    const T past_on = wrap(theta_e - theta_on);
    return rise(past_on) - rise(past_on - two_pi<T> / T(N));
  }

  /// F: 0 before the overlap, 1 after it.
  constexpr T rise(T past_on) const {
    if (past_on >= theta_ov) return T(1);
    if (!(past_on > T(0))) return T(0);
    const T x = past_on / theta_ov;
    switch (shape) {
      case Shape::linear:
        return x;
      case Shape::cubic:
        return x * x * (T(3) - T(2) * x);
      case Shape::sinusoidal:
        return sinusoidal_rise(x);
      case Shape::exponential:
        return exponential_rise(x);
      case Shape::table:
        return interpolate(table, x);
    }
    return x;
  }
};

}  // namespace srm
