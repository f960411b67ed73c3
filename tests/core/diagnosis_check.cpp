// What a diagnosis knows of a flux linkage: between which bounds a sample leads it, by the legs
// that were ordered, the readings and the errors that are stated; and that a real one is always
// there.
#include <cmath>
#include <random>

#include "coil.hpp"
#include "errors.hpp"
#include "srm/control/guard/diagnosis.hpp"
#include "srm/sim/gates.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr int N = 3;
constexpr double T_s = 1e-4, R = 2, u_dc = 200, L = 20e-3;
constexpr Leg down = Leg::demagnetize, still = Leg::freewheel, up = Leg::magnetize;
using Known = Diagnosis<double>;
using State = Known::State<N>;
using Phase = WindingFlux<double>::State;
using Guard = Protection<double>::State<N>;

constexpr Coil coil{.L = L};

Protection<double> protection(int delay = 0, double i_error = 0) {
  return {
      .flux = {.R = R, .T_s = T_s, .i_error = i_error, .model_error = 1, .u_margin = 1},
      .levels = {.i_trip = 1e3, .u_dc_min = 1, .u_dc_max = 1e3, .omega_max = 1e3, .angle_slack = 9},
      .advance = {},
      .i_zero = 0.5,
      .delay = delay,
      .frozen = 0};
}

/// Without errors, and with a map that contradicts nothing.
Known diagnosis() {
  Known d{};
  d.flux.map_error = 1e3;
  d.flux.psi_zero = 0.7;
  d.flux.psi_max = 10;
  d.patience = 1000;
  d.likeness.spread = 1e9;
  return d;
}

/// The phase after one sample from bounds 1 Wb and 2 Wb, with readings i0 and i1 at its ends.
Phase after(const Known& d, const PhaseCommand<double>& order, double i0, double i1,
            Known::Span from = {1, 2}, double i_error = 0, Expected<double> acting = {}) {
  const auto p = protection(0, i_error);
  State x;
  Guard guard;
  guard.has_last = true;
  guard.i[0] = i0;
  guard.acting[0] = acting;
  d.remember(x, p, Command<double, N>{order, hold<double>(down), hold<double>(down)});
  x.phase[0].any = from;
  x.u_dc = u_dc - 10;  // the mean over the sample counts
  d.finds(x, guard, p, coil, {.i = {i1, 0, 0}, .theta_e = 1, .omega_m = 0, .u_dc = u_dc + 10});
  return x.phase[0];
}

double between(const Phase& phase, double least, double most) {
  return worst_of({off(phase.any.least, least), off(phase.any.most, most)});
}

/// Legs of a timer: their volt-seconds less devices and resistance.
double timed_legs() {
  Known d = diagnosis();
  const double volt = T_s * u_dc;
  double worst =
      worst_of({between(after(d, hold<double>(up), 10, 20), 1 + volt - 20 * R * T_s,
                        2 + volt - 10 * R * T_s),
                between(after(d, hold<double>(down), 20, 10), 1 - volt - 20 * R * T_s,
                        2 - volt - 10 * R * T_s),
                between(after(d, hold<double>(still), 20, 10), 1 - 20 * R * T_s, 2 - 10 * R * T_s),
                between(after(d, pulse(still, up, 2e-5, 5e-5), 10, 10),
                        1 + 0.3 * volt - 10 * R * T_s, 2 + 0.3 * volt - 10 * R * T_s)});
  d.flux.drops = {.t_dead = 0, .v_switch = 3, .v_diode = 2};
  worst = worst_of({worst,
                    between(after(d, hold<double>(up), 10, 10), 1 + volt - (6 + 10 * R) * T_s,
                            2 + volt - (6 + 10 * R) * T_s),
                    between(after(d, hold<double>(down), 10, 10), 1 - volt - (4 + 10 * R) * T_s,
                            2 - volt - (4 + 10 * R) * T_s),
                    between(after(d, hold<double>(still), 10, 10), 1 - (5 + 10 * R) * T_s,
                            2 - (5 + 10 * R) * T_s)});
  // Where no current need flow the devices may take nothing; without magnetizing nothing grows.
  worst = worst_of({worst, off(after(d, hold<double>(up), 0, 10).any.most, 2 + volt),
                    off(after(d, hold<double>(still), 0, 10).any.most, 2),
                    off(after(d, hold<double>(still), -3, 10).any.most, 2)});
  // A dead time delays the magnetizing.
  d.flux.drops = {.t_dead = 1e-5, .v_switch = 0, .v_diode = 0};
  return worst_of({worst, between(after(d, pulse(still, up, 2e-5, 5e-5), 10, 10),
                                  1 + 0.2 * volt - 10 * R * T_s - 1e-5 * u_dc,
                                  2 + 0.2 * volt - 10 * R * T_s - 1e-5 * u_dc)});
}

