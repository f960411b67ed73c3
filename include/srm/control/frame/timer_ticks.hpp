// Timer orders as a timer takes them: integer ticks, one list of edges for each of the two switches
// of a leg.
//
// Magnetize closes both switches, demagnetize opens both, freewheel opens one of them: the upper
// one in even periods and the lower one in odd ones, so that both share the losses. The edge that
// makes a leg freewheel and the one that ends it move the same switch. A change of role between two
// periods moves both switches at the start of a period, and costs no voltage.
#pragma once

#include <array>
#include <cstdint>

#include "srm/control/interface/interface.hpp"

namespace srm {

/// One switch over a period: its level at the start, and the ticks at which it changes, rising.
struct SwitchEdges {
  std::uint8_t on = 0;
  std::uint8_t count = 0;
  std::array<std::uint16_t, max_edges> tick{};
};

struct LegEdges {
  SwitchEdges upper, lower;
};

/// Which of the switches opens to freewheel.
enum class Freewheel : std::uint8_t { upper_opens, lower_opens };

constexpr bool closed(Leg leg, bool opens_to_freewheel) {
  return leg == Leg::magnetize || (leg == Leg::freewheel && !opens_to_freewheel);
}

/// An instant in ticks, to the nearest; `period` ticks where it does not come.
template <Real T>
constexpr int ticks_of(T t, T ticks_per_s, int period) {
  const T tick = t * ticks_per_s + T(0.5);
  if (!(tick < static_cast<T>(period))) return period;  // NaN and `never` too
  return tick > T(0) ? static_cast<int>(tick) : 0;
}

/// The edges of a switch. An interval that rounds to no ticks does not exist.
template <Real T>
constexpr SwitchEdges switch_edges(const PhaseCommand<T>& c, bool opens, T ticks_per_s,
                                   int period) {
  const bool runs = c.gate == Gate::timer;  // a comparator order has no edges: off at the start
  SwitchEdges edges;
  bool now = runs && closed(c.leg[0], opens);
  edges.on = now ? 1 : 0;
  for (int n = 0; runs && n < max_edges; ++n) {
    const int tick = ticks_of(c.t_edge[n], ticks_per_s, period);
    if (tick >= period) break;
    const bool next = closed(c.leg[n + 1], opens);
    if (next == now) continue;
    now = next;
    if (edges.count > 0 && edges.tick[edges.count - 1] == tick) {
      --edges.count;
    } else if (tick == 0) {
      edges.on = now ? 1 : 0;
    } else {
      edges.tick[edges.count] = static_cast<std::uint16_t>(tick);
      ++edges.count;
    }
  }
  return edges;
}

template <Real T>
constexpr LegEdges leg_edges(const PhaseCommand<T>& c, Freewheel freewheel, T ticks_per_s,
                             int period) {
  const bool upper_opens = freewheel == Freewheel::upper_opens;
  return {switch_edges(c, upper_opens, ticks_per_s, period),
          switch_edges(c, !upper_opens, ticks_per_s, period)};
}

}  // namespace srm
