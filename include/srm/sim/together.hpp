// All phases by the same step: which event ends it, and where.
//
// The phases depend on one another where their torque turns the shaft, where their currents load a
// capacitor, or where they share a switch.
#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "srm/sim/gate.hpp"
#include "srm/sim/guard.hpp"

namespace srm {

template <int N>
using Spans = std::array<Span, N>;

/// The first guard that the rates at a point lead to within a time h, and when. angle: the next
/// angle that matters.
template <int N>
std::pair<Guard, double> expected(const Instant<N>& start,
                                  const std::type_identity_t<Spans<N>>& spans,
                                  const StepStart<N>& s, const Guard& angle, double h) {
  Guard first;
  const auto consider = [&](const Guard& g, double left, double rate, double second) {
    const double reach = h * (std::abs(rate) + h * std::abs(second));
    if (!(std::abs(left) < reach && left * g.direction > 0)) return;
    const double t = arrival(left, rate, second);
    if (!(t < h)) return;
    first = g;
    h = t;
  };
  const Rates<N>& r = start.rates;
  for (int k = 0; k < N; ++k) {
    if (!s.circuit.flows[k]) continue;
    const bool falls = r.i[k].rate < 0;
    const Guard g{k, falls ? spans[k].below : spans[k].above, falls ? -1 : 1};
    consider(g, g.value - start.x.i[k], r.i[k].rate, s.d2i[k]);
  }
  consider(angle, angle.value - start.x.theta_m, start.x.omega_m, r.alpha.now);
  return {first, h};
}

/// The first guard that a step of length h meets, and about when; none has direction 0. A guard of
/// `located` is left out: the step ends on it.
template <int N>
std::pair<Guard, double> met(const Instant<N>& start, const Instant<N>& end,
                             const std::type_identity_t<Spans<N>>& spans, const StepStart<N>& s,
                             const Guard& angle, double h, int located) {
  Met first;
  for (int k = 0; k < N; ++k) {
    if (!s.circuit.flows[k] || k == located) continue;
    first.consider(spans[k], k, start.rates.i[k], end.rates.i[k], h);
  }
  if (located != Guard::angle) first.consider(angle, start.x.theta_m, end.x.theta_m);
  if (located != Guard::link && !s.circuit.shorted) {
    first.consider({Guard::link, 0, -1}, start.x.u_dc, end.x.u_dc);
  }
  return {first.guard, first.part * h};
}

/// Makes a step, that passes the guard, end on it.
template <Machine M, int N>
void locate(const Plant<M, N>& p, const Instant<N>& start, const StepStart<N>& s,
            const Scale& scale, const Guard& g, double guess, Trial& y, Instant<N>& end) {
  double lower = 0, upper = y.h;
  for (int round = 0; round < 60; ++round) {
    if (!(guess > lower && guess < upper)) guess = (lower + upper) / 2;
    y = step(p, start, s, scale, guess, g, upper, end);
    if (y.landed) return;
    y = step(p, start, s, scale, guess, Guard{}, guess, end);
    (distance(g, end.x) > 0 ? lower : upper) = guess;
    guess = 0;
  }
}

}  // namespace srm
