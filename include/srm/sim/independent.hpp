// Steps of one phase. Where the speed and the dc-link voltage are held, the phases do not depend on
// each other, and an event of one need not end the steps of the others.
//
// The rule is that of `step.hpp`, for one flux linkage.
#pragma once

#include "srm/sim/guard.hpp"

namespace srm {

/// What a phase is given while it is by itself.
struct Given {
  double u;        // at its terminals, but for the resistance of its path [V]
  double R;        // of its path [ohm]
  double omega_m;  // [rad/s]
  double omega_e;  // [rad/s]
};

/// A phase at an instant: magnetics, current, rate of the flux linkage, torque.
struct PhasePoint {
  Jet<double> m;
  Moving i, v, tau;
};

/// Completes a point of which magnetics and current are known.
inline void rate(PhasePoint& p, const Given& g) {
  p.v.now = g.u - g.R * p.i.now;
  p.i.rate = (p.v.now - g.omega_m * p.m.psi_theta) / p.m.L_inc;
  p.v.rate = -g.R * p.i.rate;
  p.tau = {p.m.tau, p.m.psi_theta * p.i.rate + p.m.tau_theta * g.omega_m};
}

/// The step of a phase, which begins and ends apart from those of the others.
struct PhaseStep {
  bool active = false;    // has begun and has not ended
  double t0{}, t1{};      // [s]
  double h_fine = 1e300;  // what a step may be, from the ones before [s]
  PhasePoint start, end;
  Moving tau, i;  // torque and current now
  Guard met;      // at its end; direction 0: nothing

  /// Torque or current within the step, by the polynomial of the integrals.
  Moving within(double t, Moving PhasePoint::*of) const {
    const double h = t1 - t0, x = (t - t0) / h;
    const Cubic y(start.*of, end.*of, h);
    return {y.at(x), y.slope(x) / h};
  }

  /// Flux linkage within the step: of order 5, for its rates have rates.
  double flux(double t) const {
    const double h = t1 - t0, x = (t - t0) / h;
    const double slope = h * start.v.now, half_bend = h * h / 2 * start.v.rate;
    const double rise = end.m.psi - start.m.psi - slope - half_bend;
    const double steeper = h * end.v.now - slope - 2 * half_bend;
    const double bends = h * h / 2 * end.v.rate - half_bend;
    const double c3 = 10 * rise - 4 * steeper + bends;
    const double c4 = 7 * steeper - 15 * rise - 2 * bends;
    const double c5 = 6 * rise - 3 * steeper + bends;
    return start.m.psi + x * (slope + x * (half_bend + x * (c3 + x * (c4 + x * c5))));
  }

