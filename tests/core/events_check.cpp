// A run of plant and control from event to event: by steps of all phases and of each alone, whole
// and in pieces, with faults that algebra solves.
#include <cmath>
#include <functional>

#include "coil.hpp"
#include "errors.hpp"
#include "srm/sim/simulation.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr int N = 3;
constexpr double T_s = 50e-6;
constexpr Leg down = Leg::demagnetize, still = Leg::freewheel, up = Leg::magnetize;

using Run = Simulation<Coil, N>;

/// Comparators in windows, timers and open comparators in turns.
Orders<N> orders(int sample) {
  Orders<N> o{.command = {}, .tau_ref = 10.0 + sample % 3};
  for (int k = 0; k < N; ++k) {
    PhaseCommand<double> c = regulate(20.0 + k, 1.0, sample % 40 < 20 ? still : down);
    set_thresholds(c, Comparators::analog);
    if (sample % 100 < 60) c.gate = Gate::window;
    c.theta_on = -0.2;
    c.theta_off = 2.4;
    if (sample % 100 >= 80) {
      c = hold<double>(down);
      c.leg = {up, still, up, down, still};
      c.t_edge = {9e-6, 14e-6 + k * 1e-6, 25e-6, 40e-6};
    }
    o.command[k] = c;
  }
  return o;
}

Plant<Coil, N> plant(double omega, bool independent) {
  Plant<Coil, N> p{.machine = {.part = 0.8},
                   .R = 0.72,
                   .source = StiffSource{constant(240)},
                   .bridge = AsymmetricBridge{{1, 0.02, 0.7, 0.03}},
                   .shaft = {.omega = constant(omega)}};
  // A speed that changes by nothing that matters lets the phases step together.
  if (!independent) p.shaft.omega = {{0, 1e6}, {omega, omega + 1e-9}};
  return p;
}

struct Tables {
  Rows waveforms{columns_of(Waveform<N>{}), 4000}, periods{columns_of(Period<N>{}), 100};
};

Run run(double omega, bool independent, int& sample, double theta_m = 0.1) {
  Controller<N> controller = [&](const Measurement<double, N>&, double) {
    return orders(sample++);
  };
  return Run(plant(omega, independent), 2e-6, {.T_s = T_s, .delay = 1}, controller, constant(0),
             theta_m, {10e-6, {50, 240}, 37e-6});
}

double difference(const Waveform<N>& a, const Waveform<N>& b) {
  double worst =
      worst_of({1e3 * off(a.t, b.t), 10 * off(a.theta_m, b.theta_m), off(a.omega_m, b.omega_m),
                off(a.tau_ref, b.tau_ref), off(a.tau, b.tau)});
  for (int k = 0; k < N; ++k) {
    worst = worst_of({worst, off(a.i[k], b.i[k]), off(a.i_ref[k], b.i_ref[k]),
                      off(a.leg[k], b.leg[k]), off(a.u[k], b.u[k]), 10 * off(a.psi[k], b.psi[k]),
                      off(a.tau_ph[k], b.tau_ph[k])});
  }
  return worst;
}

double part(double a, double b, double least) {
  return std::fabs(a - b) / (std::fabs(a) + std::fabs(b) + least);
}

double difference(const Period<N>& a, const Period<N>& b) {
  const Integrals<N>&p = a.integrals, &q = b.integrals;
  const Extremes &e = a.extremes, &f = b.extremes;
  double worst = worst_of({1e3 * off(a.t, b.t),
                           off(a.theta_m, b.theta_m),
                           part(a.W_f, b.W_f, 1e-2),
                           off(a.switchings.turn_ons, b.switchings.turn_ons),
                           part(a.switchings.S_on, b.switchings.S_on, 1),
                           part(a.switchings.S_off, b.switchings.S_off, 1),
                           part(p.E_dc, q.E_dc, 1e-2),
                           part(p.E_source, q.E_source, 1e-2),
                           part(p.E_winding, q.E_winding, 1e-2),
                           part(p.E_mech, q.E_mech, 1e-2),
                           part(p.tau, q.tau, 1e-2),
                           part(p.tau_squared, q.tau_squared, 1e-1),
                           part(p.tau_ref, q.tau_ref, 1e-2),
                           part(p.error_squared, q.error_squared, 1e-1),
                           part(p.i_squared[1], q.i_squared[1], 1e-2),
                           part(p.i_cap, q.i_cap, 1e-2),
                           part(p.i_cap_squared, q.i_cap_squared, 1e-1),
                           off(e.omega_min, f.omega_min),
                           off(e.omega_max, f.omega_max),
                           off(e.u_min, f.u_min),
                           off(e.u_max, f.u_max)});
  // Which points of a torque and a current count as extremes depends on where steps end.
  return worst_of({worst, 1e-3 * part(e.tau_max, f.tau_max, 1),
                   1e-3 * part(e.tau_min, f.tau_min, 1), 1e-2 * part(e.i_peak, f.i_peak, 1)});
}

