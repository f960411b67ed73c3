// Events of the plant: a guard is a state variable that meets a value, and its instant is located by
// root finding on the length of the integration step.
#pragma once

#include <cmath>

#include "srm/sim/step.hpp"

namespace srm {

/// The current of phase k, or the rotor angle (k = angle), meets `value`: from below (direction
/// +1) or from above (-1). Direction 0: no guard.
struct Guard {
  static constexpr int angle = -1;

  int k = angle;
  double value = 0;
  int direction = 0;
  Leg then = Leg::demagnetize;  // a current guard sets the leg
};

/// What is left before the guard is met: positive before, zero or negative once it is met.
template <int N>
double distance(const Guard& g, const State<N>& x) {
  return g.direction * (g.value - (g.k == Guard::angle ? x.theta_m : x.i[g.k]));
}

/// Closer than this to its value a guard counts as met [A, rad]. A micro-ampere moves an instant by
/// 1e-12 s at typical slopes; this is a thousandth of it.
inline constexpr double guard_tolerance = 1e-9;

/// Shortens the step from `start` of length h, which overshoots the guard, until it ends on it.
/// `end` is replaced by the located point; returns the new length.
///
/// The first guess is the root of the parabola through both ends with the known initial slope; then
/// secant steps, bisected wherever they would leave the bracket.
template <Machine M, int N>
double locate(const Plant<M, N>& p, const Point<N>& start, const Rates<N>& k1, const Legs<N>& legs,
              double tau_ref, const Guard& g, double h, Point<N>& end) {
  const double d0 = distance(g, start.x);
  if (d0 <= 0) {
    end = start;
    return 0;
  }
  double lower = 0, upper = h;
  double previous = h, d_previous = distance(g, end.x);
  const double rate = g.k == Guard::angle ? start.x.omega_m : k1.di[g.k];
  const double fall = -g.direction * rate;  // slope of the distance at the start
  const double curvature = (d_previous - d0 - fall * h) / (h * h);
  const double root = std::sqrt(std::fmax(fall * fall - 4 * curvature * d0, 0));
  double guess = 2 * d0 / (root - fall);
  double s = h;
  for (int trial = 0; trial < 60; ++trial) {
    s = guess > lower && guess < upper ? guess : (lower + upper) / 2;
    end = runge_kutta(p, start, k1, legs, tau_ref, s);
    const double d = distance(g, end.x);
    if (std::fabs(d) <= guard_tolerance) break;
    (d > 0 ? lower : upper) = s;
    guess = s - d * (s - previous) / (d - d_previous);
    previous = s;
    d_previous = d;
  }
  return s;
}

}  // namespace srm
