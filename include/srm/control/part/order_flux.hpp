// What a timer order adds to the flux linkage of a winding, by what the control knows of the
// converter: a switch turns on later than ordered by the dead time, and each device on the way
// takes its threshold voltage.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/interface/interface.hpp"

namespace srm {

/// Of one sample and phase.
template <Real T>
struct OrderFlux {
  T level{};       // seconds per volt of the dc link [s]
  T drop{};        // volt-seconds that the devices take [V s]
  T idle_level{};  // the same, up to the first magnetizing: without current nothing of it counts
  T idle_drop{};
  bool magnetizes = false;
};

/// A leg as the orders so far have left it.
template <Real T>
struct LateLeg {
  Leg ordered = Leg::demagnetize;
  std::array<T, 2> t_on{};  // from when levels 0 and 1 are reached, of those that are ordered [s]
  bool late = false;        // one of them is not yet
};

/// The converter as the control believes it to be: two switches and two diodes a phase.
template <Real T>
struct Drops {
  T t_dead;    // from the order to turn on until a switch is on [s]
  T v_switch;  // thresholds of a switch and of a diode [V]
  T v_diode;
  SRM_FIELDS(t_dead, v_switch, v_diode)

  /// True where the leg is as it was, for the whole sample.
  static constexpr bool stays(const PhaseCommand<T>& c, const LateLeg<T>& x, T T_s) {
    return c.leg[0] == x.ordered && !x.late && !(c.t_edge[0] < T_s);
  }

  /// One leg for a whole sample.
  constexpr OrderFlux<T> held(Leg leg, T T_s) const {
    OrderFlux<T> sum;
    add(sum, T(0), leg < Leg::freewheel ? T_s : T(0), leg < Leg::magnetize ? T_s : T(0), T_s);
    sum.drop = drop_of(sum.level, T_s);
    return sum;
  }

  /// An order as it is sent.
  constexpr OrderFlux<T> of(const PhaseCommand<T>& c, LateLeg<T>& x, T T_s) const {
    OrderFlux<T> sum;
    T t = T(0);
    for (int n = 0; n <= max_edges && t < T_s; ++n) {
      const T next = n < max_edges ? min(c.t_edge[n], T_s) : T_s;
      if (!(next > t)) continue;  // left at once: never ordered
      for (int level = 0; level < 2 && t_dead > T(0); ++level) {
        if (reaches(c.leg[n], level) && !reaches(x.ordered, level)) x.t_on[level] = t + t_dead;
      }
      x.ordered = c.leg[n];
      const T freewheels = start_of(x, 0, t, next);
      add(sum, t, freewheels, start_of(x, 1, freewheels, next), next);
      t = next;
    }
    sum.drop = drop_of(sum.level, T_s);
    x.late = false;
    for (int level = 0; level < 2 && t_dead > T(0); ++level) {
      x.t_on[level] = x.t_on[level] - T_s;
      x.late = x.late || (reaches(x.ordered, level) && x.t_on[level] > T(0));
    }
    return sum;
  }

 private:
  static constexpr bool reaches(Leg leg, int level) { return static_cast<int>(leg) >= level; }

  /// From when the leg is at a level, between from and to; to: not before then.
  constexpr T start_of(const LateLeg<T>& x, int level, T from, T to) const {
    if (!reaches(x.ordered, level)) return to;
    return t_dead > T(0) ? clamp(x.t_on[level], from, to) : from;
  }

  /// A time from t to next in which the leg rises to freewheel and to magnetize.
  constexpr void add(OrderFlux<T>& sum, T t, T freewheels, T magnetizes, T next) const {
    sum.level = sum.level - (freewheels - t);
    if (!(next > magnetizes)) return;
    if (!sum.magnetizes) {
      sum.magnetizes = true;
      sum.idle_level = sum.level;
      sum.idle_drop = drop_of(sum.level, magnetizes);
    }
    sum.level = sum.level + (next - magnetizes);
  }

  /// What the devices take in a time t, with level its mean times t: two diodes where the leg
  /// demagnetizes, a switch and a diode where it freewheels, two switches where it magnetizes.
  constexpr T drop_of(T level, T t) const {
    return (v_switch + v_diode) * t + (v_switch - v_diode) * level;
  }
};

}  // namespace srm