double difference(const Tables& a, const Tables& b) {
  if (a.waveforms.size() != b.waveforms.size() || a.periods.size() != b.periods.size())
    return HUGE_VAL;
  double worst = unless(a.waveforms.size() > 100 && a.periods.size() > 1);
  for (int j = 0; j < a.waveforms.size(); ++j) {
    worst = worst_of(
        {worst, difference(a.waveforms.row<Waveform<N>>(j), b.waveforms.row<Waveform<N>>(j))});
  }
  for (int j = 0; j < a.periods.size(); ++j) {
    worst = worst_of({worst, difference(a.periods.row<Period<N>>(j), b.periods.row<Period<N>>(j))});
  }
  return worst;
}

/// Each phase by steps of its own, and all by the same: in either direction.
double alone_and_together() {
  double worst = 0;
  for (double omega : {-150.0, 0.0, 90.0, 260.0}) {
    int n = 0, m = 0;
    Tables a, b;
    Run alone = run(omega, true, n), together = run(omega, false, m);
    alone.advance(0.05, a.waveforms, a.periods);
    together.advance(0.05, b.waveforms, b.periods);
    if (omega == 0) {  // no period ends
      for (int j = 0; j < 3; ++j) {
        alone.close_period(a.periods);
        together.close_period(b.periods);
      }
    }
    worst = worst_of({worst, difference(a, b), off(n, m), unless(alone.steps() > 600)});
  }
  return worst;
}

/// By many calls, from a state that was kept, and past looks at what lies between.
double in_pieces() {
  double worst = 0;
  for (bool independent : {false, true}) {
    int n = 0, m = 0;
    Tables whole, pieces, none;
    Run a = run(120, independent, n), b = run(120, independent, m);
    while (a.advance_whole(0.03, whole.waveforms, whole.periods) < 0.03) continue;
    for (double t = 0.0007; t < 0.03; t += 0.0007) {
      while (b.advance_whole(t, pieces.waveforms, pieces.periods) < t) continue;
      const auto kept = b.snapshot();
      b.peek(t);
      worst = worst_of({worst, off(b.t(), t), unless(!b.within_step())});
      b.restore(kept);
    }
    while (b.advance_whole(0.03, pieces.waveforms, pieces.periods) < 0.03) continue;
    worst = worst_of({worst, unless(difference(whole, pieces) == 0)});
    // Orders from outside at the samples are those of a controller.
    if (independent) {
      int j = 0;
      Run outside(plant(120, true), 2e-6, {.T_s = T_s, .delay = 1}, {}, constant(0), 0.1,
                  {10e-6, {50, 240}, -1});
      Run inside = run(120, true, j);
      for (int sample = 0; sample < 200; ++sample) {
        outside.obey(orders(sample));
        outside.advance((sample + 1) * T_s, none.waveforms, none.periods);
      }
      Tables c;
      inside.advance(200 * T_s, c.waveforms, c.periods);
      worst = worst_of({worst, difference(outside.waveform(), inside.waveform())});
    }
  }
  return worst;
}

/// The sensors show a step of the voltage and of the speed at its instant, before any order.
double sensed_at_a_step() {
  Plant<Coil, N> stepped = plant(120, true);
  stepped.source = StiffSource{{{0, 4 * T_s, 4 * T_s, 1e6}, {240, 240, 200, 200}}};
  stepped.shaft.omega = {{0, 7 * T_s, 7 * T_s, 1e6}, {120, 120, 90, 90}};
  Run outside(stepped, 2e-6, {.T_s = T_s}, {}, constant(0), 0.1, {10e-6, {50, 240}, -1});
  Tables none;
  double worst = 0;
  for (int sample = 0; sample < 10; ++sample) {
    const Measurement<double, N> y = outside.sense();
    worst = worst_of(
        {worst, off(y.u_dc, sample < 4 ? 240 : 200), off(y.omega_m, sample < 7 ? 120 : 90)});
    outside.obey(orders(sample));
    outside.advance((sample + 1) * T_s, none.waveforms, none.periods);
  }
  return worst;
}

