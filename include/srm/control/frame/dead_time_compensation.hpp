// Compensation of a dead time: a switch that turns on late is ordered to turn on earlier.
#pragma once

#include "srm/control/interface/interface.hpp"

namespace srm {

/// Moves every turn-on inside the sample earlier by the dead time [s], but not past the edge before
/// it. A turn-on at the start of the sample stays: it is late, and the next sample sees what it
/// cost.
template <Real T, int N>
constexpr void lead_turn_on(Command<T, N>& orders, T t_dead) {
  for (PhaseCommand<T>& c : orders) {
    T earliest = T(0);
    for (int n = 0; n < max_edges; ++n) {
      if (c.leg[n + 1] > c.leg[n]) c.t_edge[n] = max(c.t_edge[n] - t_dead, earliest);
      earliest = c.t_edge[n];
    }
  }
}

}  // namespace srm
