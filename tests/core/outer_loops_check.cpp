// The loops around a law, each against its own words: the maximum power point, the pump's states,
// the current from the legs, the ripple of the link, least squares, and the frame that joins them.
#include <cmath>
#include <functional>

#include "errors.hpp"
#include "srm/control/frame/frame.hpp"
#include "srm/control/frame/normal_equations.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr Leg down = Leg::demagnetize, still = Leg::freewheel, up = Leg::magnetize;

/// On a source of 300 V and 10 ohm the greatest power is at 150 V: both methods climb there from
/// either side and stay within two steps; a limit turns them back.
double trackers() {
  double worst = 0;
  for (Tracking method : {Tracking::perturb_observe, Tracking::incremental_conductance}) {
    for (double start : {60.0, 250.0}) {
      const PowerTracker<double> tracker{method, start, 50, 280, 4};
      PowerTracker<double>::State x;
      tracker.start(x);
      worst = worst_of({worst, off(x.u_ref, start)});
      const auto settle = [&](double E, int n) {
        double least = 1e9, most = 0;
        for (int j = 0; j < n; ++j) {
          const double before = x.u_ref, i = (E - before) / 10;
          tracker.advance(x, before, i, before * i);
          worst = worst_of({worst, off(std::fabs(x.u_ref - before), 4)});
          if (j > 60) least = std::fmin(least, x.u_ref), most = std::fmax(most, x.u_ref);
        }
        return unless(off(least, E / 2) <= 10 && off(most, E / 2) <= 10);
      };
      worst = worst_of({worst, settle(300, 90), settle(360, 90), settle(240, 90)});
    }
  }
  // More light at the same voltage: up; less: down.
  const PowerTracker<double> tracker{Tracking::incremental_conductance, 100, 50, 280, 4};
  for (double more : {-0.1, 0.1}) {
    PowerTracker<double>::State x;
    tracker.start(x);
    tracker.advance(x, 100, 5, 500);
    tracker.advance(x, 100.39, 5 + more, 500);
    worst = worst_of({worst, off(x.u_ref, more > 0 ? 100 : 92)});
  }
  // At a limit the way is back.
  const PowerTracker<double> low{Tracking::perturb_observe, 52, 50, 280, 4};
  PowerTracker<double>::State x;
  low.start(x);
  low.advance(x, 52, 5, 260);
  worst = worst_of({worst, off(x.u_ref, 50), off(x.direction, 1)});
  const PowerTracker<double> constant{Tracking::constant, 77, 50, 280, 4};
  constant.start(x);
  constant.advance(x, 52, 5, 260);
  constant.advance(x, 99, 5, 600);
  return worst_of({worst, off(x.u_ref, 77)});
}

/// Levels of an order over a sample, and the mean of the link's current by the trapezoid.
double drawn_currents() {
  PhaseCommand<double> edges = hold<double>(up);
  edges.leg = {up, still, down, up, still};
  edges.t_edge = {1, 3, 4, 6};
  PhaseCommand<double> open = hold<double>(up);
  open.gate = Gate::window;
  double worst =
      worst_of({off(mean_level(edges, 10.0), 0.2), off(mean_level(edges, 3.5), 0.5 / 3.5),
                off(mean_level(edges, 3.0), 1.0 / 3), off(mean_level(hold<double>(down), 10.0), -1),
                off(mean_level(open, 10.0), 0)});
  for (int delay : {0, 1}) {
    DrawnCurrent<double, 2> x;
    x.remember({.i = {1, 2}}, {hold<double>(up), hold<double>(still)}, 1, delay);
    worst = worst_of({worst, off(x.mean({.i = {3, 5}}), delay ? 0 : 2)});
    x.remember({.i = {3, 5}}, {hold<double>(still), hold<double>(down)}, 1, delay);
    worst = worst_of({worst, off(x.mean({.i = {7, 7}}), delay ? 5 : -6)});
  }
  return worst;
}

/// A ripple of N waves a period is learned and taken out, at any speed alike over the angle.
double ripples() {
  double worst = 0;
  for (double omega : {-50.0, 100.0}) {
    const StrokeRipple<double> ripple{.learning = 2e-4};
    StrokeRipple<double>::State x;
    double most = 0;
    for (int n = 0; n < 4000; ++n) {
      const double theta_e = wrap(omega * 4 * 1e-4 * n);
      const double rest = ripple.without<3>(x, 5 * std::sin(3 * theta_e + 0.7) + 2, theta_e, omega);
      if (n > 3000) most = std::fmax(most, std::fabs(rest - 2));
    }
    worst = std::fmax(worst, most);
  }
  // A single sample: what it learns is in phase with it.
  const StrokeRipple<double> ripple{.learning = 0.01};
  StrokeRipple<double>::State x;
  worst = worst_of({worst, unless(ripple.without<3>(x, 2, 0.0, -5) == 2), off(x.a, 0),
                    off(std::fabs(x.b), 0.1)});
  return worst;
}

