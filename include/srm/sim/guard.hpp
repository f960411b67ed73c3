// Events of the plant: a guard is a state variable that meets a value, and its instant is located
// by root finding on the length of the integration step.
#pragma once

#include <cmath>

#include "srm/sim/step.hpp"

namespace srm {

/// The current of phase k, the rotor angle (k = angle) or the dc-link voltage (k = link) meets
/// `value`: from below (direction +1) or from above (-1). Direction 0: no guard.
struct Guard {
  static constexpr int angle = -1;
  static constexpr int link = -3;

  int k = angle;
  double value = 0;
  int direction = 0;
  Leg then = Leg::demagnetize;  // a current guard sets the leg
};

/// What a guard watches, of a state or of its rates.
template <int N>
double watched(const Guard& g, const State<N>& x) {
  if (g.k == Guard::angle) return x.theta_m;
  return g.k == Guard::link ? x.u_dc : x.i[g.k];
}

/// What is left before the guard is met: positive before, zero or negative once it is met.
template <int N>
double distance(const Guard& g, const State<N>& x) {
  return g.direction * (g.value - watched(g, x));
}

/// An angle closer than this to its value counts as met [rad].
inline constexpr double angle_tolerance = 1e-9;

/// From this distance [rad; A, V] one Newton step by the present slopes ends a search. At slopes down
/// to 1e5 A/s that is 1e-8 s; what curvature (1e9 A/s^2) leaves after it is below 1e-7 A.
inline constexpr double near_angle = 1e-5;
inline constexpr double near_current = 1e-3;

/// The part of a step at which a cubic Hermite polynomial falls through zero, from value d0 > 0 and
/// slope to value d1 <= 0 and slope (slopes over the whole step); its error is of order 4.
inline double hermite_root(double d0, double slope0, double d1, double slope1) {
  double x = d0 / (d0 - d1);
  const double c3 = 2 * (d0 - d1) + slope0 + slope1;
  const double c2 = 3 * (d1 - d0) - 2 * slope0 - slope1;
  for (int trial = 0; trial < 3; ++trial) {  // Newton from the secant's root
    x -= (d0 + x * (slope0 + x * (c2 + x * c3))) / (slope0 + x * (2 * c2 + x * 3 * c3));
  }
  return x;
}

/// Shortens the step from `start` of length h, which overshoots the guard, until it ends on it.
/// `end` is replaced by the located point; returns the new length.
///
/// The first guess is the root of the Hermite polynomial, and nearly always close enough for the
/// Newton step; if not, secant steps follow, bisected wherever they would leave the bracket.
template <Machine M, int N>
double locate(const Plant<M, N>& p, const Point<N>& start, const Point<N>& k1,
              const Settled<N>& settled, const Scale& scale, const Guard& g, double h,
              Point<N>& end) {
  const auto fall = [&](const Point<N>& rate) {
    return -g.direction * watched(g, rate.x);
  };
  const double near = g.k == Guard::angle ? near_angle : near_current;
  double d = distance(g, end.x);
  double guess = h * hermite_root(distance(g, start.x), h * fall(k1), d,
                                  h * fall(slope(p, end.x, settled, h)));
  double lower = 0, upper = h, s = h;
  for (int trial = 0; trial < 60; ++trial) {
    const double previous = s, d_previous = d;
    s = guess > lower && guess < upper ? guess : (lower + upper) / 2;
    end = runge_kutta(p, start, k1, settled, scale, s).end;
    d = distance(g, end.x);
    if (std::fabs(d) <= near) break;
    (d > 0 ? lower : upper) = s;
    guess = s - d * (s - previous) / (d - d_previous);
  }
  const Point<N> rate = slope(p, end.x, settled, s);
  const double rest = -d / fall(rate);
  if (!(std::fabs(rest) < h)) return s;  // the guard is met at a standstill: it is close enough
  end = moved(end, rate, rest);
  return s + rest;
}

}  // namespace srm
