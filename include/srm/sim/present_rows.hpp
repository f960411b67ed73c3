// The present instant of a loop as a row of the tables.
#pragma once

#include "srm/sim/simulation_state.hpp"

namespace srm {

/// A row of the waveforms.
template <Motor M, int N>
Waveform<N> waveform(const Plant<M, N>& plant, const SimulationState<N>& now) {
  State<N> x = now.x();
  Waveform<N> row{.t = now.t,
                  .theta_m = x.theta_m,
                  .omega_m = x.omega_m,
                  .u_dc = x.u_dc,
                  .tau_ref = now.tau_ref};
  for (int k = 0; k < N; ++k) {
    const PhaseStep& phase = now.phase_steps[k];
    if (!phase.active) continue;
    x.i[k] = phase.current(now.t, plant.machine, electrical_angle(plant, x.theta_m, k));
  }
  row.i = x.i;
  for (int k = 0; k < N; ++k) {
    row.i_ref[k] = now.gates.command[k].i_ref;
    row.leg[k] = static_cast<double>(now.legs[k]);
    if (!conducts(now.legs[k], x.i[k])) continue;
    const double theta_e = electrical_angle(plant, x.theta_m, k);
    const Magnetics<double> m = plant.machine.at(x.i[k], theta_e);
    row.u[k] = winding_voltage(plant, now.circuit, x, k);
    row.psi[k] = m.psi;
    row.tau_ph[k] = m.tau;
    row.tau += m.tau;
  }
  for (int n = 0; n < plant.coupling.n_pairs(); ++n) {
    const int a = plant.coupling.first[n], b = plant.coupling.second[n];
    const double theta_e = electrical_angle(plant, x.theta_m, 0);
    const PairMagnetics<double> m = plant.coupling.at(n, x.i[a], x.i[b], theta_e);
    row.psi[a] += m.psi_first;
    row.psi[b] += m.psi_second;
    row.tau_ph[a] += m.tau / 2;
    row.tau_ph[b] += m.tau / 2;
    row.tau += m.tau;
  }
  return row;
}

/// A row of the periods: the integrals so far, and the extremes since the last one. What switches
/// where a period ends belongs to the next one.
template <Motor M, int N>
Period<N> period(const Plant<M, N>& plant, const SimulationState<N>& now) {
  const State<N>& x = now.x();
  Extremes extremes = now.extremes;
  extremes.include(waveform(plant, now));
  return {.t = now.t,
          .theta_m = x.theta_m,
          .omega_m = x.omega_m,
          .W_f = field_energy(plant, x),
          .W_dc = stored(plant.source, x.u_dc),
          .switchings = now.period_ends() ? now.before_end : now.switchings,
          .extremes = extremes,
          .integrals = now.sums};
}

}  // namespace srm