/// The change that least squares ask for, where rows are exact; sums that are kept in part; rows of
/// unknowns that have moved.
double least_squares() {
  using Equations = NormalEquations<double>;
  const Equations::Vector truth{2, -1, 0.5, 3};
  Equations all, twice, later;
  const auto row = [](int n) {
    return Equations::Vector{std::sin(n), std::cos(2.0 * n), std::sin(3.0 * n + 1),
                             std::cos(5.0 * n)};
  };
  const auto value = [&](const Equations::Vector& phi) {
    double r = 0;
    for (int j = 0; j < 4; ++j) r += phi[j] * truth[j];
    return r;
  };
  double trace = 0;
  for (int n = 0; n < 20; ++n) {
    all.add(row(n), value(row(n)));
    for (double phi : row(n)) trace += phi * phi;
  }
  for (int n = 20; n < 30; ++n) later.add(row(n), value(row(n)));
  double worst = off(all.trace(), trace) * 1e6;
  const auto judge = [&](const Equations& e, const Equations::Vector& expected) {
    const auto d = e.solve();
    for (int j = 0; j < 4; ++j) worst = worst_of({worst, off(d[j], expected[j])});
  };
  judge(all, truth);
  judge(Equations{}, {});
  twice = all;
  twice.take(later, 0.25);
  worst = worst_of({worst, off(twice.trace(), 0.25 * all.trace() + later.trace()) * 1e6});
  judge(twice, truth);
  all.moved({0.5, 0.25, -1, 2});
  judge(all, {1.5, -1.25, 1.5, 1});
  return worst;
}

PvControl<double> pv(Actuator actuator = Actuator::torque,
                     ArrayCurrent current = ArrayCurrent::sensor) {
  return {.actuator = actuator,
          .current = current,
          .link = {.K_p = 0.2, .K_iT = 0.01},
          .tracker = {Tracking::perturb_observe, 150, 50, 280, 4},
          .mean = {.T_s = 0.25, .t_settle = 0, .t_least = 1, .t_most = 2},
          .ripple = {.learning = 0},
          .C = 8,
          .delay = 0,
          .acceleration = 10,
          .omega_lead = 5,
          .u_stop = 100,
          .u_full = 140,
          .u_wake = 200,
          .t_wake = 1,
          .p_sleep = 50,
          .t_sleep = 4,
          .k_dry = 0.01,
          .omega_dry = 20,
          .t_dry = 4,
          .t_rest = 3};
}
constexpr SpeedPi<double> loop{.K_p = 2, .K_i = 0, .tau_min = -9, .tau_max = 9, .T_s = 0.25};

/// A drive at the border of a sample.
struct Pump {
  PvControl<double> control;
  PvControl<double>::State<3> x{};
  SpeedPi<double>::State speed{};
  Measurement<double, 3> y{.theta_e = 0, .omega_m = 0, .u_dc = 250, .i_source = 5};

  double step(double omega_most = 100) { return control.step(x, y, loop, speed, omega_most); }
  /// Samples until a mode, at most 99.
  int until(PvMode mode) {
    int n = 0;
    for (; n < 99 && x.mode != mode; ++n) step();
    return n;
  }
};

/// It wakes after a while of voltage in a row, sleeps after a while without power, and rests when
/// it runs dry: each at its own sample.
double pump_states() {
  Pump p{pv()};
  double worst = 0;
  p.y.u_dc = 200;
  worst = worst_of({worst, off(p.until(PvMode::running), 99)});
  p.y.u_dc = 200.1;
  for (int n = 0; n < 3; ++n) p.step();
  p.y.u_dc = 150;
  p.step();
  p.y.u_dc = 250;
  p.y.omega_m = 30;
  worst = worst_of({worst, off(p.until(PvMode::running), 4), off(p.x.tracker.u_ref, 150),
                    off(p.x.omega_ramp, 30)});
  p.y.omega_m = 10;    // too slow to be judged dry
  p.y.i_source = 0.2;  // 250 V: exactly the power at which it need not sleep
  worst = worst_of({worst, off(p.until(PvMode::asleep), 99)});
  p.y.i_source = 0.19;
  const int sleeps = p.until(PvMode::asleep);
  worst = worst_of({worst, unless(sleeps >= 12 && sleeps <= 16), unless(p.x.tau == 0)});
  p.y.i_source = 5;
  p.y.omega_m = -3;  // the sample in which it falls asleep is the first of those that count
  worst = worst_of({worst, off(p.until(PvMode::running), 3), off(p.x.omega_ramp, 0)});
  // Dry: less torque than k omega^2, above its speed.
  p.y.omega_m = 40;
  p.y.u_dc = 100;  // no torque is allowed at u_stop
  p.y.i_source = 9;
  const int dry = p.until(PvMode::dry);
  worst = worst_of({worst, unless(dry >= 15 && dry <= 18)});
  worst = worst_of({worst, off(p.until(PvMode::asleep), 11), off(p.x.t, 0)});
  p.y.u_dc = 250;
  worst = worst_of({worst, off(p.until(PvMode::running), 4)});
  return worst;
}

