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

#include "srm/control/part/outlook.hpp"
#include "srm/control/part/switching_weight.hpp"

namespace srm {

/// What a plan does at the border of two samples: go on as it is best, or change a leg in any case.
enum class Border : std::int8_t { free, change };

template <Real T, int N>
struct EdgePlan {
  /// A phase that may conduct. Levels -1, 0, 1 are at places 0, 1, 2.
  struct Active {
    int k{};                       // its place among the phases
    int lowest{}, highest{};       // levels that it may take
    T per_slack{};                 // 1/(flux deviation that counts as the whole band) [1/Wb]
    T spread{};                    // deviation that a torque error is shared to it with [1/(N m)]
    std::array<T, 3> tau_rate{};   // of the torque at each level, against the guide's [N m/s]
    std::array<T, 3> away_rate{};  // of the deviation from the guide at each level [1/s]
  };

  /// A predicted instant, or its slope. away: deviations from the guide, in units of the slack,
  /// without their torque part.
  struct Point {
    T e{};                    // torque error [N m]
    std::array<T, N> away{};  // [1]
  };
  using Levels = std::array<int, N>;  // of the active phases: -1, 0, 1

  std::array<Active, N> phases{};
  int n_active = 0;
  T w_sw{};    // cost of a turn-on [N^2 m^2 s]
  T w_flux{};  // cost of a deviation of the slack over a pulse, against A^2
  T A{};       // half width of the torque band [N m]
  T pulse{};   // length of a pulse period at this band [s]
  T drift{};   // of the torque while all active phases follow the guide [N m/s]

  /// Slopes with given legs.
  Point slopes(const Levels& level) const {
    Point d;
    T along = T(0);
    for (int j = 0; j < n_active; ++j) along = along + phases[j].tau_rate[level[j] + 1];
    d.e = drift + along;
    for (int j = 0; j < n_active; ++j) {
      d.away[j] = phases[j].away_rate[level[j] + 1] - phases[j].spread * along;
    }
    return d;
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
      const bool can_rise = level[j] < p.highest;
      const bool can_fall = level[j] > p.lowest;
      if (can_rise && d.away[j] < T(0) && x.away[j] + d.away[j] * t < T(-1)) {
        t = max((T(-1) - x.away[j]) / d.away[j], T(0));
      } else if (can_fall && d.away[j] > T(0) && x.away[j] + d.away[j] * t > T(1)) {
        t = max((T(1) - x.away[j]) / d.away[j], T(0));
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

  /// Cost of going from legs to others; a turn-on is one level up, a turn-off one down.
  T switching(const Levels& from, const Levels& to) const {
    int levels = 0;
    for (int j = 0; j < n_active; ++j) {
      levels += to[j] > from[j] ? to[j] - from[j] : from[j] - to[j];
    }
    return w_sw * T(0.5) * static_cast<T>(levels);
  }

  /// What going on from an error costs beyond the mean, while its legs stay.
  T dwell(T e, T slope) const {
    T t = torque_exit(e, slope, A, pulse);
    if (leaves(t)) t = pulse;  // these legs are wrong at once: what they would do in a pulse
    return squared(e, slope, t) - A * A * t;
  }

  /// The same at the end of a sample, where other legs may follow at once; outside the band they
  /// need time to come back, at the mean slope of 4 A in a pulse.
  T dwell_at_end(T e, T slope) const {
    const T t = torque_exit(e, slope, A, pulse);
    if (!leaves(t)) return squared(e, slope, t) - A * A * t;
    const T outside = max(abs(e) - A, T(0));
    return outside / (T(4) * A) * pulse * (e * e - A * A) / T(2);
  }

  bool leaves(T exit) const { return exit < pulse * T(0.05); }

  /// What the flux linkages cost that a pulse with these legs leads to.
  T flux_cost(const Point& x, const Point& d) const {
    T sum = T(0);
    for (int j = 0; j < n_active; ++j) {
      const T away = x.away[j] + d.away[j] * pulse;
      sum = sum + away * away;
    }
    return w_flux * A * A * pulse * sum;
  }

  /// Best legs to go on with: the last ones, or one phase at another level. A level that a phase
  /// may not keep is left in any case; a phase whose edges are used up keeps its leg.
  Levels best(const Point& x, const Levels& last, const Levels& edges, Border border) const {
    Levels kept = last;
    for (int j = 0; j < n_active; ++j) {
      if (edges[j] >= max_edges) continue;
      if (kept[j] < phases[j].lowest) kept[j] = phases[j].lowest;
      if (kept[j] > phases[j].highest) kept[j] = phases[j].highest;
    }
    Levels found = kept;
    T least = T(1e30);
    const auto consider = [&](const Levels& level) {
      const T price = switching(last, level);
      if (border == Border::change && !(price > T(0))) return;
      const Point d = slopes(level);
      const T cost = dwell(x.e, d.e) + price;
      if (!(cost < least)) return;  // the flux linkages, which cost no less than nothing, can wait
      const T whole = cost + flux_cost(x, d);
      if (whole < least) {
        least = whole;
        found = level;
      }
    };
    consider(kept);
    for (int j = 0; j < n_active; ++j) {
      if (edges[j] >= max_edges) continue;
      Levels level = kept;
      for (level[j] = phases[j].lowest; level[j] <= phases[j].highest; ++level[j]) {
        if (level[j] != kept[j]) consider(level);
      }
    }
    return found;
  }
};

}  // namespace srm
