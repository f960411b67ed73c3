// Events of the plant: a guard is a state variable that meets a value. The instant is an unknown of
// the step that ends on it.
#pragma once

#include <cmath>
#include <limits>

#include "srm/sim/gate.hpp"
#include "srm/sim/step.hpp"

namespace srm {

/// The current of phase k, the rotor angle (k = angle) or the dc-link voltage (k = link) meets
/// `value`: from below (direction +1) or from above (-1). Direction 0: no guard.
struct Guard {
  static constexpr int angle = -1;
  static constexpr int nobody = -2;
  static constexpr int link = -3;

  int k = nobody;
  double value = 0;
  int direction = 0;
};

/// What a guard watches, of a state or of its rates.
template <int N>
double watched(const Guard& g, const State<N>& x) {
  if (g.k == Guard::angle) return x.theta_m;
  return g.k == Guard::link ? x.u_dc : x.i[g.k];
}
template <int N>
double& watched(const Guard& g, State<N>& x) {
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

/// When a quantity that has `left` to go, at its rate and the rate of that, gets there [s];
/// infinity where it turns back before.
inline double arrival(double left, double rate, double second) {
  const double square = rate * rate + 2 * second * left;
  if (!(square > 0)) return std::numeric_limits<double>::infinity();
  const double root = std::sqrt(square);
  const double t = 2 * left / (rate + (rate < 0 ? -root : root));
  return t > 0 ? t : std::numeric_limits<double>::infinity();
}

/// What a step came to.
struct Trial {
  double h;       // its length [s]
  double spread;  // of the first corrections, in parts of the scale [1]
  bool fine;      // the corrections have become small
  bool landed;    // the end is on the guard that was asked for
};

// Longest step in electrical angle [rad], for the magnetisation changes with the angle however
// smooth the currents are. With four rotor poles, 20 us are shorter up to 3100 rpm.
inline constexpr double longest_angle = 0.0262;

// A step is halved while its prediction is off by more than this part of the scale: as where a
// small capacitor on a stiff battery settles within it.
inline constexpr double spread_part = 4e-5;

// No step is halved below this: the numbers are none any more [s].
inline constexpr double shortest_step = 1e-15;

// Corrections up to this part of the scale are taken without another evaluation: of the machine,
// whose derivatives tell the rest, or of the rates at the dc-link voltage.
inline constexpr double small_part = 1e-5;

/// A step of length h from `start` to `end`; with a guard, of the length that ends on it, near h
/// and no longer than `longest`.
template <Machine M, int N>
[[gnu::flatten]] Trial step(const Plant<M, N>& p, const Instant<N>& start, const StepStart<N>& s,
                            const Scale& scale, double h, const Guard& g, double longest,
                            Instant<N>& end) {
  Trial y{.h = h, .spread = 0, .fine = false, .landed = false};
  predict(start, s, h, end.x);
  std::array<double, N> off{};
  const bool coupled = p.coupling.any();
  for (int round = 0; round < 8; ++round) {
    evaluate(p, end.x, s.circuit.flows, s.pieces, end.jets, end.links);
    std::array<double, N> d = corrections(start, end, s, y.h, off, coupled);
    double most = 0, dh = 0;
    for (int k = 0; k < N; ++k) {
      most = max(most, abs(d[k]));
      off[k] += d[k];
    }
    if (round == 0) y.spread = most / scale.i;
    if (g.direction != 0) {
      const auto rate = [&](int k) {
        return start.rates.i[k].rate + y.h * s.d2i[k] + 3 / y.h * off[k];
      };
      if (g.k >= 0) {
        dh = (g.value - end.x.i[g.k] - d[g.k]) / rate(g.k);
      } else if (g.k == Guard::angle) {
        dh = (g.value - end.x.theta_m) / end.x.omega_m;
      } else {
        dh = (g.value - end.x.u_dc) / start.rates.source.du_dc.now;
      }
      if (!(y.h + dh > 0 && y.h + dh <= longest)) return y;
      for (int k = 0; k < N; ++k) {
        if (!s.circuit.flows[k]) continue;
        d[k] += dh * rate(k);
        most = max(most, abs(d[k]));
      }
      y.h += dh;
      end.x.theta_m += dh * end.x.omega_m;
      end.x.omega_m += dh * start.rates.alpha.now;
      end.x.u_dc += dh * start.rates.source.du_dc.now;
    }
    y.fine = most <= small_part * scale.i;
    for (int k = 0; k < N; ++k) {
      if (!s.circuit.flows[k]) continue;
      end.x.i[k] += d[k];
      if (y.fine && !coupled) move(end.jets[k], d[k], dh * end.x.omega_m);
    }
    if (!y.fine) continue;
    if (coupled) move_all<N>(end.jets, end.links, d, dh * end.x.omega_m);
    break;
  }
  if (!y.fine) return y;
  if (g.direction != 0) watched(g, end.x) = g.value;
  // What leaks discharges the dc link faster than its prediction knows: there twice at least.
  const int least = s.circuit.leaks ? 2 : 1;
  for (int pass = 1; pass <= 8; ++pass) {
    rates(p, end.x, end.jets, end.links, s.circuit, {s.t + y.h, s.t}, end.rates);
    const double off_by = abs(close(p, start, end, s, y.h)) / scale.u_dc;
    if (pass == 1) y.spread = max(y.spread, off_by);
    y.fine = off_by <= small_part;
    if (y.fine && pass >= least) break;
  }
  if (!y.fine) return y;
  y.landed = g.direction != 0;
  if (y.landed) watched(g, end.x) = g.value;
  return y;
}

/// The cubic Hermite polynomial from a to b over x, the part of a step of length h [1].
struct Cubic {
  double y0, slope0, c2, c3;

  Cubic(const Moving& a, const Moving& b, double h) : y0(a.now), slope0(h * a.rate) {
    const double slope1 = h * b.rate, rise = b.now - a.now;
    c3 = slope0 + slope1 - 2 * rise;
    c2 = 3 * rise - 2 * slope0 - slope1;
  }
  double at(double x) const { return y0 + x * (slope0 + x * (c2 + x * c3)); }
  double slope(double x) const { return slope0 + x * (2 * c2 + x * 3 * c3); }
  double curve(double x) const { return 2 * c2 + 6 * c3 * x; }
};

/// The greatest or least value within a step of length h, where the cubic Hermite polynomial from
/// a to b has one; else that at the end.
inline double extreme(const Moving& a, const Moving& b, double h) {
  if (!(a.rate * b.rate < 0)) return b.now;
  const Cubic y(a, b, h);
  double x = a.rate / (a.rate - b.rate);
  for (int round = 0; round < 2; ++round) {
    const double curve = y.curve(x);
    if (curve != 0) x = clamp(x - y.slope(x) / curve, 0.0, 1.0);
  }
  return y.at(x);
}

/// The first guard that a step meets.
struct Met {
  Guard guard;      // direction 0: none so far
  double part = 2;  // about when, in parts of the step

  /// A guard whose quantity goes from `now` to `then`.
  void consider(const Guard& g, double now, double then) {
    const double before = g.direction * (g.value - now), after = g.direction * (g.value - then);
    if (after > 0 || after > before) return;
    const double when = before > 0 ? before / (before - after) : 0;
    if (when >= part) return;
    guard = g;
    part = when;
  }

  /// The current of phase k, which goes from a to b in a time h.
  void consider(const Span& span, int k, const Moving& a, const Moving& b, double h) {
    double least = b.now, most = b.now;
    if (a.rate * b.rate < 0) {
      const double turn = extreme(a, b, h);
      least = min(least, turn);
      most = max(most, turn);
    }
    if (least <= span.below) consider({k, span.below, -1}, a.now, least);
    if (most >= span.above) consider({k, span.above, 1}, a.now, most);
  }
};

}  // namespace srm