/// The ramp, its lead over the speed, its greatest speed; torque by the voltage.
double pump_torques() {
  double worst = 0;
  Pump p{pv()};
  p.until(PvMode::running);
  p.y.u_dc = 150;
  double ramp = p.x.omega_ramp;
  for (int n = 0; n < 8; ++n) {
    p.y.omega_m = n;
    p.step();
    ramp = std::fmin(ramp + 2.5, n + 5.0);
    worst = worst_of({worst, off(p.x.omega_ramp, ramp)});
  }
  p.step(3);
  worst = worst_of({worst, off(p.x.omega_ramp, 3)});
  p.step(-1);
  worst = worst_of({worst, off(p.x.omega_ramp, 0)});
  // The torque controller of the voltage: what the error asks for, at most all of it.
  Pump q{pv()};
  q.until(PvMode::running);
  q.y.omega_m = 0;
  q.x.link = 1;
  q.x.omega_ramp = 50;
  q.y.u_dc = 155;  // 5 V above the reference: 1 + 0.2 * 5
  worst = worst_of({worst, off(q.step(), 2), off(q.x.link, 1.05)});
  q.x.link = 20;
  q.y.u_dc = 120;  // half of tau_max is left
  worst = worst_of({worst, off(q.step(), 4.5)});
  q.x.link = 9;
  worst = worst_of({worst, off(q.step(), 3)});  // the error takes 6 off
  q.x.link = 8;
  q.x.omega_ramp = 0;
  q.y.omega_m = 0;
  q.y.u_dc = 160;
  q.control.acceleration = 0;
  q.x.omega_ramp = 1;  // the speed asks for 2 of 9: the voltage waits there
  worst = worst_of({worst, off(q.step(), 2), off(q.x.link, 2)});
  // The speed as actuator.
  Pump s{pv(Actuator::speed)};
  s.until(PvMode::running);
  s.x.omega_ramp = 50;
  s.x.link = 1;
  s.y.omega_m = 48;
  s.y.u_dc = 155;
  worst = worst_of({worst, off(s.step(), 0)});
  s.x.link = 50;
  s.x.omega_ramp = 50;
  worst = worst_of({worst, off(s.step(), 2 * (51 - 48))});
  return worst;
}

/// Without a sensor the array's current is that of the legs and of the capacitor; the reference
/// moves only where the voltage follows it.
double pump_currents() {
  Pump p{pv(Actuator::torque, ArrayCurrent::legs)};
  p.until(PvMode::running);
  p.y.i = {4, 0, 0};
  p.y.theta_e = 0;
  double u = 150, worst = 0;
  for (int n = 0; n < 9; ++n) {
    p.y.u_dc = u;
    p.step();
    p.control.remember(p.x, p.y, {hold<double>(up), hold<double>(still), hold<double>(still)});
    if (p.x.mean.n == 0 && n > 1) break;
    u += 0.5;
  }
  // Samples from 150 V on in steps of 0.5 V and 0.25 s: 8 F take 16 A besides the 4 A.
  worst = worst_of({worst, unless(p.x.tracker.has_last), off(p.x.tracker.i, 20) - 0.6,
                    off(p.x.tracker.p / p.x.tracker.u, p.x.tracker.i) - 0.1});
  Pump q{pv()};
  q.until(PvMode::running);
  q.y.u_dc = 158;  // two steps from 150
  for (int n = 0; n < 8; ++n) q.step();
  Pump far = q;
  far.x.mean = {};
  far.x.tracker.u_ref = 149.9;
  far.y.u_dc = 158;
  far.x.tracker.has_last = true;
  for (int n = 0; n < 8; ++n) far.step();
  return worst_of({worst, unless(q.x.tracker.has_last && q.x.tracker.u_ref != 150),
                   unless(!far.x.tracker.has_last), off(far.x.tracker.u_ref, 149.9)});
}