/// A winding of constant inductance with the rotor held: currents by algebra.
constexpr double R = 0.5;

/// A run of one winding, with faults; judge(t, current, sensed) at every sample.
double faulty(std::vector<BrokenPart> faults, const std::function<PhaseCommand<double>(int)>& order,
              const std::function<double(double, double)>& sensed,
              const std::function<double(double)>& current, double omega = 0) {
  const Plant<Coil, N> plant{.machine = Coil{},
                             .R = R,
                             .source = StiffSource{constant(200)},
                             .bridge = AsymmetricBridge{{0, 0.1, 0, 0.1}},
                             .shaft = {.omega = constant(omega)}};
  int sample = 0;
  double worst = 0;
  Run* self = nullptr;
  Controller<N> controller = [&](const Measurement<double, N>& y, double) {
    const double t = self->t(), i = self->state().i[0];
    worst = worst_of({worst, off(i, current(t)), off(y.i[0], sensed(t, i))});
    return Orders<N>{.command = {order(sample++), {}, {}}, .tau_ref = 0};
  };
  Run run(plant, 0, {.T_s = T_s}, controller, constant(0), 0, {10e-6, {50, 200}, -1},
          std::move(faults));
  self = &run;
  Rows waveforms(columns_of(Waveform<N>{}), 10), periods(columns_of(Period<N>{}), 10);
  run.advance(20.5 * T_s, waveforms, periods);
  return worst_of({worst, off(sample, 21)});
}

/// From i_0 towards u/R with the time constant L/R.
double relaxed(double i_0, double u, double resistance, double t) {
  const double end = u / resistance;
  return end + (i_0 - end) * std::exp(-t * resistance / Coil{}.L);
}

