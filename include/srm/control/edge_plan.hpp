// Switching instants of one sample, planned from straight-line predictions.
//
// A torque error e that runs to and fro between -A and A with slopes of e/dt is stopped by turn-ons
// that each cost w_sw: mean cost = A^2/3 + w_sw s/(2 A), with s = u_dc gain D (1 - D) the rate at
// which one phase makes ripple at duty D. The least mean cost is at
//
//   A^3 = (3/4) w_sw s,   and its value is A^2:
//
// so a leg is held until the squared error reaches the mean cost, and a decision is worth
//
//   integral of (e^2 - A^2) until then + w_sw/2 a leg level + value of the flux linkages it leads
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
  /// A predicted instant.
  struct Point {
    T e{};                       // torque error [N m]
    std::array<T, N> away{};     // flux deviation from the guide without its torque part [Wb]
    std::array<int, N> level{};  // leg levels -1, 0, 1
  };

  std::array<PhaseOutlook<T>, N> phases{};
  std::array<int, N> lowest{}, highest{};  // levels that a phase may take
  std::array<T, N> slack{};                // flux deviation that counts as the whole band [Wb]
  T u_dc{}, R{};
  T w_sw{};          // cost of a turn-on [N^2 m^2 s]
  T w_flux{};        // cost of a deviation of `slack` over a pulse, against A^2
  T A{};             // half width of the torque band [N m]
  T pulse{};         // length of a pulse period at this band [s]
  T drift{};         // of the torque at constant flux linkages [N m/s]
  T gain_squared{};  // sum of gain^2 of the phases that are not idle

  /// Slopes of the torque error and of the deviations for given legs.
  Point slopes(const std::array<int, N>& level) const {
    Point d;
    d.e = drift;
    T along = T(0);
    for (int k = 0; k < N; ++k) {
      const T rate = phases[k].rate(level[k], u_dc, R);
      d.e = d.e + phases[k].gain * rate;
      if (phases[k].idle) continue;
      d.away[k] = rate - phases[k].goal_rate;
      along = along + phases[k].gain * d.away[k];
    }
    without_torque(d.away, along);
    return d;
  }

  /// Takes the part along the gains out of deviations; along = sum of gain * away.
  void without_torque(std::array<T, N>& away, T along) const {
    if (!(gain_squared > T(0))) return;
    for (int k = 0; k < N; ++k) {
      if (!phases[k].idle) away[k] = away[k] - phases[k].gain * along / gain_squared;
    }
  }

  /// Time until |e| passes `band`; 0 where it is outside and does not return.
  static T torque_exit(T e, T slope, T band, T longest) {
    if (slope > T(0)) return clamp((band - e) / slope, T(0), longest);
    if (slope < T(0)) return clamp((-band - e) / slope, T(0), longest);
    return longest;
  }

  /// Time that the legs of x may stay, for a torque band that may be wider than A.
  T stay(const Point& x, const Point& d, T band) const {
    T t = torque_exit(x.e, d.e, band, T(1));
    for (int k = 0; k < N; ++k) {
      if (x.level[k] < lowest[k] || x.level[k] > highest[k]) return T(0);
      if (phases[k].idle) continue;
      if (x.level[k] < highest[k] && d.away[k] < T(0)) {
        t = min(t, max((-slack[k] - x.away[k]) / d.away[k], T(0)));
      } else if (x.level[k] > lowest[k] && d.away[k] > T(0)) {
        t = min(t, max((slack[k] - x.away[k]) / d.away[k], T(0)));
      }
    }
    return t;
  }

  static void advance(Point& x, const Point& d, T t) {
    x.e = x.e + d.e * t;
    for (int k = 0; k < N; ++k) x.away[k] = x.away[k] + d.away[k] * t;
  }

  /// Integral of e^2 over a time t.
  static T squared(T e, T slope, T t) {
    const T end = e + slope * t;
    return t * (e * e + e * end + end * end) / T(3);
  }

  /// Leg levels between two combinations; a turn-on is one level up, a turn-off one down.
  static int distance(const std::array<int, N>& from, const std::array<int, N>& to) {
    int levels = 0;
    for (int k = 0; k < N; ++k) levels += to[k] > from[k] ? to[k] - from[k] : from[k] - to[k];
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
    if (!leaves(torque_exit(x.e, d.e, A, pulse))) return dwell(x, d);
    const T outside = max(abs(x.e) - A, T(0));
    return outside / (T(4) * A) * pulse * (x.e * x.e - A * A) / T(2);
  }

  bool leaves(T exit) const { return exit < pulse / T(20); }

  /// What the flux linkages cost that a pulse with these legs leads to.
  T flux_cost(const Point& x, const Point& d) const {
    T sum = T(0);
    for (int k = 0; k < N; ++k) {
      if (phases[k].idle) continue;
      const T away = (x.away[k] + d.away[k] * pulse) / slack[k];
      sum = sum + away * away;
    }
    return w_flux * A * A * pulse * sum;
  }

  /// Best legs to go on with. A phase with two edges behind it keeps its leg; `other` asks for a
  /// change in any case.
  std::array<int, N> best(Point x, const std::array<int, N>& edges, bool other) const {
    const std::array<int, N> last = x.level;
    std::array<int, N> found = last;
    T least = T(1e30);
    x.level = lowest;
    for (bool more = true; more;) {
      bool possible = true;
      for (int k = 0; k < N; ++k) {
        if (x.level[k] != last[k] && edges[k] >= 2) possible = false;
      }
      const int levels = distance(last, x.level);
      if (possible && !(other && levels == 0)) {
        const Point d = slopes(x.level);
        const T cost = dwell(x, d) + flux_cost(x, d) + w_sw / T(2) * static_cast<T>(levels);
        if (cost < least) {
          least = cost;
          found = x.level;
        }
      }
      more = false;
      for (int k = 0; k < N && !more; ++k) {  // count up, phase by phase
        more = x.level[k] < highest[k];
        x.level[k] = more ? x.level[k] + 1 : lowest[k];
      }
    }
    return found;
  }
};

}  // namespace srm