/// Braking torque falls off as the dc link rises; currents below zero are none; limits, speeds and
/// torques reach the law as `outer` says.
double frames() {
  double worst = 0;
  Frame<double> f;
  f.u_brake_full = 300;
  f.u_brake_none = 400;
  f.limits.tau = 30;
  Frame<double>::State<3> x;
  const auto asked = [&](double reference, double omega, double u, double expected) {
    Measurement<double, 3> y{.i = {-1, 2, -3}, .omega_m = omega, .u_dc = u};
    const double got = f.before<Uses{}, 3>(x, y, reference, f.tuning());
    worst = worst_of({worst, off(got, expected), off(y.i[0], 0), off(y.i[1], 2), off(y.i[2], 0),
                      off(x.tau_ref, f.outer == Outer::none ? 0 : got)});
  };
  asked(-20, 10, 300, -20);
  asked(-20, 10, 350, -10);
  asked(-20, 10, 380, -4);
  asked(-20, 10, 450, 0);
  asked(20, 10, 380, 20);
  asked(20, -10, 380, 4);
  asked(-20, -10, 380, -20);
  asked(99, 10, 200, 30);
  asked(-99, 10, 200, -30);
  f.outer = Outer::none;
  asked(99, 10, 200, 99);
  f.outer = Outer::speed;
  f.speed = {.K_p = 2, .K_i = 100, .tau_min = -50, .tau_max = 50, .T_s = 0.01};
  asked(12, 10, 200, 4);
  asked(12, 10, 200, 6);  // with what the integral has gathered
  asked(99, 10, 200, 30);
  const Uses uses = f.uses();
  f.outer = Outer::pv;
  f.motion = Motion::tracked;
  const Uses more = f.uses();
  f.outer = Outer::torque;
  f.motion = Motion::measured;
  f.load = LoadTorque::observer;
  return worst_of(
      {worst,
       unless(uses.speed && !uses.pv && !uses.observer && more.pv && more.observer && !more.speed),
       unless(f.uses().observer)});
}

/// Orders of a comparator become legs that are held, where there is none; turn-ons come early by
/// the dead time. A pump without a sensor of the array's current notes what they draw.
double frame_orders() {
  double worst = 0;
  Frame<double> f;
  f.comparators = Comparators::sampled;
  Frame<double>::State<3> x;
  Measurement<double, 3> y{.i = {3, 5.5, 4.9}, .theta_e = 1};
  Command<double, 3> orders{regulate(5.0, 0.2, still), regulate(5.0, 0.2, still),
                            regulate(5.0, 0.2, still)};
  f.after<Uses{}, 3>(x, y, orders, f.tuning());
  worst = worst_of({off(orders[0].leg[0], up), unless(orders[0].gate == Gate::timer),
                    off(orders[0].i_ref, 5), off(orders[1].leg[4], down), off(x.leg[0], up)});
  f.t_dead = 2e-6;
  Command<double, 3> timed{pulse(still, up, 1e-5, 3e-5), hold<double>(up), hold<double>(down)};
  f.after<Uses{}, 3>(x, y, timed, f.tuning());
  worst = worst_of(
      {worst, off(timed[0].t_edge[0], 8e-6), off(timed[0].t_edge[1], 3e-5), off(x.leg[0], still)});
  f.pv.current = ArrayCurrent::legs;
  const auto drawn = [&](Outer outer) {
    f.outer = outer;
    Frame<double>::State<3> fresh;
    f.after<Uses{}, 3>(fresh, y, orders, f.tuning());
    return fresh.pv.drawn.i[1];
  };
  return worst_of({worst, off(drawn(Outer::pv), 5.5), off(drawn(Outer::speed), 0)});
}

}  // namespace

int main() {
  check("maximum power point: both methods", trackers(), 0);
  check("the current that the legs draw", drawn_currents(), 1e-15);
  check("ripple of the link: learned [V]", ripples(), 0.3);
  check("least squares", least_squares(), 1e-4);
  check("pump: its states", pump_states(), 0);
  check("pump: ramp and torque", pump_torques(), 1e-12);
  check("pump: the array's current", pump_currents(), 0);
  check("frame: what the law is asked for", frames(), 1e-12);
  check("frame: what becomes of its orders", frame_orders(), 1e-18);
  return failures == 0 ? 0 : 1;
}