/// From nothing: what comes before the first magnetizing takes nothing away. A reading of zero at
/// the end leaves little.
double ends() {
  const Known d = diagnosis();
  const double volt = T_s * u_dc;
  double worst =
      worst_of({between(after(d, pulse(down, up, 4e-5, 9e-5), 0.6, 0.6, {0, 0}),
                        0.5 * volt - 0.1 * volt - 0.6 * R * T_s, 0.4 * volt - 0.6 * R * T_s),
                between(after(d, hold<double>(down), 10, 10, {0.005, 0.01}), 0, 0),
                off(after(d, hold<double>(up), 1, 0.5).any.most, 0.7),
                off(after(d, hold<double>(up), 1, 0.51).any.most, 2 + volt - 0.51 * R * T_s)});
  return worst;
}

/// Each error that is stated widens the bounds by its share.
double stated_errors() {
  const double volt = T_s * u_dc, drop = 10 * R * T_s;
  const auto widened = [&](const Known& d, double less, double more, double i_error = 0) {
    return between(after(d, hold<double>(up), 10, 10, {1, 2}, i_error), 1 + volt - drop - less,
                   2 + volt - drop + more);
  };
  Known d = diagnosis();
  d.flux.R_error = 0.1;
  double worst = widened(d, 0.1 * drop, 0.1 * drop);
  d = diagnosis();
  d.flux.u_error = 0.02;
  worst = worst_of({worst, widened(d, 0.02 * volt, 0.02 * volt)});
  d = diagnosis();
  d.flux.i_gain = 0.2;
  worst = worst_of({worst, widened(d, 0.2 * drop, 0.2 * drop)});
  d.flux.R_error = 0.1;
  worst = worst_of({worst, widened(d, (1.2 * 1.1 - 1) * drop, (1 - 0.8 * 0.9) * drop)});
  return worst_of({worst, widened(diagnosis(), 3 * R * T_s, 3 * R * T_s, 3)});
}

/// Orders of a comparator: sure of the leg only while both readings are on one side of its band.
double compared_legs() {
  Known d = diagnosis();
  const double volt = T_s * u_dc;
  PhaseCommand<double> order = regulate(10.0, 1.0, still);
  const Expected<double> band{1, -1, 9, 12};
  const auto leads = [&](double i0, double i1, double least, double most) {
    const double high = std::fmax(i0, i1) * R * T_s, low = std::fmin(i0, i1) * R * T_s;
    return between(after(d, order, i0, i1, {1, 2}, 0, band), 1 + least - high, 2 + most - low);
  };
  double worst = worst_of({leads(8, 8.9, volt, volt), leads(8, 9, -volt, volt),
                           leads(12.1, 14, -volt, -volt), leads(12, 14, -volt, volt)});
  // From nothing a sample may have built up all of its voltage, but where it only demagnetizes.
  d.flux.u_error = 0.02;
  worst = worst_of({worst, off(after(d, order, 10, 10, {0, 0}, 0, band).any.most, 1.02 * volt),
                    off(after(d, order, 13, 13, {0, 0}, 0, band).any.most, 0)});
  d.flux.u_error = 0;
  d.flux.drops = {.t_dead = 1e-5, .v_switch = 3, .v_diode = 2};
  const double slack = 1e-5 * u_dc + 10 * T_s;
  worst = worst_of({worst, leads(8, 8.9, volt - slack, volt + slack),
                    leads(12.1, 14, -volt - slack, -volt + slack)});
  // Another gain of the readings than of the comparator.
  d = diagnosis();
  d.flux.i_gain = 0.1;
  const auto sure = [&](double i, bool is_up, bool is_down) {
    const Phase phase = after(d, order, i, i, {1, 2}, 0, band);
    return worst_of(
        {unless((phase.any.least > 1) == is_up), unless((phase.any.most < 2) == is_down)});
  };
  return worst_of({worst, sure(8, true, false), sure(8.2, false, false), sure(13.1, false, false),
                   sure(13.3, false, true)});
}