  /// Current within the step, at the electrical angle theta_e of that time.
  template <class M>
  double current(double t, const M& machine, double theta_e) const {
    double there = start.i.now + (t - t0) / (t1 - t0) * (end.i.now - start.i.now);
    for (int round = 0; round < 3; ++round) {
      const auto m = machine.at(max(there, 0.0), theta_e);
      there += (flux(t) - m.psi) / m.L_inc;
    }
    return max(there, 0.0);
  }
};

/// A step of length h of one phase that begins at the electrical angle theta_e; with a threshold,
/// of the length that ends on it, near h and no longer than `longest`. d2i: second derivative of
/// the current at the start. scale: of the currents [A].
template <Machine M>
[[gnu::always_inline]] inline Trial step(const M& machine, const Given& given, double theta_e,
                                         const PhasePoint& start, double d2i, double scale,
                                         double h, const Guard& g, double longest,
                                         PhasePoint& end) {
  Trial y{.h = h, .spread = 0, .fine = false, .landed = false};
  double i = start.i.now + h * (start.i.rate + h / 2 * d2i), off = 0;
  for (int round = 0; round < 8; ++round) {
    end.m = machine.jet(i, wrap(theta_e + y.h * given.omega_e));
    const double rate = start.i.rate + y.h * d2i + 3 / y.h * off;
    const Moving v{given.u - given.R * i, -given.R * rate};
    const double left = start.m.psi + integral(start.v, v, y.h) - end.m.psi;
    double d = correction(end.m, left, y.h, given.R), dh = 0;
    off += d;
    double most = abs(d);
    if (round == 0) y.spread = most / scale;
    if (g.direction != 0) {
      const double slope = rate + 3 / y.h * d;
      dh = (g.value - i - d) / slope;
      if (!(y.h + dh > 0 && y.h + dh <= longest)) return y;
      d += dh * slope;
      most = max(most, abs(d));
      y.h += dh;
    }
    y.fine = most <= small_part * scale;
    i += d;
    if (y.fine) {
      move(end.m, d, dh * given.omega_m);
      break;
    }
  }
  if (!y.fine) return y;
  y.landed = g.direction != 0;
  end.i.now = y.landed ? g.value : i;
  rate(end, given);
  end.m.psi = start.m.psi + integral(start.v, end.v, y.h);
  return y;
}

/// A step that is too long, or passes a threshold, in shorter ones.
template <class Go>
[[gnu::noinline, gnu::cold]] void shorten(const Go& go, const Span& span, int k, Trial& y,
                                          PhaseStep& phase) {
  while (!y.fine || y.spread > spread_part) {
    const double half = y.h / 2;
    if (half < shortest_step) break;
    phase.h_fine = half;
    phase.met = {};
    y = go(half, phase.met, half);
  }
  for (int trials = 8; trials > 0 && !y.landed; --trials) {
    Met first;
    first.consider(span, k, phase.start.i, phase.end.i, y.h);
    const Guard g = first.guard;
    if (g.direction == 0) break;
    double lower = 0, upper = y.h, when = first.part * y.h;
    for (int round = 0; round < 60 && !y.landed; ++round) {
      if (!(when > lower && when < upper)) when = (lower + upper) / 2;
      y = go(when, g, upper);
      if (y.landed) break;
      y = go(when, Guard{}, when);
      (g.direction * (g.value - phase.end.i.now) > 0 ? lower : upper) = when;
      when = 0;
    }
    phase.met = g;
    if (!y.landed) break;
  }
}

/// Advances a phase to its first threshold, or as far as one step of at most h_max goes, but not
/// past t_end. k: its number. theta_e: its electrical angle now.
template <Machine M>
[[gnu::always_inline]] inline void advance_phase(const M& machine, const Given& given,
                                                 double theta_e, int k, const Span& span,
                                                 double scale, double t_end, double h_max,
                                                 PhaseStep& phase) {
  const PhasePoint &a = phase.start, &b = phase.end;
  const double d2i = bend(a.m, a.i, a.v, {given.omega_m, 0});
  const double whole = t_end - phase.t0;
  double h = min(min(whole, h_max), phase.h_fine);
  const double longest = h;
  const bool falls = a.i.rate < 0;
  Guard ahead{k, falls ? span.below : span.above, falls ? -1 : 1};
  const double left = ahead.value - a.i.now;
  const bool near = abs(left) < h * (abs(a.i.rate) + h * abs(d2i)) && left * ahead.direction > 0;
  const double soon = near ? arrival(left, a.i.rate, d2i) : h;
  if (soon < h) {
    h = soon;
  } else {
    ahead.direction = 0;
  }
  Trial y = step(machine, given, theta_e, a, d2i, scale, h, ahead, longest, phase.end);
  phase.met = ahead;
  if (!y.landed) phase.met.direction = 0;
  const bool fine = y.fine && y.spread <= spread_part;
  const bool passes = b.i.now <= span.below || b.i.now >= span.above || a.i.rate * b.i.rate < 0;
  if (!fine || (passes && !y.landed)) {
    const auto go = [&](double shorter, const Guard& g, double most) {
      return step(machine, given, theta_e, a, d2i, scale, shorter, g, most, phase.end);
    };
    shorten(go, span, k, y, phase);
  }
  if (y.h >= phase.h_fine / 2 && y.spread < spread_part / 8) phase.h_fine *= 2;
  phase.t1 = y.h == whole ? t_end : min(phase.t0 + y.h, t_end);
  phase.active = true;
}

/// Adds what the step of phase k has done. u: on the path, of the dc link [V]; R: of a phase.
template <int N>
void add(Integrals<N>& q, const PhaseStep& phase, int k, double u, double R) {
  const PhasePoint &a = phase.start, &b = phase.end;
  const double h = phase.t1 - phase.t0;
  const double i_squared = integral(a.i * a.i, b.i * b.i, h);
  q.i_squared[k] += i_squared;
  q.E_winding += integral(a.v * a.i, b.v * b.i, h) + R * i_squared;
  const double E_dc = u * integral(a.i, b.i, h);
  q.E_dc += E_dc;
  q.E_source += E_dc;
}

/// True where speed and dc-link voltage are held, and bridge and iron let each phase be by itself.
template <Machine M, int N>
bool independent(const Plant<M, N>& p, const State<N>& x, double t) {
  const StiffSource* source = std::get_if<StiffSource>(&p.source);
  return source && source->u_dc.rate(t) == 0 && x.u_dc > 0 &&
         p.shaft.rotation == Rotation::locked && p.shaft.omega.rate(t) == 0 &&
         is_phase_by_phase(p.bridge) && !p.coupling.any();
}

}  // namespace srm
