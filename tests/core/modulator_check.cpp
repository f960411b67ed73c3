// The modulator against the duty cycle that it is given, with and without a dead time ahead.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "srm/control/frame/dead_time_compensation.hpp"
#include "srm/control/part/modulator.hpp"

using namespace srm;

namespace {

/// Mean voltage of a modulated sample in units of u_dc, by summing its intervals.
double mean_voltage(const PhaseCommand<double>& c, double T_s) {
  double sum = 0, from = 0;
  for (int n = 0; n <= max_edges; ++n) {
    const double to = n < max_edges ? min(c.t_edge[n], T_s) : T_s;
    sum += static_cast<int>(c.leg[n]) * (to - from);
    from = to;
  }
  return sum / T_s;
}

/// The largest error of a duty cycle; and of one whose turn-ons are ordered ahead of a dead time,
/// and are late by it, where the pulse leaves room for that.
double worst_modulation() {
  const double T_s = 50e-6, t_dead = 1e-6;
  double worst = 0;
  for (int k = 0; k < 5; ++k) {
    for (Carriers carriers : {Carriers::in_phase, Carriers::interleaved}) {
      for (int n = -120; n <= 120; ++n) {
        const PhaseCommand<double> c =
            modulate(n / 100.0, T_s, pulse_centre<5, double>(carriers, k));
        const double duty = clamp(n / 100.0, -1.0, 1.0);
        worst = std::fmax(worst, std::fabs(mean_voltage(c, T_s) - duty));
        Command<double, 1> early{c};
        lead_turn_on<double, 1>(early, t_dead);
        PhaseCommand<double> late = early[0];
        bool room = true;
        for (int j = 0; j < max_edges; ++j) {
          if (c.leg[j + 1] <= c.leg[j]) continue;
          late.t_edge[j] += t_dead;
          room = room && c.t_edge[j] - (j > 0 ? c.t_edge[j - 1] : 0) > t_dead;
        }
        if (room) worst = std::fmax(worst, std::fabs(mean_voltage(late, T_s) - duty));
        for (const PhaseCommand<double>& order : {c, early[0]}) {
          const auto& t = order.t_edge;
          if (t[0] < 0 || !std::is_sorted(t.begin(), t.end())) worst = HUGE_VAL;
        }
      }
    }
  }
  return worst;
}

}  // namespace

int main() {
  const double worst = worst_modulation();
  std::printf("mean voltage against duty: %.3g\n", worst);
  return worst <= 1e-12 ? 0 : 1;
}
