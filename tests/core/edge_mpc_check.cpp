// Predictive torque control in a closed loop with the machine that it knows: mean torque, ripple
// and turn-ons are those of its own rule (edge_plan.hpp), in every quadrant, short or long sample.
#include <cmath>
#include <vector>

#include "errors.hpp"
#include "sharing_guide.hpp"
#include "srm/control/law/edge_mpc.hpp"
#include "within.hpp"

using namespace srm;
using sharing_guide::columns, sharing_guide::machine, sharing_guide::rows, sharing_guide::tau_max;

namespace {

constexpr int N = 3;
constexpr double R = 0.72, u_dc = 540, f_switch = 6000;
using M = LeHuy<double>;
using Law = EdgeMpc<M, N>;

/// The flux linkages of a sharing function: no ripple.
struct Guide {
  std::vector<double> values = sharing_guide::values();
  double omega = 30, slack = 0.01;
  ReferenceProfile<double> profile() const {
    return {{{values.data(), rows * columns}, rows, columns, tau_max}, {&omega, 1}, u_dc, 0};
  }
  Law law(double T_s, int delay, double w_sw) const {
    return {.machine = machine(),
            .guide = profile(),
            .w_sw = w_sw,
            .psi_slack = {&slack, 1},
            .R = R,
            .i_max = 120,
            .T_s = T_s,
            .delay = delay};
  }
};

struct Outcome {
  double mean = 0, rms = 0,
         turn_ons = 0;             // [N m], [N m] about the reference, per switch and second
  double i_peak = 0, t_reach = 0;  // time to 95 % of a step
};

/// A run at a held speed: each winding by small steps of its flux linkage.
Outcome run(const Law& law, double omega_m, double tau_ref, double from, double to,
            double step_to = 0) {
  Law::State x;
  std::array<double, N> psi{}, i{};
  Command<double, N> acting{}, next{};
  std::array<Leg, N> leg;
  leg.fill(Leg::demagnetize);
  Outcome out;
  constexpr double dt = 5e-7;
  const int steps = static_cast<int>(law.T_s / dt + 0.5), samples = static_cast<int>(to / law.T_s);
  double theta_m = 0.05, count = 0;
  for (int n = 0; n < samples; ++n) {
    const double t = n * law.T_s, reference = step_to != 0 && t >= from ? step_to : tau_ref;
    const Measurement<double, N> y{
        .i = i, .theta_e = wrap(4 * theta_m), .omega_m = omega_m, .u_dc = u_dc};
    const Command<double, N> ordered = law.step(x, y, reference);
    acting = law.delay > 0 ? next : ordered;
    next = ordered;
    for (int s = 0; s < steps; ++s) {
      const double theta_e = wrap(4 * theta_m);
      double tau = 0;
      for (int k = 0; k < N; ++k) {
        int edge = 0;
        while (edge < max_edges && (s + 0.5) * dt >= acting[k].t_edge[edge]) ++edge;
        const Leg now = acting[k].leg[edge];
        if (t >= from)
          out.turn_ons += std::max(static_cast<int>(now) - static_cast<int>(leg[k]), 0);
        leg[k] = now;
        const auto m = machine().at(i[k], phase_angle<N>(theta_e, k));
        psi[k] = std::fmax(psi[k] + dt * (static_cast<int>(now) * u_dc - R * i[k]), 0);
        i[k] = std::fmax(i[k] + (psi[k] - m.psi) / m.L_inc, 0);
        tau += m.tau;
        out.i_peak = std::fmax(out.i_peak, i[k]);
      }
      theta_m += dt * omega_m;
      if (t < from) continue;
      if (step_to != 0 && out.t_reach == 0 && tau / step_to > 0.95) out.t_reach = t + s * dt - from;
      out.mean += tau;
      out.rms += (tau - reference) * (tau - reference);
      count += 1;
    }
  }
  out.mean /= count;
  out.rms = std::sqrt(out.rms / count);
  out.turn_ons /= (to - from) * 2 * N;
  return out;
}

struct Worst {
  double mean = 0, ripple = 0, frequency = 0;
};

/// In all quadrants, with a short and a long sample, with delay and without: the same ripple. Legs
/// that switch for two phases at once make the frequency a tenth lower than asked for; at this
/// speed a braking torque falls by the back-EMF alone, which takes a third of the turn-ons.
Worst in_all_quadrants(const Guide& guide, double w_sw) {
  Worst worst;
  for (double T_s : {5e-6, 20e-6}) {
    for (int delay : {0, 1}) {
      for (double omega : {30.0, -30.0}) {
        for (double tau : {20.0, -20.0}) {
          const Outcome o = run(guide.law(T_s, delay, w_sw), omega, tau, 0.02, 0.075);
          worst.mean = worst_of({worst.mean, off(o.mean, tau)});
          worst.ripple = worst_of({worst.ripple, off(o.rms, 0.224)});
          const double asked = omega * tau > 0 ? 0.9 : 0.303;
          worst.frequency = worst_of({worst.frequency, off(o.turn_ons / f_switch, asked)});
        }
      }
    }
  }
  return worst;
}

/// From 5 N m to 35 N m: as fast as all of the voltage takes it, a sample later with a delay.
double steps(const Guide& guide, double w_sw) {
  double t[2];
  for (int delay : {0, 1}) {
    const Outcome s = run(guide.law(20e-6, delay, w_sw), 30, 5, 0.03, 0.06, 35);
    t[delay] = s.t_reach;
    if (!(s.i_peak < 97)) return HUGE_VAL;
  }
  return worst_of({off(t[0], 190e-6), off(t[1], t[0] + 20e-6)});
}

/// Nothing is asked for.
double no_torque(const Guide& guide, double w_sw) {
  const Outcome none = run(guide.law(20e-6, 1, w_sw), 30, 0, 0, 0.01);
  return worst_of({none.i_peak, none.turn_ons});
}

}  // namespace

/// 0.224 N m and 190 us are what this program found (2026-11-27); the frequency follows from w_sw.
int main() {
  const Guide guide;
  const double w_sw =
      switching_weight(machine(), guide.profile().at(20, 30, u_dc), R, 30.0, u_dc, 150.0, f_switch);
  const Worst worst = in_all_quadrants(guide, w_sw);
  check("mean torque of 20 N m [N m]", worst.mean, 0.01);
  check("ripple of 0.224 N m rms [N m]", worst.ripple, 0.005);
  check("turn-ons, a tenth less than asked for [of them]", worst.frequency, 0.02);
  check("a step of the torque in 190 us [s]", steps(guide, w_sw), 6e-6);
  check("no torque asked for: no current, no turn-on", no_torque(guide, w_sw), 0);
  const Outcome fast = run(guide.law(20e-6, 1, w_sw), 250, 38, 0.02, 0.05);
  check("38 N m at eight times the speed [N m]", off(fast.mean, 38), 0.05);
  check("and the greatest current, at its limit of 120 A [A]", fast.i_peak, 125);
  return failures == 0 ? 0 : 1;
}