/// How long the flux linkage is followed, what the resistance has taken meanwhile, and what is left
/// open.
double counts() {
  Known d = diagnosis();
  d.flux.R_error = 0.1;
  const auto held = after(d, hold<double>(up), 10, 20);
  double worst = worst_of({off(held.age, 1), off(held.taken, (20 * 1.1 + 10 * 0.9) / 2 * R * T_s)});
  const auto ended = after(d, hold<double>(down), 10, 10, {0.001, 0.05});
  worst = worst_of(
      {worst, off(ended.age, 0), off(ended.taken, 0), off(ended.left, ended.any.most / 2)});
  // A comparator leaves open how much of the voltage a winding had.
  for (bool above : {false, true}) {
    d = diagnosis();
    const auto p = protection();
    State x;
    Guard guard;
    guard.has_last = true;
    guard.i[0] = above ? 13 : 10;
    guard.acting[0] = {1, -1, 9, 12};
    x.phase[0].any = {1, 2};
    x.phase[0].left = 0.5;
    x.phase[0].age = 7;
    x.u_dc = u_dc;
    d.remember(x, p,
               Command<double, N>{regulate(10.0, 1.0, still), regulate(0.0, 1.0, still),
                                  regulate(0.0, 1.0, still)});
    d.finds(x, guard, p, coil, {.i = {guard.i[0], 0, 0}, .theta_e = 1, .omega_m = 0, .u_dc = u_dc});
    worst = worst_of(
        {worst, off(x.phase[0].left, 0.5 + (above ? 0 : T_s * u_dc)), off(x.phase[0].age, 8)});
  }
  return worst;
}

/// Orders take effect a sample later with a delay.
double delays() {
  const Known d = diagnosis();
  double worst = 0;
  for (int delay : {0, 1}) {
    const auto p = protection(delay);
    State x;
    Guard guard;
    guard.has_last = true;
    guard.i[0] = 10;
    for (int sample = 0; sample < 4; ++sample) {
      const PhaseCommand<double> order =
          sample % 2 == 0 ? hold<double>(up) : pulse(up, still, 3e-5, 1e-4);
      d.remember(x, p, Command<double, N>{order, hold<double>(down), hold<double>(down)});
      x.phase[0].any = {1, 1};
      x.u_dc = u_dc;
      d.finds(x, guard, p, coil, {.i = {10, 0, 0}, .theta_e = 1, .omega_m = 0, .u_dc = u_dc});
      if (sample < 2) continue;
      const bool full = (sample % 2 == 0) == (delay == 0);
      worst = worst_of(
          {worst, off(x.phase[0].any.least, 1 + (full ? 1 : 0.3) * T_s * u_dc - 10 * R * T_s)});
    }
  }
  return worst;
}

/// The inductance rises with the angle.
struct Slope {
  using Scalar = double;
  int N_r = 4;
  static double L_at(double theta_e) { return L * (1 + theta_e / 10); }
  Magnetics<double> at(double i, double theta_e) const {
    const double l = L_at(theta_e);
    return {.psi = l * i, .W_c = l * i * i / 2, .tau = 0, .L_inc = l, .psi_theta = 0};
  }
};

