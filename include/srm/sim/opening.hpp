// Phases that couple: where one without current begins to conduct, by what the others induce in it.
#pragma once

#include <algorithm>
#include <limits>

#include "srm/sim/together.hpp"

namespace srm {

/// What drives a current through phase k, which has none, without the others [V].
template <int N>
double driving(const Circuit<N>& circuit, const Instant<N>& now, int k) {
  const Path& path = circuit.paths.phase[k];
  return path.level * now.x.u_dc - path.v - circuit.paths.R_shared * sum<N>(now.x.i);
}

/// The same, less what the others induce in it.
template <Machine M, int N>
double opening(const Plant<M, N>& p, const Circuit<N>& circuit, PairPieces& pieces,
               const Instant<N>& now, int k) {
  const double theta_e = electrical_angle(p, now.x.theta_m, 0);
  return driving(circuit, now, k) -
         induced<N>(p.coupling, pieces, circuit.flows, now.rates.i, theta_e, now.x.omega_m, k);
}

/// False where it cannot be above zero: spares its evaluation.
template <Machine M, int N>
bool may_open(const Plant<M, N>& p, const Circuit<N>& circuit, const PairPieces& pieces,
              const Instant<N>& now, int k) {
  return !circuit.flows[k] && may_open<N>(p.coupling, pieces, circuit.flows, now.rates.i,
                                          now.x.omega_m, k, driving(circuit, now, k));
}

/// Ends a step where a phase begins to conduct within it. True where one does.
template <Machine M, int N>
bool ends_on_opening(const Plant<M, N>& p, const Instant<N>& start, const StepStart<N>& s,
                     const Scale& scale, Trial& y, Instant<N>& end) {
  bool may = false;
  for (int k = 0; k < N; ++k) may = may || may_open(p, s.circuit, s.pieces, end, k);
  if (!may) return false;
  const auto opened = [&](const Instant<N>& now) {
    double most = -std::numeric_limits<double>::infinity();
    for (int k = 0; k < N; ++k) {
      if (!s.circuit.flows[k]) most = std::max(most, opening(p, s.circuit, s.pieces, now, k));
    }
    return most;
  };
  double after = opened(end);
  if (!(after > 0)) return false;
  double lower = 0, upper = y.h, before = opened(start);
  for (int round = 0; round < 60 && after > 1e-9 * scale.u_dc; ++round) {
    // Regula falsi, every third time the middle.
    const double part = round % 3 == 2 ? 0.5 : std::clamp(before / (before - after), 0.02, 0.98);
    const double h = lower + part * (upper - lower);
    if (!(h > lower && h < upper)) break;
    y = step(p, start, s, scale, h, Guard{}, h, end);
    const double now = opened(end);
    (now > 0 ? after : before) = now;
    (now > 0 ? upper : lower) = h;
  }
  if (y.h != upper) y = step(p, start, s, scale, upper, Guard{}, upper, end);
  return true;
}

}  // namespace srm
