// Events of the plant: a guard is a state variable that meets a value, and its instant is located
// by root finding on the length of the integration step.
#pragma once

#include <cmath>
#include <limits>

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

/// How fast the distance changes, from the rates of a point.
template <int N>
double approach(const Guard& g, const Point<N>& rate) {
  return -g.direction * watched(g, rate.x);
}

/// The cubic Hermite polynomial of a step of length h from x0 to x1 with slopes r0 and r1, at the
/// time s after its end (negative: before).
inline double hermite_past_end(double x0, double r0, double x1, double r1, double h, double s) {
  const double mean = (x1 - x0) / h, part = s / h;
  const double cubic = r0 + r1 - 2 * mean;
  return x1 + s * (r1 + part * (r1 - mean + cubic + part * cubic));
}

/// Moves the end of a step of length h by as little as it takes to end on the guard, along the
/// cubic Hermite polynomial of the step (k1: slope at the start). Returns the new length; NaN, and
/// `end` unchanged, where it would change by more than an eighth, or become longer than `longest`.
template <Machine M, int N>
double land(const Plant<M, N>& p, const Point<N>& start, const Point<N>& k1,
            const Settled<N>& settled, const Guard& g, double h, double longest, Point<N>& end) {
  const Point<N> rate = slope(p, end.x, settled, h);
  const double d0 = distance(g, start.x), d1 = distance(g, end.x);
  const double v0 = approach(g, k1), v1 = approach(g, rate);
  double s = -d1 / v1;
  for (int trial = 0; trial < 2; ++trial) s -= hermite_past_end(d0, v0, d1, v1, h, s) / v1;
  if (!(std::fabs(s) <= h / 8 && h + s <= longest)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  each([h, s](double x1, double x0, double r0,
              double r1) { return hermite_past_end(x0, r0, x1, r1, h, s); },
       end, end, start, k1, rate);
  return h + s;
}

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
/// The first guess is the root of the Hermite polynomial, and nearly always close enough to land;
/// if not, secant steps follow, bisected wherever they would leave the bracket.
template <Machine M, int N>
double locate(const Plant<M, N>& p, const Point<N>& start, const Point<N>& k1,
              const Settled<N>& settled, const Scale& scale, const Guard& g, double h,
              Point<N>& end) {
  double d = distance(g, end.x);
  double guess = h * hermite_root(distance(g, start.x), h * approach(g, k1), d,
                                  h * approach(g, slope(p, end.x, settled, h)));
  double lower = 0, upper = h, s = h;
  for (int trial = 0; trial < 60; ++trial) {
    const double previous = s, d_previous = d;
    s = guess > lower && guess < upper ? guess : (lower + upper) / 2;
    end = runge_kutta(p, start, k1, settled, scale, s).end;
    const double landed = land(p, start, k1, settled, g, s, h, end);
    if (landed > 0) return landed;
    d = distance(g, end.x);
    if (d == 0) return s;
    (d > 0 ? lower : upper) = s;
    guess = s - d * (s - previous) / (d - d_previous);
  }
  return s;  // the guard is met at a standstill: it is close enough
}

}  // namespace srm
