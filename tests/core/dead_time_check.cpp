// Dead time against algebra: a winding of constant inductance with the rotor held, where
// volt-seconds are current times inductance.
#include <cmath>
#include <cstdio>

#include "coil.hpp"
#include "srm/control/frame/dead_time_compensation.hpp"
#include "srm/control/part/modulator.hpp"
#include "srm/sim/simulation.hpp"

using namespace srm;

namespace {

constexpr double L = Coil{}.L, u_dc = 200, T_s = 50e-6, dead = 2e-6;  // [H], [V], [s], [s]

struct Outcome {
  double i = 0, i_min = 1e300;  // at the end; least after the first half [A]
  double turn_ons = 0;
};

/// A run of n samples in which sample number j gets order(j).
template <class Order>
Outcome run(Order order, int n, double R = 0, double dt_max = 10e-6, double dead_time = dead) {
  const Plant<Coil, 1> plant{.machine = Coil{},
                             .R = R,
                             .source = StiffSource{constant(u_dc)},
                             .bridge = AsymmetricBridge{},
                             .shaft = {.omega = constant(0)}};
  int sample = 0;
  Controller<1> controller = [&](const Measurement<double, 1>&, double) {
    return Orders<1>{.command = {order(sample++)}, .tau_ref = 0};
  };
  Simulation<Coil, 1> loop(plant, dead_time, {.T_s = T_s}, controller, constant(0), 0,
                           {dt_max, {100, u_dc}, 0});
  Rows waveforms(columns_of(Waveform<1>{}), 100000), periods(columns_of(Period<1>{}), 10);
  loop.advance(n * T_s, waveforms, periods);
  loop.record(waveforms);
  loop.close_period(periods);
  Outcome out;
  for (int row = 0; row < waveforms.size(); ++row) {
    out.i = waveforms.row<Waveform<1>>(row).i[0];
    if (row > waveforms.size() / 2) out.i_min = std::fmin(out.i_min, out.i);
  }
  out.turn_ons = periods.row<Period<1>>(0).switchings.turn_ons;
  return out;
}

int failures = 0;

void check(const char* law, double found, double expected, double tolerance) {
  const bool ok = std::fabs(found - expected) <= tolerance;
  std::printf("%s %-62s %.9g, expected %.9g\n", ok ? "ok  " : "FAIL", law, found, expected);
  if (!ok) ++failures;
}

}  // namespace

int main() {
  const Leg up = Leg::magnetize, zero = Leg::freewheel, down = Leg::demagnetize;
  constexpr double amperes = u_dc / L;  // per second of full voltage

  // One turn-on a period takes t_dead u_dc from its volt-seconds.
  const auto raised = run([&](int) { return pulse(zero, up, 10e-6, 30e-6); }, 10);
  check("pulses of +u_dc are shorter by the dead time", raised.i, amperes * 10 * (20e-6 - dead),
        1e-9);
  check("one turn-on a pulse, and the first to freewheel", raised.turn_ons, 11, 0);
  const auto lowered =
      run([&](int j) { return j < 10 ? hold<double>(up) : pulse(zero, down, 10e-6, 30e-6); }, 15);
  check("pulses of -u_dc are longer by it", lowered.i,
        amperes * (10 * T_s - dead - 5 * (20e-6 + dead)), 1e-9);
  check("both switches turn on together, then one a pulse", lowered.turn_ons, 2 + 5, 0);

  // Falls back in time.
  const auto cancelled = run([&](int) { return pulse(zero, up, 10e-6, 10e-6 + 0.9 * dead); }, 10);
  check("a pulse shorter than the dead time makes no current", cancelled.i, 0, 0);
  check("and turns nothing on", cancelled.turn_ons, 1, 0);
  const auto notch = run(
      [&](int j) { return j < 10 ? hold<double>(up) : pulse(up, zero, 10e-6, 10e-6 + 0.5 * dead); },
      15);
  check("a gap, however short, lasts the dead time longer", notch.i,
        amperes * (15 * T_s - dead - 5 * 1.5 * dead), 1e-9);

  // A switch that is already on its way does not start again.
  const auto step = run(
      [&](int) {
        PhaseCommand<double> rise = hold<double>(up);
        rise.leg[0] = down;
        rise.leg[1] = zero;
        rise.t_edge[0] = 10e-6;
        rise.t_edge[1] = 10e-6 + dead / 2;
        return rise;
      },
      1);
  check("each switch waits for itself", step.i, amperes * (40e-6 - 1.5 * dead), 1e-9);
  check("each switch counts once", step.turn_ons, 2, 0);

  // A hysteresis comparator turns off at once and on late: only the lower bound is passed.
  const auto regulated = [&](int) {
    auto order = regulate(5.0, 0.5, down);
    set_thresholds(order, Comparators::analog);
    return order;
  };
  const auto held = run(regulated, 40);
  check("the current falls below its band by t_dead u_dc/L", held.i_min, 4.5 - amperes * dead,
        1e-9);

  // With resistance the mean current is the mean voltage over it, and steps do not matter.
  const double R = 20;
  const auto fixed = [&](int) { return pulse(zero, up, 10e-6, 30e-6); };
  const auto coarse = run(fixed, 200, R, 10e-6), fine = run(fixed, 200, R, 0.7e-6);
  check("steps do not matter", coarse.i, fine.i, 1e-7);
  const double q = std::exp(-R / L * T_s), on = 20e-6 - dead;
  const double after = 20e-6;  // until the period's end
  const double i_end = u_dc / R * (1 - std::exp(-R / L * on)) * std::exp(-R / L * after) / (1 - q);
  check("R-L response in steady state", fine.i, i_end, 1e-6);

  // Turn-ons of a modulator are ordered early by what the converter is late; all but the first, of
  // `up`.
  double worst = 0, worst_plain = 0;
  for (const double duty : {0.02, 0.37, 0.7, -0.37, -0.9}) {
    for (const double centre : {0.1, 0.5, 0.9}) {
      const auto end = [&](double t_dead, double dead_time) {
        const auto order = [&](int j) {
          Command<double, 1> c{j < 20 ? hold<double>(up) : modulate(duty, T_s, centre)};
          lead_turn_on<double, 1>(c, t_dead);
          return c[0];
        };
        return run(order, 40, 0, 10e-6, dead_time).i;
      };
      const double ideal = end(0, 0) - amperes * dead;
      const double lost = 20 * amperes * std::fmin(dead, duty > 0 ? duty * T_s : dead);
      worst = std::fmax(worst, std::fabs(end(dead, dead) - ideal));
      worst_plain = std::fmax(worst_plain, std::fabs(end(0, dead) - (ideal - lost)));
    }
  }
  check("PWM that knows the dead time keeps its volt-seconds", worst, 0, 1e-9);
  check("PWM that does not loses it once a period", worst_plain, 0, 1e-9);
  return failures == 0 ? 0 : 1;
}
