// What lies between the plant and its control: noise, converters, rotor sensors, gate drives, the
// place within a step and the extremes of a period. Each against its formula or its own words.
#include <cmath>
#include <limits>

#include "errors.hpp"
#include "srm/machine/lehuy.hpp"
#include "srm/sim/gates.hpp"
#include "srm/sim/independent.hpp"
#include "srm/sim/recorder.hpp"
#include "srm/sim/sampling.hpp"
#include "srm/sim/window.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr Leg down = Leg::demagnetize, still = Leg::freewheel, up = Leg::magnetize;
constexpr double infinite = std::numeric_limits<double>::infinity();

/// The published first numbers of splitmix64 from the seed 1234567.
double integers() {
  const std::uint64_t expected[] = {6457827717110365317U, 3203168211198807973U,
                                    9817491932198370423U};
  double worst = 0;
  for (std::uint64_t n = 0; n < 3; ++n) {
    worst = worst_of({worst, unless(splitmix64(1234567 + n * 0x9E3779B97F4A7C15) == expected[n])});
  }
  return worst;
}

/// The value of the formula at the head of noise.hpp, computed with whole numbers of any size.
double a_noise() { return off(noise(7, 2, 41), 1.607635498046875); }

/// Mean, variance and kurtosis of twelve uniform numbers, and no relation between channels, samples
/// and seeds.
double noises() {
  constexpr int n = 40000;
  double sum = 0, square = 0, fourth = 0, channels = 0, samples = 0, seeds = 0, worst = 0;
  for (int j = 0; j < n; ++j) {
    const double x = noise(3, 1, j);
    sum += x;
    square += x * x;
    fourth += x * x * x * x;
    channels += x * noise(3, 2, j);
    samples += x * noise(3, 1, j + 1);
    seeds += x * noise(4, 1, j);
    worst = std::fmax(worst, std::fabs(x));
  }
  return worst_of({std::fabs(sum / n), std::fabs(square / n - 1), std::fabs(fourth / n - 2.9) / 4,
                   std::fabs(channels / n), std::fabs(samples / n), std::fabs(seeds / n),
                   unless(worst < noise_peak && worst > 3)});
}

/// Codes of a converter: a step is its range over the number of codes, and it ends one step below
/// its range.
double converters() {
  Sampling s{.adc_bits = 3, .i_range = 16};
  s.i_offset[1] = 0.5;
  s.i_gain[1] = 1.5;
  double worst =
      worst_of({off(sensed_current(s, 3.99, 0, 0), 2), off(sensed_current(s, 4, 0, 0), 4),
                off(sensed_current(s, 99, 0, 0), 14), off(sensed_current(s, -1, 0, 0), -2),
                off(sensed_current(s, -99, 0, 0), -16), off(sensed_current(s, 3.6, 1, 0), 4)});
  s.adc_bits = 0;
  s.i_noise = 0.2;
  return worst_of(
      {worst, off(sensed_current(s, 3.6, 1, 7), 1.5 * 3.6 + 0.5 + 0.2 * noise(0, 1, 7))});
}

/// A sample shows what the sensors are off by.
double measurements() {
  using M = LeHuy<double>;
  const Plant<M, 3> plant{.machine = lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468),
                          .R = 1,
                          .source = StiffSource{constant(100)},
                          .bridge = AsymmetricBridge{},
                          .shaft = {}};
  const State<3> x{.i = {1, 2, 3}, .omega_m = 20, .theta_m = 1.7, .u_dc = 99};
  Sampling s{.u_noise = 0.5, .seed = 9, .angle_offset = 0.3};
  s.i_offset[2] = 0.25;
  RotorSensor::State rotor;
  const auto y = measured(plant, x, 7, s, 5, rotor);
  s.u_noise = 0;
  return worst_of({off(y.i[0], 1), off(y.i[1], 2), off(y.i[2], 3.25), off(y.omega_m, 20),
                   off(y.theta_e, 4 * 1.7 + 0.3 - turn), off(y.i_source, 7),
                   off(y.u_dc, 99 + 0.5 * noise(9, 6, 5)),
                   off(measured(plant, x, 7, s, 5, rotor).u_dc, 99)});
}

