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
// lost, that is, in the part of their deviation that the gains do not see:
//
//   away_k = z_k - spread_k along,   z_k: deviation of phase k;  along: torque of all deviations
//
// so that a leg that changes moves one z and `along`, and the sum of away^2 follows from three sums
// without a loop over the phases.
//
// Here torque is counted in A, time in pulse periods 2 A/s and flux linkage in the slack. Then w_sw
// is 2/3, and three times a cost is the integral of 3 (e^2 - 1), 1 a leg level, 3 w_flux away^2.
//
// Tuned numbers, and what they decide: docs/control/tuned_constants.md.
#pragma once

#include "srm/control/part/prediction.hpp"
#include "srm/control/part/switching_weight.hpp"

namespace srm {

template <Real T, int N>
struct EdgePlan {
  /// Cost of a deviation of the slack over a pulse, against that of the torque ripple.
  static constexpr T w_flux = T(0.6);
  /// A torque that leaves its band sooner counts as outside [pulses].
  static constexpr T soon = T(0.05);

  /// A phase that may conduct. Levels 0, 1, 2: demagnetize, freewheel, magnetize.
  struct Active {
    int k;                      // its place among the phases
    int lowest, highest;        // levels that it may take
    T spread;                   // deviation that a torque error is shared to it with
    std::array<T, 3> tau_rate;  // of the torque at each level, against the guide's
    std::array<T, 3> z_rate;    // of the deviation from the guide at each level
  };

  /// A predicted instant, or its slope.
  struct Point {
    T e;                 // torque error
    T along;             // torque of the deviations from the guide
    std::array<T, N> z;  // deviations
  };
  using Levels = std::array<int, N>;  // of the active phases

  std::array<Active, N> phases;
  int n_active = 0;
  T spread_squared{};  // sum over the phases
  T drift{};           // of the torque while all active phases follow the guide

  /// Slopes with given legs.
  Point slopes(const Levels& level) const {
    Point d;
    d.along = T(0);
    for (int j = 0; j < n_active; ++j) {
      d.along = d.along + phases[j].tau_rate[level[j]];
      d.z[j] = phases[j].z_rate[level[j]];
    }
    d.e = drift + d.along;
    return d;
  }

  /// Time until |e| passes `band`; 0 where it is outside and does not return.
  static T torque_exit(T e, T slope, T band, T longest) {
    if (slope > T(0)) return clamp((band - e) / slope, T(0), longest);
    if (slope < T(0)) return clamp((-band - e) / slope, T(0), longest);
    return longest;
  }

  /// Time, up to `longest`, that legs may stay, for a torque band that may be wider than 1.
  T stay(const Point& x, const Point& d, const Levels& level, T band, T longest) const {
    T t = torque_exit(x.e, d.e, band, longest);
    for (int j = 0; j < n_active; ++j) {
      const Active& p = phases[j];
      if (level[j] < p.lowest || level[j] > p.highest) return T(0);
      const T away = x.z[j] - p.spread * x.along;
      const T rate = d.z[j] - p.spread * d.along;
      if (rate < T(0)) {
        const bool leaves = level[j] < p.highest && away + rate * t < T(-1);
        if (leaves) t = max((T(-1) - away) / rate, T(0));
      } else if (rate > T(0)) {
        const bool leaves = level[j] > p.lowest && away + rate * t > T(1);
        if (leaves) t = max((T(1) - away) / rate, T(0));
      }
    }
    return t;
  }

  void advance(Point& x, const Point& d, T t) const {
    x.e = x.e + d.e * t;
    x.along = x.along + d.along * t;
    for (int j = 0; j < n_active; ++j) x.z[j] = x.z[j] + d.z[j] * t;
  }

  /// What going on from an error costs beyond the mean, while its legs stay, times three. Legs that
  /// are wrong at once cost what they would do in a pulse.
  static T dwell(T e, T slope) {
    T t = ((slope > T(0) ? T(1) : T(-1)) - e) / slope;
    if (!(t >= soon && t < T(1))) t = T(1);  // also without slope
    const T end = e + slope * t;
    return t * (e * (e + end) + end * end - T(3));
  }

  /// Sums over the deviations that a pulse with given legs leads to; away^2 is made of them.
  struct Ahead {
    T along;             // torque of the deviations
    T z_squared;         // sum of z^2
    T z_spread;          // sum of spread z
    std::array<T, N> z;  // of each phase
  };

  Ahead ahead(const Point& x, const Point& d) const {
    Ahead a;
    a.along = x.along + d.along;
    a.z_squared = T(0);
    a.z_spread = T(0);
    for (int j = 0; j < n_active; ++j) {
      const T z = x.z[j] + d.z[j];
      a.z[j] = z;
      a.z_squared = a.z_squared + z * z;
      a.z_spread = a.z_spread + phases[j].spread * z;
    }
    return a;
  }

  /// What the flux linkages cost: sum of away^2.
  T flux_cost(T along, T z_squared, T z_spread) const {
    return T(3) * w_flux * (z_squared + along * (along * spread_squared - T(2) * z_spread));
  }

  /// Brings the legs to the best ones to go on with: the last ones, or one phase at another level;
  /// and d to their slopes. A level that a phase may not keep is left in any case; a phase whose
  /// edges are used up keeps its leg. False where nothing changes.
  bool change(Levels& level, const Point& x, Point& d, const Levels& edges) const {
    int left = 0;  // leg levels that must be left
    for (int j = 0; j < n_active; ++j) {
      const int last = level[j];
      if (edges[j] >= max_edges || (last >= phases[j].lowest && last <= phases[j].highest))
        continue;
      level[j] = last < phases[j].lowest ? phases[j].lowest : phases[j].highest;
      left += distance(level[j], last);
    }
    if (left > 0) d = slopes(level);
    const Ahead a = ahead(x, d);
    T least = dwell(x.e, d.e) + flux_cost(a.along, a.z_squared, a.z_spread);
    int phase = -1, to = 0;
    for (int j = 0; j < n_active; ++j) {
      if (edges[j] >= max_edges) continue;
      const Active& p = phases[j];
      const int now = level[j];
      for (int l = p.lowest; l <= p.highest; ++l) {
        if (l == now) continue;
        const T slope = p.tau_rate[l] - p.tau_rate[now];
        const T cost = dwell(x.e, d.e + slope) + static_cast<T>(distance(l, now));
        if (!(cost < least)) continue;  // the flux linkages cost no less than nothing
        const T moved = p.z_rate[l] - p.z_rate[now];
        const T whole =
            cost + flux_cost(a.along + slope, a.z_squared + moved * (T(2) * a.z[j] + moved),
                             a.z_spread + moved * p.spread);
        if (whole < least) {
          least = whole;
          phase = j;
          to = l;
        }
      }
    }
    if (phase >= 0) {
      const Active& p = phases[phase];
      const T slope = p.tau_rate[to] - p.tau_rate[level[phase]];
      d.e = d.e + slope;
      d.along = d.along + slope;
      d.z[phase] = p.z_rate[to];
      level[phase] = to;
    }
    return left > 0 || phase >= 0;
  }

 private:
  static int distance(int a, int b) { return a > b ? a - b : b - a; }
};

}  // namespace srm