/// A reading is contradicted from where no stated error explains the flux linkage of the voltage.
double contradictions() {
  Known d = diagnosis();
  d.flux.map_error = 0.1;
  d.flux.i_gain = 0.05;
  d.flux.psi_error = 0.02;
  d.theta_error = 0.1;
  auto p = protection(0, 0.3);
  p.flux.R = 0;
  double worst = 0;
  const auto judged = [&](double i, double psi, Status expected) {
    State x;
    Guard guard;
    guard.has_last = true;
    guard.i[0] = i;
    d.remember(x, p,
               Command<double, N>{hold<double>(still), hold<double>(down), hold<double>(down)});
    x.phase[0].any = x.phase[0].shown = {psi, psi};
    x.u_dc = u_dc;
    d.finds(x, guard, p, Slope{}, {.i = {i, 0, 0}, .theta_e = 1, .omega_m = 0, .u_dc = u_dc});
    const bool sound = expected == Status::ok;
    worst = worst_of({worst, unless(x.first.status == expected),
                      unless(sound == (x.near < 0 && x.doubted == 0))});
  };
  for (double i : {0.501, 2.0, 20.0}) {
    const double part = 0.1 + 0.05 + 0.3 / i;
    const double least = Slope::L_at(0.9) * i * (1 - part) - 0.02,
                 most = Slope::L_at(1.1) * i * (1 + part) + 0.02;
    judged(i, most - 1e-9, Status::ok);
    judged(i, most + 1e-9, Status::current_too_low);
    if (least > 0) {
      judged(i, least + 1e-9, Status::ok);
      judged(i, least - 1e-9, Status::current_too_high);
    }
  }
  const double none =
      Slope::L_at(1.1) * 0.8 * 1.1 + 0.02;  // a reading of zero may be 0.5 A and 0.3 A
  for (double i : {0.0, 0.5}) {
    judged(i, none - 1e-9, Status::ok);
    judged(i, none + 1e-9, Status::dead_current_sensor);
  }
  return worst;
}

/// What a follower of the rotor is told, and what guard is told.
double tellings() {
  State x;
  x.phase[1].any = {1, 2};
  x.phase[1].taken = 0.3;
  x.phase[1].left = 0.1;
  x.phase[1].age = 4;
  Known d = diagnosis();
  d.flux.R_error = 9;
  double worst = off(d.by_voltage(x, 1).error, 0);
  d.flux.R_error = 0.5;
  const VoltageFlux<double> v = d.by_voltage(x, 1);
  worst = worst_of({worst, off(v.psi, 1.5), off(v.taken, 0.3), off(v.left, 0.1), off(v.error, 0.35),
                    unless(v.is)});
  x.doubted = 1;
  x.first.phase = 1;
  const bool doubted = d.by_voltage(x, 1).is;
  x.first.phase = 0;
  worst = worst_of({worst, unless(!doubted && d.by_voltage(x, 1).is)});
  x.doubted = 0;  // what contradicted is sound, or waits
  x.first.phase = 1;
  worst = worst_of({worst, unless(d.by_voltage(x, 1).is)});
  x.phase[1].age = 0;
  worst = worst_of({worst, unless(!d.by_voltage(x, 1).is)});

  d = diagnosis();
  const auto p = protection();
  Command<double, N> orders{};
  for (int unlike : {-1, 0, 2}) {
    State y;
    Guard guard;
    guard.has_last = true;
    y.unlike = unlike;
    const Measurement<double, N> m{.theta_e = 1, .u_dc = u_dc};
    const bool found = d.finds(y, guard, p, coil, m);
    worst = worst_of({worst, unless(found == (unlike >= 0) && guard.latched == found),
                      unless(!found || (guard.fault.status == Status::phase_unlike &&
                                        guard.fault.phase == unlike)),
                      unless(!d.tries(y, p, coil, m, orders))});
    y.trial = PhaseTrial<double>::begun<N>(1);
    worst = worst_of({worst, unless(d.tries(y, p, coil, m, orders))});
  }
  // Too much current in two phases that contradict a sound drive is that of two exchanged ones.
  for (int without = 0; without < 6; ++without) {
    State y;
    Guard guard;
    y.doubted = without == 1 ? 0 : 5;
    y.left.phase = without == 2 ? 1 : 0;
    guard.latched = without != 3;
    guard.fault.status = without == 4 ? Status::over_voltage : Status::over_current;
    const Status before = guard.fault.status;
    y.left.power = 0;
    y.left.sensors = without == 5 ? 0 : 2;
    d.explain(y, guard);
    worst = worst_of(
        {worst, unless(guard.fault.status == (without == 0 ? Status::phases_exchanged : before))});
  }
  return worst;
}

