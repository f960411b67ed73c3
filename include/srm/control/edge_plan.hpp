// Switching instants of one sample, planned from straight-line predictions.
//
// A torque error e that runs to and fro between -A and A with slopes of de/dt is stopped by
// turn-ons that each cost w_sw: mean cost = A^2/3 + w_sw s/(2 A), with s = u_dc gain D (1 - D) the
// rate at which one phase makes ripple at duty D. The least mean cost is at
//
//   A^3 = (3/4) w_sw s,   and its value is A^2:
//
// so a leg is held until the squared error reaches the mean cost, and a decision is worth
//
//   integral of (e^2 - A^2) until then + w_sw/2 a leg level + cost of the flux linkages it leads
//   to.
//
// This is the average-cost rule of optimal stopping applied to predictive torque control by
// extrapolation: T. Geyer, G. Papafotiou, M. Morari, "Model predictive direct torque control",
// IEEE Trans. Ind. Electron. 56(6), 2009. The flux linkages may leave the guide where no torque is
// lost, that is, in the part of their deviation that the gains do not see.
#pragma once

#include "srm/control/outlook.hpp"
#include "srm/control/switching_weight.hpp"

namespace srm {

template <Real T, int N>
struct EdgePlan {
  /// A phase that may conduct.
  struct Active {
    int k{};                    // its place among the phases
    int lowest{}, highest{};    // levels that it may take
    T gain{};                   // dtau/dpsi [N m/Wb]
    T share{};                  // gain/(sum of gain^2) [Wb/(N m)]
    T slack{}, per_slack{};     // flux deviation that counts as the whole band [Wb], its inverse
    std::array<T, 3> leaves{};  // slope of the deviation from the guide at each level [V]
  };

  /// A predicted instant, or its slope. away: deviations without their torque part.
  struct Point {
    T e{};                    // torque error [N m]
    std::array<T, N> away{};  // [Wb]
  };
  using Levels = std::array<int, N>;  // of the active phases: -1, 0, 1

  std::array<Active, N> phases{};
  int n_active = 0;
  T w_sw{};    // cost of a turn-on [N^2 m^2 s]
  T w_flux{};  // cost of a deviation of `slack` over a pulse, against A^2
  T A{};       // half width of the torque band [N m]
  T pulse{};   // length of a pulse period at this band [s]
  T drift{};   // of the torque while all active phases follow the guide [N m/s]

  /// Slopes with given legs.
  Point slopes(const Levels& level) const {
    Point d;
    T along = T(0);
    for (int j = 0; j < n_active; ++j) {
      d.away[j] = phases[j].leaves[level[j] + 1];
      along = along + phases[j].gain * d.away[j];
    }
    d.e = drift + along;
    without_torque(d.away, along);
    return d;
  }

  /// Takes the part along the gains out of deviations; along = sum of gain * away.
  void without_torque(std::array<T, N>& away, T along) const {
    for (int j = 0; j < n_active; ++j) away[j] = away[j] - phases[j].share * along;
  }

  /// Time until |e| passes `band`; 0 where it is outside and does not return.
  static T torque_exit(T e, T slope, T band, T longest) {
    if (slope > T(0)) return clamp((band - e) / slope, T(0), longest);
    if (slope < T(0)) return clamp((-band - e) / slope, T(0), longest);
    return longest;
  }

  /// Time, up to `longest`, that legs may stay, for a torque band that may be wider than A.
  T stay(const Point& x, const Point& d, const Levels& level, T band, T longest) const {
    T t = torque_exit(x.e, d.e, band, longest);
    for (int j = 0; j < n_active; ++j) {
      const Active& p = phases[j];
      if (level[j] < p.lowest || level[j] > p.highest) return T(0);
      const bool can_rise = level[j]<p.highest, can_fall = level[j]> p.lowest;
      if (can_rise && d.away[j] < T(0) && x.away[j] + d.away[j] * t < -p.slack) {
        t = max((-p.slack - x.away[j]) / d.away[j], T(0));
      } else if (can_fall && d.away[j] > T(0) && x.away[j] + d.away[j] * t > p.slack) {
        t = max((p.slack - x.away[j]) / d.away[j], T(0));
      }
    }
    return t;
  }

  void advance(Point& x, const Point& d, T t) const {
    x.e = x.e + d.e * t;
    for (int j = 0; j < n_active; ++j) x.away[j] = x.away[j] + d.away[j] * t;
  }

  /// Integral of e^2 over a time t.
  static T squared(T e, T slope, T t) {
    const T end = e + slope * t;
    return t * (e * e + e * end + end * end) * T(1.0 / 3);
  }

  /// Leg levels between two combinations; a turn-on is one level up, a turn-off one down.
  int distance(const Levels& from, const Levels& to) const {
    int levels = 0;
    for (int j = 0; j < n_active; ++j) {
      levels += to[j] > from[j] ? to[j] - from[j] : from[j] - to[j];
    }
    return levels;
  }

  /// What going on from x costs beyond the mean, while its legs stay.
  T dwell(const Point& x, const Point& d) const {
    T t = torque_exit(x.e, d.e, A, pulse);
    if (leaves(t)) t = pulse;  // these legs are wrong at once: what they would do in a pulse
    return squared(x.e, d.e, t) - A * A * t;
  }

  /// The same at the end of a sample, where other legs may follow at once; outside the band they
  /// need time to come back, at the mean slope of 4 A in a pulse.
  T dwell_at_end(const Point& x, const Point& d) const {
    const T t = torque_exit(x.e, d.e, A, pulse);
    if (!leaves(t)) return squared(x.e, d.e, t) - A * A * t;
    const T outside = max(abs(x.e) - A, T(0));
    return outside / (T(4) * A) * pulse * (x.e * x.e - A * A) / T(2);
  }

  bool leaves(T exit) const { return exit < pulse * T(0.05); }

  /// What the flux linkages cost that a pulse with these legs leads to.
  T flux_cost(const Point& x, const Point& d) const {
    T sum = T(0);
    for (int j = 0; j < n_active; ++j) {
      const T away = (x.away[j] + d.away[j] * pulse) * phases[j].per_slack;
      sum = sum + away * away;
    }
    return w_flux * A * A * pulse * sum;
  }

  /// Best legs to go on with. A phase with two edges behind it keeps its leg; `other` asks for a
  /// change in any case.
  Levels best(const Point& x, const Levels& last, const Levels& edges, bool other) const {
    Levels found = last, level{}, low{}, high{};
    for (int j = 0; j < n_active; ++j) {
      low[j] = edges[j] < 2 ? phases[j].lowest : last[j];
      high[j] = edges[j] < 2 ? phases[j].highest : last[j];
    }
    level = low;
    T least = T(1e30);
    for (bool more = true; more;) {
      const int levels = distance(last, level);
      if (levels > 0 || !other) {
        const Point d = slopes(level);
        const T cost = dwell(x, d) + flux_cost(x, d) + w_sw * T(0.5) * static_cast<T>(levels);
        if (cost < least) {
          least = cost;
          found = level;
        }
      }
      more = false;
      for (int j = 0; j < n_active && !more; ++j) {  // count up, phase by phase
        more = level[j] < high[j];
        level[j] = more ? level[j] + 1 : low[j];
      }
    }
    return found;
  }
};

}  // namespace srm