/// An encoder shows the middle of its count, Hall sensors that of their sector; one after the other
/// takes the errors of an incremental encoder away.
double rotor_sensors() {
  RotorSensor::State x;
  const RotorSensor none, encoder{.counts = 100}, hall{.hall = true, .hall_error = 0.01};
  const double sector = turn / 2 / (3 * 4);
  double worst = 0;
  for (double theta = -2; theta < 2; theta += 0.037) {
    const double count = (std::floor(theta / turn * 100) + 0.5) / 100 * turn;
    const double middle = (std::floor((theta - 0.01) / sector) + 0.5) * sector + 0.01;
    worst = worst_of({worst, off(none.step(x, theta, 4, 3), theta),
                      off(encoder.step(x, theta, 4, 3), count),
                      off(hall.step(x, theta, 4, 3), middle)});
  }
  const RotorSensor index{.counts = 1000, .index = true, .hall = true, .hall_error = 0.02};
  x = {};
  const double start = 0.41, step = turn / 1000;
  const auto shown = [&](double theta) { return index.step(x, theta, 4, 3) - theta; };
  const auto of_count = [&](double theta) {
    return (std::floor(theta / step) + 0.5) * step - theta;
  };
  const double guess = (std::floor(start / sector) + 0.5) * sector;
  worst = worst_of({worst, off(shown(start), guess - start)});
  const double held = x.error;
  for (double theta = start; theta < 0.52; theta += 0.01) {
    worst = worst_of({worst, off(shown(theta), held + of_count(theta))});
  }
  for (double theta = 0.53; theta < 6.2; theta += 0.05) {  // past an edge between two sectors
    worst = worst_of({worst, off(shown(theta), 0.02 + of_count(theta))});
  }
  for (double theta = 6.3; theta < 13; theta += 0.05) {  // past the index
    worst = worst_of({worst, off(shown(theta), of_count(theta))});
  }
  return worst;
}

/// Where a window begins and ends, by a sensor that is off, in either direction.
double windows() {
  double worst = 0;
  for (int direction : {-1, 1}) {
    for (double on = -0.3; on < 3; on += 0.41) {
      const SensedAngle sensed{.N_r = 4, .direction = direction, .error = 0.2};
      PhaseCommand<double> c{};
      c.theta_on = on;
      c.theta_off = on + 2;
      for (double theta = 0.0137; theta < turn; theta += 0.1113) {
        const double at = theta + 0.2;
        worst = worst_of({worst, unless(sensed.inside(c, theta) == (wrap(at - on) < 2))});
        const double gap = direction > 0 ? std::fmin(wrap(on - at), wrap(on + 2 - at))
                                         : std::fmin(wrap(at - on), wrap(at - on - 2));
        worst = worst_of({worst, off(sensed.to_edge(c, theta), gap / 4)});
      }
      // On an edge itself, what lies in the direction of motion counts.
      const double edge = wrap(on - 0.2), end = wrap(on + 2 - 0.2);
      worst = worst_of({worst, unless(sensed.inside(c, edge) == (direction > 0)),
                        unless(sensed.inside(c, end) == (direction < 0)),
                        off(sensed.to_edge(c, edge), (direction > 0 ? 2 : turn - 2) / 4)});
      c.theta_off = on;  // the same edge again, a turn later
      worst = worst_of({worst, off(sensed.to_edge(c, edge), turn / 4)});
    }
  }
  return worst;
}

