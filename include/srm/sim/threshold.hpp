// The currents at which something happens to a phase: its comparator switches, its diodes block,
// or a table of its machine ends.
#pragma once

#include <algorithm>

#include "srm/sim/broken.hpp"
#include "srm/sim/guard.hpp"

namespace srm {

/// Of the current scale: a thousand times what rounding makes of a current that is zero.
inline constexpr double zero_current_part = 1e-12;

/// What the comparator of winding k is shown.
template <int N>
double compared_current(const SimulationState<N>& now, int k) {
  if (now.condition.sound) return now.x().i[k];
  const BrokenPhase& is = now.condition.phase[k];
  return now.compared[is.ordered].at(now.x().i[is.watched]);
}

/// The currents of winding k between which no comparator acts.
template <int N>
Span compared_span(const SimulationState<N>& now, int k) {
  if (now.condition.sound) return awaited(now.gates.command[k], now.gates.gate[k]);
  const int g = now.condition.watcher(k);
  const Line shows = now.compared[now.condition.phase[g].ordered];
  if (!(shows.slope > 0)) return {};
  const Span s = awaited(now.gates.command[g], now.gates.gate[g]);
  return {shows.inverse(s.below), shows.inverse(s.above)};
}

/// The currents between which nothing happens to phase k. i_scale: of the drive [A].
template <Motor M, int N>
Span span(const Plant<M, N>& plant, const SimulationState<N>& now, int k, double i_scale) {
  constexpr double kink_part = 1e-7;  // of the table: a current this near its end is on it
  const double i = now.x().i[k];
  const bool couples = plant.coupling.any();
  Span s = compared_span(now, k);
  const bool diodes = now.legs[k] != Leg::magnetize || couples;
  // Rounding may take the current of a phase that has just opened below zero: that is no event.
  const double blocks = i > 0 ? 0 : -zero_current_part * i_scale;
  if (diodes) s.below = std::max(s.below, blocks);
  if (now.circuit.leak[k].G > 0 && now.legs[k] != Leg::magnetize) {
    s.below = std::max(s.below, blocks_at(plant, now, k));
  }
  const auto meet = [&](double last) {
    const double gap = last - i;
    if (gap > kink_part * last) s.above = std::min(s.above, last);
    if (-gap > kink_part * last) s.below = std::max(s.below, last);
  };
  // The inductance has a kink there.
  if constexpr (requires { i_last(plant.machine); }) meet(i_last(plant.machine));
  if (couples) meet(i_last(plant.coupling));
  return s;
}

/// The current of winding met.k has met a guard: where that is a threshold of a comparator, its
/// gate orders the leg that follows, by t_on where switches turn on.
template <int N>
void compare(SimulationState<N>& now, const Guard& met, double t_on) {
  const Span span = compared_span(now, met.k);
  const bool above = met.direction > 0;
  if (met.value != (above ? span.above : span.below)) return;  // no current, or the table's end
  const int g = now.condition.sound ? met.k : now.condition.watcher(met.k);
  now.gates.order(g, after(now.gates.command[g], now.gates.gate[g], above), t_on);
}

}  // namespace srm