/// Full voltage for ten samples, then all of it reversed. Two devices make 0.2 ohm.
double faults() {
  const auto magnetized = [](int n) { return hold<double>(n < 10 ? up : down); };
  const auto true_current = [](double, double i) { return i; };
  const double t_1 = 10 * T_s, r = R + 0.2;
  const auto sound = [&](double t) {
    return t <= t_1 ? relaxed(0, 200, r, t)
                    : std::fmax(relaxed(relaxed(0, 200, r, t_1), -200, r, t - t_1), 0);
  };
  double worst = faulty({}, magnetized, true_current, sound);
  // Shorted turns: G across the winding, through which the current goes on once the diodes block.
  const double s = 0.1, R_f = 0.3, G = s * s / (R_f + s * (1 - s) * R), k = 1 / (1 + 0.2 * G);
  const auto terminal = [&](double i, double u) { return k * (i + G * u); };
  const auto shorted = [&](double t) {
    const double rise = relaxed(0, k * 200, R + k * 0.2, std::fmin(t, t_1));
    if (t <= t_1) return rise;
    // Reversed: until the terminals carry none, i = G 200; then through the short alone.
    const double least = 200 * G, end = -k * 200 / (R + k * 0.2), rate = (R + k * 0.2) / Coil{}.L;
    const double t_2 = std::log((rise - end) / (least - end)) / rate;
    if (t - t_1 < t_2) return relaxed(rise, -k * 200, R + k * 0.2, t - t_1);
    return least * std::exp(-(t - t_1 - t_2) * (R + 1 / G) / Coil{}.L);
  };
  worst = worst_of({worst, faulty(
                               {{.kind = Broken::turns_shorted, .value = s, .R = R_f}}, magnetized,
                               [&](double t, double i) {
                                 if (t == 0) return 0.0;  // not yet magnetized
                                 if (t > t_1 + 1e-9) return std::fmax(terminal(i, -200), 0);
                                 return terminal(i, 200);
                               },
                               shorted)});
  // Earth at the upper end: its sensor shows what flows past the winding while the switch is on.
  worst = worst_of({worst, faulty(
                               {{.kind = Broken::winding_to_ground, .R = 50}}, magnetized,
                               [&](double t, double i) {
                                 return i + (t > 1e-9 && t < t_1 + 1e-9 ? 200 / 50.0 : 0);
                               },
                               sound)});
  // A fault that comes and goes.
  const double from = 3.3 * T_s, to = 6.1 * T_s;
  const auto opened = [&](double t) {
    const double first = relaxed(0, 200, r, std::fmin(t, from));
    if (t <= from) return first;
    const double second = relaxed(first, 0, r, std::fmin(t, to) - from);
    if (t <= to) return second;
    const double third = relaxed(second, 200, r, std::fmin(t, t_1) - to);
    return t <= t_1 ? third : std::fmax(relaxed(third, -200, r, t - t_1), 0);
  };
  worst = worst_of({worst, faulty({{.kind = Broken::upper_open, .start = from, .end = to}},
                                  magnetized, true_current, opened)});
  worst = worst_of(
      {worst,
       faulty(
           {{.kind = Broken::sensor_gain, .value = 1.5, .start = from, .end = to},
            {.kind = Broken::sensor_offset, .value = 2, .start = 0}},
           magnetized, [&](double t, double i) { return (t > from && t < to ? 1.5 * i : i) + 2; },
           sound)});
  const double stuck = sound(from);
  worst = worst_of(
      {worst, faulty(
                  {{.kind = Broken::sensor_stuck, .start = from, .end = to}}, magnetized,
                  [&](double t, double i) { return t > from && t < to ? stuck : i; }, sound)});
  worst = worst_of({worst, faulty({{.kind = Broken::poor_contact, .R = 1.5, .start = from}},
                                  magnetized, true_current, [&](double t) {
                                    const double first = relaxed(0, 200, r, std::fmin(t, from));
                                    if (t <= from) return first;
                                    const double second =
                                        relaxed(first, 200, r + 1.5, std::fmin(t, t_1) - from);
                                    if (t <= t_1) return second;
                                    return std::fmax(relaxed(second, -200, r + 1.5, t - t_1), 0);
                                  })});
  // One that waits for an angle of its phase, in either direction.
  for (double omega : {-800.0, 800.0}) {
    const double theta_e = 1.3, start = (omega > 0 ? theta_e : turn - theta_e) / (4 * 800);
    worst =
        worst_of({worst, faulty(
                             {{.kind = Broken::sensor_dead, .theta_e = theta_e}}, magnetized,
                             [&](double t, double i) { return t < start ? i : 0; }, sound, omega)});
  }
  return worst;
}

/// A dc link that is charged and discharged by the bridge, and stays at zero once it is there.
double link() {
  const Plant<Coil, N> plant{.machine = Coil{},
                             .R = 0,
                             .source = Battery{.E = constant(100), .R = 1e6, .C = 100e-6},
                             .bridge = AsymmetricBridge{},
                             .shaft = {}};
  Controller<N> controller = [&](const Measurement<double, N>&, double) {
    return Orders<N>{.command = {hold<double>(up), {}, {}}, .tau_ref = 0};
  };
  Run run(plant, 0, {.T_s = T_s}, controller, constant(0), 0, {10e-6, {50, 100}, -1});
  Rows waveforms(columns_of(Waveform<N>{}), 10), periods(columns_of(Period<N>{}), 10);
  double worst = 0;
  const double omega = 1 / std::sqrt(Coil{}.L * 100e-6);
  for (double t = 1e-4; t < 3e-3; t += 1e-4) {
    run.advance(t, waveforms, periods);
    const bool rings = t * omega < turn / 4;  // the winding and the capacitor, until it is empty
    worst = worst_of({worst, off(run.state().u_dc, rings ? 100 * std::cos(omega * t) : 0),
                      off(run.state().i[0], rings ? 10 * std::sin(omega * t) : 10)});
  }
  return worst;
}

}  // namespace

int main() {
  check("phases alone and together", alone_and_together(), 1e-7);
  check("a run in pieces", in_pieces(), 1e-8);
  check("a step of voltage or speed: sensed at its instant", sensed_at_a_step(), 1e-9);
  check("faults of a winding, by algebra", faults(), 1e-6);
  check("a dc link that empties", link(), 2e-3);
  return failures == 0 ? 0 : 1;
}