/// A comparator's next threshold and the leg behind it; a timer's next edge; dead time.
double gates() {
  double worst = 0;
  PhaseCommand<double> soft = regulate(10.0, 1.0, still), hard = regulate(10.0, 1.0, down);
  set_thresholds(soft, Comparators::analog);
  set_thresholds(hard, Comparators::analog);
  const auto judge = [&](const PhaseCommand<double>& c, Leg leg, double below, double above,
                         Leg low, Leg high) {
    const GateState gate{.leg = leg};
    const Span s = awaited(c, gate);
    worst = worst_of({worst, unless(s.below == below && s.above == above)});
    if (below > -infinite) worst = worst_of({worst, off(after(c, gate, false), low)});
    if (above < infinite) worst = worst_of({worst, off(after(c, gate, true), high)});
    if (below > -infinite) {
      worst = worst_of({worst, off(ordered(c, gate, below - 0.01), low),
                        off(ordered(c, gate, below + 0.01), leg)});
    }
    if (above < infinite) {
      worst = worst_of({worst, off(ordered(c, gate, above - 0.01), leg),
                        off(ordered(c, gate, above + 0.01), high)});
    }
  };
  judge(soft, up, -infinite, 11, up, still);
  judge(soft, still, 9, 12, up, down);
  judge(soft, down, 10, infinite, still, down);
  judge(hard, up, -infinite, 11, up, down);
  judge(hard, down, 9, infinite, up, down);
  PhaseCommand<double> window = soft, none = regulate(0.0, 1.0, still), nothing = soft;
  window.gate = Gate::window;
  nothing.gate = Gate::off;
  const GateState out{.leg = up}, in{.leg = up, .inside = true};
  worst =
      worst_of({worst, off(ordered(window, out, 5), down), off(ordered(window, in, 5), up),
                unless(awaited(window, out).above == infinite && awaited(window, in).above == 11),
                off(ordered(nothing, in, 5), down), unless(awaited(none, in).above == infinite),
                unless(awaited(nothing, in).above == infinite)});

  Gates<2> g;
  Command<double, 2> c{pulse(still, up, 3.0, 5.0), hold<double>(up)};
  g.take(c, true, 0);
  worst = worst_of({worst, unless(g.command[0].leg[0] == down && g.pending[0].leg[0] == still)});
  g.take(c, true, 10);
  const auto at = [&](double t, Leg order, Leg leg, double next) {
    for (int k = 0; k < 2; ++k) g.follow(k, t, 0, 0.5);
    const auto before = g.levels();
    const bool changed = g.settle(t);
    worst = worst_of({worst, unless(changed == (g.levels() != before))});
    worst = worst_of({worst, off(g.gate[0].leg, order), off(g.levels()[0], leg),
                      unless(g.lags(0) == (order != leg)), unless(g.next_instant(0) == next)});
  };
  at(10, still, down, 10.5);
  at(10.5, still, still, 13);
  worst = worst_of({worst, off(g.levels()[1], up), unless(g.next_instant(1) > 1e29)});
  at(13, up, still, 13.5);
  at(13.5, up, up, 15);
  at(15, still, still, 1e30 + 10);
  g.take({hold<double>(down), hold<double>(down)}, false, 20);
  at(20, down, down, 1e30 + 20);
  PhaseCommand<double> edges = hold<double>(up);
  edges.t_edge = {1, 2, 3, 4};
  g.take({edges, soft}, false, 30);
  at(33, up, down, 33.5);
  at(34, up, up, infinite);
  worst = worst_of({worst, unless(g.next_instant(1) == infinite)});
  return worst;
}

/// Quantities between the ends of a step: a polynomial of the fifth order is found again by the
/// flux linkage, a cubic by the torque.
double within_a_step() {
  double worst = 0;
  const auto machine = lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468);
  const auto begin = machine.at(20, 1.5);
  const double c[] = {begin.psi, -2, 40, 900, -2e4, 3e5}, t0 = 2, h = 0.01;
  const auto psi = [&](double t, int d) {
    double sum = 0;
    for (int n = d; n < 6; ++n) {
      double product = c[n];
      for (int j = 0; j < d; ++j) product *= n - j;
      sum += product * std::pow(t, n - d);
    }
    return sum;
  };
  PhaseStep s;
  s.t0 = t0;
  s.t1 = t0 + h;
  s.start.m.psi = psi(0, 0);
  s.end.m.psi = psi(h, 0);
  s.start.v = {psi(0, 1), psi(0, 2)};
  s.end.v = {psi(h, 1), psi(h, 2)};
  const auto cubic = [](double t) { return 1 + t * (2 + t * (-300 + t * 5e4)); };
  const auto slope = [](double t) { return 2 + t * (-600 + t * 15e4); };
  s.start.tau = {cubic(0), slope(0)};
  s.end.tau = {cubic(h), slope(h)};
  for (double t = 0; t <= h; t += h / 8) {
    const Moving tau = s.within(t0 + t, &PhasePoint::tau);
    worst = worst_of({worst, off(s.flux(t0 + t), psi(t, 0)), off(tau.now, cubic(t)),
                      off(tau.rate, slope(t)) / 100});
  }
  // The current is the one that has the flux linkage at the angle of then.
  s.start.i.now = 20;
  s.end.i.now = 20 + (psi(h, 0) - begin.psi) / begin.L_inc;
  for (double t = 0; t <= h; t += h / 8) {
    const double i = s.current(t0 + t, machine, 1.5 + t);
    worst = worst_of({worst, off(machine.at(i, 1.5 + t).psi, psi(t, 0))});
  }
  return worst;
}

