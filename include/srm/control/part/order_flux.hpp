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
  Leg ordered = Leg::demagnetize, leg = Leg::demagnetize;  // leg: what the winding sees
  std::array<T, 2> t_on{};  // from when freewheel and magnetize can be reached [s]
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
    return c.leg[0] == x.leg && x.leg == x.ordered && !(c.t_edge[0] < T_s);
  }

  /// One leg for a whole sample.
  constexpr OrderFlux<T> held(Leg leg, T T_s) const {
    OrderFlux<T> sum;
    stay(sum, leg, T_s);
    return sum;
  }

  /// An order as it is sent.
  constexpr OrderFlux<T> of(const PhaseCommand<T>& c, LateLeg<T>& x, T T_s) const {
    OrderFlux<T> sum;
    T from = T(0), t = T(0);
    for (int n = 0; n <= max_edges && t < T_s; ++n) {
      const T next = n < max_edges ? min(c.t_edge[n], T_s) : T_s;
      if (!(next > t)) continue;  // left at once: never ordered
      for (int level = static_cast<int>(x.ordered) + 1; level <= static_cast<int>(c.leg[n]);
           ++level) {
        x.t_on[level] = t + t_dead;
      }
      x.ordered = c.leg[n];
      if (x.leg > x.ordered) x.leg = x.ordered;
      while (x.leg < x.ordered) {  // rises that fall due
        const int level = static_cast<int>(x.leg) + 1;
        if (!(x.t_on[level] <= next)) break;
        stay(sum, x.leg, max(x.t_on[level], from) - from);
        from = max(x.t_on[level], from);
        x.leg = static_cast<Leg>(level);
      }
      stay(sum, x.leg, next - from);
      from = t = next;
    }
    for (T& t_on : x.t_on) t_on = t_on - T_s;
    return sum;
  }

 private:
  constexpr void stay(OrderFlux<T>& sum, Leg leg, T length) const {
    if (!(length > T(0))) return;
    if (leg == Leg::magnetize && !sum.magnetizes) {
      sum.magnetizes = true;
      sum.idle_level = sum.level;
      sum.idle_drop = sum.drop;
    }
    const T level = static_cast<T>(static_cast<int>(leg));
    sum.level = sum.level + level * length;
    sum.drop = sum.drop + ((T(1) + level) * v_switch + (T(1) - level) * v_diode) * length;
  }
};

}  // namespace srm