/// A coil under pulses between two levels, with devices and dead time, and readings and parameters
/// that are off by what is stated: its flux linkage is always within the bounds, and near them
/// without errors.
double always_within(bool exact) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  double outside = 0, widest = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Known d = diagnosis();
    const double v_switch = exact ? 0 : 1.5, v_diode = exact ? 0 : 1;
    d.flux.drops = {.t_dead = 2e-6, .v_switch = v_switch, .v_diode = v_diode};
    d.flux.psi_zero = 0.5 * L * 1.5 + 1e-3;
    double R_true = exact ? 0.0 : R, gain = 1, u_true = 1, i_error = 0;
    if (!exact) {
      d.flux.R_error = 0.2;
      d.flux.u_error = 0.01;
      d.flux.i_gain = 0.05;
      i_error = 0.3;
      R_true = R * (1 + 0.2 * any(random));
      gain = 1 + 0.05 * any(random);
    }
    auto p = protection(0, i_error);
    if (exact) p.flux.R = 0;
    State x;
    Guard guard;
    Gates<1> gates;
    double psi = 0, shown = 0;
    for (int sample = 0; sample < 200; ++sample) {
      u_true = exact ? 1 : 1 + 0.009 * any(random);
      const Measurement<double, N> y{.i = {shown, 0, 0}, .theta_e = 1, .omega_m = 0, .u_dc = u_dc};
      d.finds(x, guard, p, coil, y);
      const Known::Span& s = x.phase[0].any;
      outside = worst_of({outside, s.least - psi, psi - s.most});
      if (s.least > 0) widest = std::fmax(widest, s.most - s.least);
      const int base = any(random) > 0 && psi < L * 40 ? 0 : -1;  // the lower of its levels
      PhaseCommand<double> order = hold<double>(down);
      double t = 0;
      for (int n = 0; n <= max_edges && sample > 3; ++n) {
        order.leg[n] = static_cast<Leg>(base + (any(random) > 0));
        if (n < max_edges) order.t_edge[n] = (t += T_s * (any(random) + 1) / 3);
      }
      const Command<double, N> orders{order, hold<double>(down), hold<double>(down)};
      d.remember(x, p, orders);
      p.remember(guard, 4, y, orders, p.levels);
      gates.take({order}, false, sample * T_s);
      double now = sample * T_s;
      const double end = (sample + 1) * T_s;
      while (now < end) {
        gates.follow(0, now, psi / L, 2e-6);
        gates.settle(now);
        const double next = std::fmin(std::fmin(gates.next_instant(0), end), now + T_s / 50);
        const int level = static_cast<int>(gates.levels()[0]);
        const double drop = (1 + level) * v_switch + (1 - level) * v_diode;
        psi = std::fmax(psi + (next - now) * (level * u_dc * u_true - drop - R_true * psi / L), 0);
        now = next;
      }
      shown = psi / L * gain + (exact ? 0 : 0.3 * any(random));
    }
  }
  return exact ? worst_of({outside, widest}) : worst_of({outside, unless(widest < 0.5)});
}

}  // namespace

int main() {
  check("legs of a timer", timed_legs(), 1e-12);
  check("from no flux linkage, and to none", ends(), 1e-12);
  check("errors that are stated", stated_errors(), 1e-12);
  check("legs of a comparator", compared_legs(), 1e-12);
  check("since when it is followed", counts(), 1e-12);
  check("orders with a delay", delays(), 1e-12);
  check("readings against the voltage", contradictions(), 0);
  check("what is told", tellings(), 1e-14);
  check("a flux linkage by its voltage, without errors [Wb]", always_within(true), 1e-9);
  check("a flux linkage is within its bounds [Wb]", always_within(false), 1e-9);
  return failures == 0 ? 0 : 1;
}