/// The rates of a phase by itself are those of a plant with one phase.
double rates_of_a_phase() {
  const auto machine = lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468);
  const Given g{200, 2, 50, 200};
  PhasePoint p{.m = machine.jet(20, 1.5), .i = 20, .v = {}, .tau = {}};
  rate(p, g);
  const double dt = 1e-7;
  const auto later = [&](double t) { return machine.at(20 + t * p.i.rate, 1.5 + 200 * t); };
  const auto on = later(dt), back = later(-dt);
  return worst_of({off(p.v.now, 160), off((on.psi - back.psi) / (2 * dt), 160) / 1e2,
                   off(p.v.rate, -2 * p.i.rate), off(p.tau.now, on.tau / 2 + back.tau / 2),
                   off((on.tau - back.tau) / (2 * dt), p.tau.rate) / 1e4});
}

/// The greatest and least of what a step holds, its end left to the next one.
double extremes() {
  Rates<2> a, b;
  const auto parabola = [](double t) { return Moving{5 - (t - 1) * (t - 1), -2 * (t - 1)}; };
  a.tau = parabola(0);
  b.tau = parabola(3);
  a.omega_m = -1 * parabola(0);
  b.omega_m = -1 * parabola(3);
  a.u_dc = {7, 1};
  b.u_dc = {9, 1};
  a.i = {parabola(0), Moving{3, -1}};
  b.i = {parabola(3), Moving{9, 1}};
  Extremes e;
  e.include(a, b, 3);
  double worst =
      worst_of({off(e.tau_min, 4), off(e.tau_max, 5), off(e.omega_min, -5), off(e.omega_max, -4),
                off(e.u_min, 7), off(e.u_max, 7), off(e.i_peak, 5)});
  Extremes held;
  held.include_held(State<2>{.i = {}, .omega_m = 3, .theta_m = 0, .u_dc = 8});
  held.include_held(State<2>{.i = {}, .omega_m = 4, .theta_m = 0, .u_dc = 6});
  held.include_torque(parabola(3), parabola(4), 1);
  held.include(Moving{9, 1}, Moving{12, 1}, 1);
  worst = worst_of({worst, off(held.omega_min, 3), off(held.omega_max, 4), off(held.u_min, 6),
                    off(held.u_max, 8), off(held.tau_min, 1), off(held.tau_max, 1),
                    off(held.i_peak, 9)});
  Rows rows(3, 3);
  worst = worst_of({worst, unless(!rows.full() && rows.size() == 0 && rows.columns() == 3)});
  rows.add(std::array<double, 3>{1, 2, 3});
  rows.add(std::array<double, 3>{4, 5, 6});
  rows.add(std::array<double, 3>{7, 8, 9});
  worst = worst_of({worst, unless(rows.full()), off(rows.data()[4], 5),
                    off(rows.row<std::array<double, 3>>(2)[1], 8)});
  rows.clear();
  return worst_of({worst, unless(!rows.full() && rows.size() == 0)});
}

}  // namespace

int main() {
  check("noise: integers of splitmix64", integers(), 0);
  check("noise: a value", a_noise(), 1e-15);
  check("noise: moments, and no relations", noises(), 0.02);
  check("converter: codes, offset, gain", converters(), 1e-14);
  check("sample: what the sensors are off by", measurements(), 1e-14);
  check("rotor sensors: encoder, Hall, index", rotor_sensors(), 1e-12);
  check("windows: inside, and the way to an edge", windows(), 1e-12);
  check("gates: thresholds, edges, dead time", gates(), 0);
  check("step of a phase: what lies within", within_a_step(), 1e-9);
  check("step of a phase: rates", rates_of_a_phase(), 1e-6);
  check("period: extremes", extremes(), 1e-12);
  return failures == 0 ? 0 : 1;
}
