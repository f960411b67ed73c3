// Where a step begins: which phases flow, their magnetics, and the rates of all.
#pragma once

#include "srm/sim/broken.hpp"
#include "srm/sim/opening.hpp"

namespace srm {

/// The magnetics of all phases once more, now that phase k flows. The flux linkages of the others
/// stay what they were integrated to: a phase without current adds nothing to them.
template <Motor M, int N>
void join(const Plant<M, N>& plant, SimulationState<N>& now, PairPieces& pieces, int k) {
  Instant<N>& at = now.at();
  const Jets<N> before = at.jets;
  evaluate(plant, at.x, now.circuit.flows, pieces, at.jets, at.links);
  for (int l = 0; l < N; ++l) {
    if (l != k) at.jets[l].psi = before[l].psi;
  }
}

/// Phase k begins to carry current, with its magnetics, or ceases to.
template <Motor M, int N>
void flow(const Plant<M, N>& plant, SimulationState<N>& now, PairPieces& pieces, int k) {
  const bool flows = !now.circuit.flows[k];
  now.circuit.flows[k] = flows;
  if (flows) {
    const State<N>& x = now.x();
    const double theta_e = electrical_angle(plant, x.theta_m, k);
    now.phase_steps[k].end.m = now.at().jets[k] = plant.machine.jet(x.i[k], theta_e);
    if (plant.coupling.any()) join(plant, now, pieces, k);
  }
  now.rated = false;
}

template <Motor M, int N>
void rate_here(const Plant<M, N>& plant, SimulationState<N>& now) {
  Instant<N>& at = now.at();
  rates(plant, at.x, at.jets, at.links, now.circuit, {now.t, now.t}, at.rates);
  now.rated = true;
}

/// Which phases flow, where they couple: those with current, and those where the voltage of the
/// leg and of the others would drive one through the diodes or the switches.
template <Motor M, int N>
void flow_together(const Plant<M, N>& plant, SimulationState<N>& now, PairPieces& pieces,
                   double i_small) {
  for (int k = 0; k < N; ++k) {
    if ((now.x().i[k] > 0) != now.circuit.flows[k]) flow(plant, now, pieces, k);
    if (now.circuit.leaks) divide(plant, now, k, i_small);
  }
  if (now.rated) return;  // none opened by the end of the last step, and nothing has changed
  for (bool more = true; more;) {  // one that opens may open another
    if (!now.rated) rate_here(plant, now);
    std::array<bool, N> opens{};
    for (int k = 0; k < N; ++k) {
      opens[k] = may_open(plant, now.circuit, pieces, now.at(), k) &&
                 opening(plant, now.circuit, pieces, now.at(), k) > 0;
    }
    more = false;
    for (int k = 0; k < N; ++k) {
      if (opens[k]) flow(plant, now, pieces, k);
      more = more || opens[k];
    }
  }
}

/// Magnetics and rates at the start of a step. i_small: as of `divide`.
template <Motor M, int N>
StepStart<N> step_start(const Plant<M, N>& plant, SimulationState<N>& now, PairPieces& pieces,
                        double i_small) {
  Circuit<N>& circuit = now.circuit;
  const State<N>& x = now.x();
  const bool coupled = plant.coupling.any();
  if (coupled) flow_together(plant, now, pieces, i_small);
  for (int k = 0; k < N && !coupled; ++k) {
    if (conducts(now.legs[k], x.i[k]) != circuit.flows[k]) flow(plant, now, pieces, k);
    if (circuit.leaks) divide(plant, now, k, i_small);
  }
  const bool shorted = x.u_dc <= 0 && source_now(plant, circuit, x, now.t).du_dc.now < 0;
  if (shorted != circuit.shorted) now.rated = false;
  circuit.shorted = shorted;
  if (!now.rated) rate_here(plant, now);
  StepStart<N> s{.circuit = circuit, .pieces = pieces, .t = now.t, .d2i = {}};
  const Instant<N>& at = now.at();
  const Rates<N>& r = at.rates;
  if (coupled) {
    s.d2i = bends<N>(circuit.flows, at.jets, at.links, r.i, r.v, r.omega_m);
    return s;
  }
  for (int k = 0; k < N; ++k) {
    if (circuit.flows[k]) s.d2i[k] = bend(at.jets[k], r.i[k], r.v[k], r.omega_m);
  }
  return s;
}

}  // namespace srm
