// A drive on the bench: its legs, sensors and encoder as somebody has wired them, between the plant
// and a commissioning routine.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "srm/base/angle.hpp"
#include "srm/control/commission/commission.hpp"
#include "srm/sim/controller.hpp"

namespace srm {

/// What somebody has wired. The plant's phases are in order; the controller has legs and channels.
template <int N>
struct Wires {
  std::array<int, N> phase{};   // that leg k drives
  std::array<int, N> sensor{};  // phase whose current channel k shows
  std::array<int, N> sign{};    // 1, or -1 where channel k shows it negative
  int direction = 1;            // of the encoder: -1 counts against the rotation
  double zero{};                // electrical angle that it shows at 0 [rad]
};

/// A commissioning routine in single precision, as on the target, and all that it shows.
template <int N>
struct Bench {
  Commission<float> routines;
  Wires<N> wires;
  typename Commission<float>::template State<N> state;
  std::vector<PulseRow<float>> rows;  // of the recording of the pulses

  Orders<N> step(const Measurement<double, N>& y) {
    Measurement<float, N> seen;
    for (int k = 0; k < N; ++k) {
      seen.i[k] = static_cast<float>(wires.sign[k] * y.i[wires.sensor[k]]);
    }
    seen.theta_e = wrap(static_cast<float>(wrap(wires.direction * y.theta_e + wires.zero)));
    seen.u_dc = static_cast<float>(y.u_dc);
    const Command<float, N> ordered = routines.step(state, seen);
    if (state.routine == Routine::pulses && state.finding == Finding::running &&
        state.pulses.row.pulse >= 0) {
      rows.push_back(state.pulses.row);
    }
    Orders<N> orders;
    for (int k = 0; k < N; ++k) {
      PhaseCommand<double>& order = orders.command[wires.phase[k]];
      order.leg = ordered[k].leg;
      order.gate = ordered[k].gate;
      for (int n = 0; n < max_edges; ++n) order.t_edge[n] = ordered[k].t_edge[n];
    }
    return orders;
  }
};

}  // namespace srm
