// What a timer order adds to the flux linkage of a winding, by what the control knows of the
// converter: a switch turns on later than ordered by the dead time, and each device on the way
// takes its threshold voltage.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/frame/interface.hpp"

namespace srm {

/// Of one sample and phase.
template <Real T>
struct OrderFlux {
  T level{};       // seconds per volt of the dc link [s]
  T drop{};        // volt-seconds that the devices take [V s]
  T idle_level{};  // the same, up to the first magnetizing: without current nothing of it counts
  T idle_drop{};
  bool magnetizes = false;
  Leg leg = Leg::demagnetize;  // at the end
};

/// The converter as the control believes it to be: two switches and two diodes a phase.
template <Real T>
struct Drops {
  T t_dead;    // from the order to turn on until a switch is on [s]
  T v_switch;  // thresholds of a switch and of a diode [V]
  T v_diode;
  SRM_FIELDS(t_dead, v_switch, v_diode)

  /// before: the leg at the end of the last order.
  constexpr OrderFlux<T> of(const PhaseCommand<T>& c, Leg before, T T_s) const {
    OrderFlux<T> sum;
    sum.leg = before;
    T from = T(0);
    const auto stay = [&](T to) {
      if (sum.leg == Leg::magnetize && !sum.magnetizes && to > from) {
        sum.magnetizes = true;
        sum.idle_level = sum.level;
        sum.idle_drop = sum.drop;
      }
      const T length = to - from;
      const T switches = T(1) + static_cast<T>(static_cast<int>(sum.leg));
      sum.level = sum.level + static_cast<T>(static_cast<int>(sum.leg)) * length;
      sum.drop = sum.drop + (switches * v_switch + (T(2) - switches) * v_diode) * length;
      from = to;
    };
    T t = T(0);
    for (int n = 0; n <= max_edges && t < T_s; ++n) {
      if (c.leg[n] != sum.leg) {
        stay(clamp(c.leg[n] > sum.leg ? t + t_dead : t, from, T_s));
        sum.leg = c.leg[n];
      }
      if (n < max_edges) t = c.t_edge[n];
    }
    stay(T_s);
    return sum;
  }
};

}  // namespace srm
