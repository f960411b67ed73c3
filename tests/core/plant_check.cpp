// Parts of the plant, each against its own equation: courses and integrals, bridge, source, shaft,
// pump, photovoltaic array and what a fault makes of a phase.
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "errors.hpp"
#include "srm/plant/bridge.hpp"
#include "srm/plant/faults.hpp"
#include "srm/plant/shaft.hpp"
#include "srm/plant/source.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr Leg up = Leg::magnetize, still = Leg::freewheel, down = Leg::demagnetize;
constexpr Leg all[] = {down, still, up};

/// Straight between its points, constant outside; where it steps the piece that a step began in
/// holds to its end.
double courses() {
  const Course c{{1, 2, 2, 4}, {3, 5, 0, 1}};
  const double infinite = std::numeric_limits<double>::infinity();
  double worst = worst_of({off(c.at(-1), 3), off(c.at(1), 3), off(c.at(1.25), 3.5), off(c.at(2), 0),
                           off(c.at({2, 1.5}), 5), off(c.at({2, 2}), 0), off(c.at(3), 0.5),
                           off(c.at({4, 3}), 1), off(c.at(4), 1), off(c.at(99), 1)});
  worst = worst_of({worst, off(c.rate(0.5), 0), off(c.rate(1), 2), off(c.rate(1.9), 2),
                    off(c.rate(2), 0.5), off(c.rate(3.9), 0.5), off(c.rate(4), 0)});
  worst = worst_of({worst, off(c.next(0), 1), off(c.next(1), 2), off(c.next(2), 4),
                    unless(c.next(4) == infinite), off(c.moving({3, 2}).now, 0.5),
                    off(c.moving({3, 2}).rate, 0.5)});
  const Course one = constant(7);
  return worst_of({worst, off(one.at(-1), 7), off(one.at(1), 7), off(one.rate(1), 0),
                   unless(one.next(0) == infinite)});
}

/// Of a cubic and of its square, against Gauss' rule of four points; products by the product rule.
double integrals() {
  constexpr double h = 0.3, point[] = {0.3399810435848563, 0.8611363115940526},
                   weight[] = {0.6521451548625461, 0.3478548451374538};
  double worst = 0;
  for (int n = 0; n < 20; ++n) {
    const double c[] = {std::sin(n), 3 * std::cos(3.0 * n), 9 * std::sin(2.0 + n),
                        30 * std::cos(n)};
    const auto at = [&](double t) {
      return Moving{c[0] + t * (c[1] + t * (c[2] + t * c[3])),
                    c[1] + t * (2 * c[2] + t * 3 * c[3])};
    };
    double once = 0, squared = 0;
    for (int j = 0; j < 4; ++j) {
      const double x = j % 2 ? point[j / 2] : -point[j / 2];
      const double value = at(h / 2 * (1 + x)).now, w = h / 2 * weight[j / 2];
      once += w * value;
      squared += w * value * value;
    }
    const Moving a = at(0), b = at(h), product = a * b, less = a - b, more = a + b;
    worst = worst_of({worst, off(integral(a, b, h), once),
                      off(integral_of_square(a, b, h), squared), off(product.now, a.now * b.now),
                      off(product.rate, a.rate * b.now + a.now * b.rate),
                      off(less.now + 2 * b.now, more.now), off(less.rate + 2 * b.rate, more.rate),
                      off((2 * a).rate, 2 * a.rate), off((-a).rate, -a.rate)});
  }
  return worst;
}

constexpr Devices devices{.v_switch = 1.3, .R_switch = 0.01, .v_diode = 0.7, .R_diode = 0.003};

/// What is on in a leg: how many switches and diodes the current of the phase passes.
double own_switches() {
  const AsymmetricBridge bridge{devices};
  double worst = bridge.n_switches(4) == 8 ? 0 : 1;
  for (int n = 0; n < 3; ++n) {
    const Path p = bridge.path(all[n]);
    worst = worst_of({worst, off(p.level, n - 1), off(p.v, n * 1.3 + (2 - n) * 0.7),
                      off(p.R, n * 0.01 + (2 - n) * 0.003)});
    for (int to = 0; to < 3; ++to) {
      Switchings sum;
      bridge.count(sum, all[n], all[to], 200, 5);
      worst = worst_of({worst, off(sum.turn_ons, to > n ? to - n : 0),
                        off(sum.S_on, to > n ? 1000 * (to - n) : 0),
                        off(sum.S_off, to < n ? 1000 * (n - to) : 0)});
    }
  }
  const auto paths = bridge.paths<3>({up, down, still});
  for (int k = 0; k < 3; ++k) {
    const Path one = bridge.path(bridge.legs<3>({up, down, still})[k]);
    worst = worst_of({worst, off(paths.phase[k].level, one.level), off(paths.phase[k].v, one.v),
                      off(paths.phase[k].R, one.R), off(paths.R_shared, 0)});
  }
  Switchings sum;
  bridge.count<3>(sum, {up, down, still}, {down, up, still}, 200, {3, 5, 7});
  return worst_of({worst, off(sum.turn_ons, 2), off(sum.S_on, 2000), off(sum.S_off, 1200),
                   unless(conducts(up, 0.0) && conducts(down, 1e-9) && !conducts(still, 0.0))});
}

/// Which switches of the Miller converter are on: the three lower ones, then the upper one. Every
/// phase has a lower switch and a lower diode of its own.
std::array<bool, 4> on(const AllLegs<3>& legs) {
  std::array<bool, 4> is{};
  for (const Leg leg : legs) is[3] = is[3] || leg == up;
  for (int k = 0; k < 3; ++k) is[k] = legs[k] == up || (legs[k] == still && !is[3]);
  return is;
}

double shared_switches() {
  const SharedSwitchBridge bridge{devices};
  const PerPhase<3> i{3, 5, 7};
  double worst = bridge.n_switches(4) == 5 ? 0 : 1;
  const auto legs_of = [&](int n) {
    return bridge.legs<3>({all[n % 3], all[n / 3 % 3], all[n / 9]});
  };
  for (int n = 0; n < 27; ++n) {
    const AllLegs<3> legs = legs_of(n);
    const auto is = on(legs);
    const auto paths = bridge.paths<3>(legs);
    worst = worst_of({worst, off(paths.R_shared, is[3] ? 0.01 : 0.003)});
    for (int k = 0; k < 3; ++k) {
      const Leg ordered = all[k == 0 ? n % 3 : k == 1 ? n / 3 % 3 : n / 9];
      worst = worst_of({worst, off(legs[k], ordered == down && is[3] ? still : ordered),
                        off(paths.phase[k].level, static_cast<int>(legs[k])),
                        off(paths.phase[k].v, (is[k] ? 1.3 : 0.7) + (is[3] ? 1.3 : 0.7)),
                        off(paths.phase[k].R, is[k] ? 0.01 : 0.003)});
    }
    for (int to = 0; to < 27; ++to) {
      const auto will = on(legs_of(to));
      Switchings sum;
      bridge.count(sum, legs, legs_of(to), 200, i);
      double turn_ons = 0, S_on = 0, S_off = 0;
      for (int j = 0; j < 4; ++j) {
        const double S = 200 * (j < 3 ? i[j] : 3 + 5 + 7);
        turn_ons += will[j] && !is[j];
        S_on += will[j] && !is[j] ? S : 0;
        S_off += is[j] && !will[j] ? S : 0;
      }
      worst = worst_of(
          {worst, off(sum.turn_ons, turn_ons), off(sum.S_on, S_on), off(sum.S_off, S_off)});
    }
  }
  return worst;
}

/// The rates that a source states, against differences of its values along the solution.
double rates_of_a_source(const Source& source, double u, const Moving& i_dc, Moment m) {
  const Feed here = feed(source, u, i_dc, m);
  const double dt = 1e-6;
  const auto then = [&](double t) {
    return feed(source, u + t * here.du_dc.now, i_dc.now + t * i_dc.rate, {m.t + t, m.start});
  };
  const Feed on = then(dt), back = then(-dt);
  const auto miss = [&](Moving Feed::*of) {
    const double rate = ((on.*of).now - (back.*of).now) / (2 * dt);
    return std::fabs((here.*of).rate - rate) / (1 + std::fabs(rate));
  };
  return worst_of({miss(&Feed::du_dc), miss(&Feed::i), miss(&Feed::i_cap), miss(&Feed::p),
                   miss(&Feed::p_loss)});
}

/// C du/dt = (E - u)/R - i_dc; a rectifier blocks above E.
double batteries() {
  const Battery battery{.E = {{0, 1}, {100, 300}}, .R = 0.5, .C = 2e-3};
  const Moment m{0.4, 0.3};
  double worst = worst_of({off(start(battery), 100), off(stored(battery, 30), 0.9),
                           off(next_change(battery, 0.5), 1), off(forced(battery, 42, 0.5), 42)});
  for (double u : {150.0, 180.0, 230.0}) {
    for (bool one_way : {false, true}) {
      Battery b = battery;
      b.one_way = one_way;
      const double i = one_way && u > 180 ? 0 : (180 - u) / 0.5;
      const Feed f = feed(b, u, {7, 2000}, m);
      worst =
          worst_of({worst, off(f.du_dc.now * 2e-3, i - 7), off(f.i.now, i), off(f.i_cap.now, i - 7),
                    off(f.p.now, 180 * i), off(f.p_loss.now, 0.5 * i * i)});
      if (u != 180) worst = worst_of({worst, rates_of_a_source(b, u, {7, 2000}, m)});
      // At E itself a rectifier begins to feed where the voltage falls.
      if (u == 180) worst = worst_of({worst, off(f.i.rate * 0.5, 200 + 7 / 2e-3)});
    }
  }
  return worst;
}

/// A stiff link follows its course and delivers what is drawn.
double stiff_links() {
  const StiffSource link{{{0, 1, 1}, {100, 300, 50}}};
  const Feed f = feed(link, 180, {7, 2000}, {0.4, 0.3});
  return worst_of({off(start(link), 100), off(stored(link, 30), 0), off(next_change(link, 0.5), 1),
                   off(forced(link, 42, 0.25), 150), off(forced(link, 42, 1), 50),
                   off(f.du_dc.now, 200), off(f.i_cap.now, -7), off(f.p.now, 180 * 7),
                   off(f.p_loss.now, 0), rates_of_a_source(link, 180, {7, 2000}, {0.4, 0.3})});
}

PvArray array() {
  const double I_0 = 2e-8, a = 12, R_s = 1.5;
  return {.I_L = 9,
          .R_s = R_s,
          .R_sh = 400,
          .a = a,
          .alpha = 0.004,
          .v_block = 0.8,
          .C = 1e-3,
          .u_start = 150,
          .ln_ref = std::log(R_s * I_0 / a),
          .poa_global = {{0, 1}, {400, 1200}},
          .temp_cell = {{0, 2}, {10, 60}}};
}

/// i = I_L - I_0 exp(v/a) - G_sh v at v = u + R_s i, with the parameters of De Soto at G and T.
double diode_equation() {
  const PvArray pv = array();
  double worst = 0;
  for (double T : {-10.0, 25.0, 70.0}) {
    const double t = (T + 273.15) / 298.15, dT = T - 25;
    const double gap = 1.121 / (8.617333262e-05 * 298.15);
    const double I_0 = 2e-8 * t * t * t * std::exp(gap - gap * (1 - 0.0002677 * dT) / t);
    for (double G : {0.0, 100.0, 1000.0}) {
      for (double u = 0; u < 280; u += 7) {
        const auto p = pv.at(u, G, T);
        const double v = u + 1.5 * p.i;
        const double i =
            (9 + 0.004 * dT) * G / 1000 - I_0 * std::exp(v / (12 * t)) - v / 400 * G / 1000;
        const double slope = (pv.current(u + 1e-4, G, T) - pv.current(u - 1e-4, G, T)) / 2e-4;
        worst = worst_of({worst, off(p.i, i), off(p.slope, slope) / 3});
      }
    }
  }
  return worst_of({worst, off(pv.current(100, -50, 25), pv.current(100, 0, 25))});
}

/// In light that changes; behind the blocking diode, which lets nothing back.
double arrays() {
  const PvArray pv = array();
  const Moment m{0.5, 0.5};
  double worst =
      worst_of({off(start(pv), 150), off(stored(pv, 30), 0.45), off(forced(pv, 42, 0.5), 42),
                off(next_change(pv, 0.5), 1), off(next_change(pv, 1.5), 2)});
  for (double u : {120.0, 190.0, 260.0}) {
    const double i = std::fmax(pv.current(u + 0.8, 800, 22.5), 0);
    const Feed f = feed(pv, u, {2, 300}, m);
    worst = worst_of({worst, off(f.du_dc.now * 1e-3, i - 2), off(f.i.now, i),
                      off(f.i_cap.now, i - 2), off(f.p.now, (u + 0.8) * i),
                      off(f.p_loss.now, 0.8 * i), rates_of_a_source(pv, u, {2, 300}, m)});
  }
  return unless(pv.current(260.8, 800, 22.5) < 0) + worst;
}

/// tau_0 + B omega + k omega |omega| + what a function gives; the rotor turns against all of it.
double loads() {
  Shaft s{.rotation = Rotation::turning, .J = 0.02, .B = 0.1, .k = 0.03};
  s.tau_0 = {{0, 1}, {2, 4}};
  s.load = [](double omega) { return 5 * omega * omega * omega; };
  double worst = 0;
  for (double omega : {-3.0, 0.0, 2.0}) {
    const double load =
        3 + 0.1 * omega + 0.03 * omega * std::fabs(omega) + 5 * omega * omega * omega;
    const Moving alpha = acceleration(s, {40, 7}, omega, {0.5, 0.5});
    worst = worst_of({worst, off(load_torque(s, omega, {0.5, 0.5}), load),
                      off(alpha.now, (40 - load) / 0.02), off(alpha.rate, 7 / 0.02)});
  }
  const double without = load_torque(s, 3, {0.5, 0.5});
  s.pump = {.H_dry = -1, .k_dry = 0.2, .tau = {0, 0}, .rise = {0, 0}, .columns = 2};
  worst = worst_of({worst, off(load_torque(s, 3, {0.5, 0.5}), without + 0.2 * 9),
                    off(forced(s, 12, 0.5), 12), off(next_change(s, 0.5), 1)});
  s.pump = {};
  s.rotation = Rotation::locked;
  s.omega = {{0, 0.8}, {10, 18}};
  return worst_of({worst, off(acceleration(s, {40, 7}, 3, {0.5, 0.5}).now, 10),
                   off(forced(s, 12, 0.5), 15), off(next_change(s, 0.5), 0.8),
                   off(load_between(s, {1}, {2, 3}, {4}, {5, 6}, {0.5, 0.5}, 0.1), 0)});
}

/// Simpson's rule less the trapezoid: exact where the load is a cubic over the step.
double load_within_a_step() {
  Shaft s{.rotation = Rotation::turning, .J = 0.02, .B = 0.7};
  s.tau_0 = {{0, 1}, {2, 6}};
  const double h = 0.2, J = 0.02;
  const auto omega = [](double t) {
    return Moving{1 + t * (2 + t * (-30 + t * 70)), 2 + t * (-60 + t * 210)};
  };
  const auto load = [&](double t) { return 2 + 4 * (0.3 + t) + 0.7 * omega(t).now; };
  const auto needed = [&](double t) { return Moving(load(t) + J * omega(t).rate); };
  const double whole =
      h * (2 + 4 * 0.3) + 2 * h * h + 0.7 * (h + h * h - 10 * h * h * h + 17.5 * h * h * h * h);
  return off(load_between(s, needed(0), omega(0), needed(h), omega(h), {0.3, 0.3}, h),
             (h / 2 * (load(0) + load(h)) - whole) / J);
}

/// A torque that is a cubic over s and linear over the head is read exactly, also past the table.
double pumps() {
  const auto torque = [](double s, double H) {
    return (1 + 0.1 * H) * s * (2 + s * (3 - 0.5 * s));
  };
  const auto slope = [](double s, double H) { return (1 + 0.1 * H) * (2 + s * (6 - 1.5 * s)); };
  double worst = 0;
  for (int rows : {1, 3}) {
    Pump pump{.H_static = {{0, 1}, {10, 60}},
              .H_dry = 55,
              .k_dry = 0.001,
              .k_shut = 0.004,
              .omega2_per_m = 20,
              .H_first = 20,
              .H_step = 10,
              .s_step = 0.5,
              .columns = 6};
    for (int j = 0; j < rows * 6; ++j) {
      const double s = j % 6 * 0.5, H = 20 + j / 6 * 10;
      pump.tau.push_back(torque(s, H));
      pump.rise.push_back(slope(s, H) * 0.5);
    }
    for (double H = 11; H < 60; H += 4) {
      const Moment m{(H - 10) / 50, 0};
      const double row = rows == 1 ? 20 : H;
      for (double s = 0.05; s < 3.5; s += 0.1) {
        const double expected =
            s < 2.5 ? torque(s, row) : torque(2.5, row) + (s - 2.5) * slope(2.5, row);
        worst = worst_of({worst, off(pump.torque(std::sqrt(20 * H + s * s), m), expected)});
      }
      const double below = std::sqrt(20 * H) - 1e-9;
      worst = worst_of({worst, off(pump.torque(below, m), 0.004 * below * below),
                        off(pump.torque(-9, m), -0.004 * 81)});
    }
    worst = worst_of({worst, off(pump.torque(9, {0.95, 0.9}), 0.001 * 81),
                      off(pump.torque(-9, {0.95, 0.95}), -0.001 * 81)});
  }
  return worst_of({worst, off(Pump{}.torque(9, {0, 0}), 0)});
}

/// Each fault of a switch, over the orders: a leg is the number of switches on, less one.
double broken_legs() {
  const Broken kinds[] = {Broken::upper_open, Broken::lower_open, Broken::upper_shorted,
                          Broken::lower_shorted, Broken::open_wire};
  const Leg leg[5][3] = {{down, still, still},
                         {down, down, still},
                         {still, up, up},
                         {still, still, up},
                         {down, down, down}};
  double worst = 0;
  for (int kind = 0; kind < 5; ++kind) {
    Condition<3> is;
    is.add({.kind = kinds[kind], .phase = 1}, 0.5, 0);
    is.complete();
    for (int n = 0; n < 3; ++n) {
      worst = worst_of({worst, off(is.phase[1].leg(all[n]), leg[kind][n]),
                        off(is.phase[0].leg(all[n]), all[n]), unless(!is.leaks && !is.crossed)});
    }
  }
  return worst;
}

/// Shorted turns by the two equations of the winding; resistances by Ohm's law.
double broken_windings() {
  Condition<3> is;
  const double s = 0.3, R_f = 0.2, R = 0.5;
  is.add({.kind = Broken::turns_shorted, .phase = 0, .value = s, .R = R_f}, R, 0);
  is.add({.kind = Broken::winding_to_ground, .phase = 1, .R = 4}, R, 0);
  is.add({.kind = Broken::diode_shorted, .phase = 1, .R = 8}, R, 0);
  is.add({.kind = Broken::poor_contact, .phase = 2, .R = 3}, R, 0);
  is.complete();
  // u = (1 - s)(R i_1 + psi') + v, v = s (R i_2 + psi') = R_f (i_1 - i_2): i_1 at a given u, i_2
  const double i_1 = 10, i_2 = 4, v = R_f * (i_1 - i_2), psi_rate = v / s - R * i_2;
  const double u = (1 - s) * (R * i_1 + psi_rate) + v, mean = (1 - s) * i_1 + s * i_2;
  return worst_of({off(is.phase[0].G_turns * u, i_1 - mean), off(psi_rate, u - R * mean),
                   off(is.phase[1].G_link, 0.25 + 0.125), off(is.phase[1].G_ground, 0.25),
                   off(is.phase[2].R_contact, 3), unless(is.leaks && !is.crossed)});
}

/// Channels seen one through another, in the order of the faults; and whose current a gate sees.
double broken_sensors() {
  Condition<3> is;
  is.add({.kind = Broken::sensor_offset, .phase = 0, .value = 2}, 1, 0);
  is.add({.kind = Broken::sensor_gain, .phase = 0, .value = 3}, 1, 0);
  is.add({.kind = Broken::sensor_stuck, .phase = 1}, 1, 9);
  is.add({.kind = Broken::encoder_off, .value = 0.1}, 1, 0);
  is.add({.kind = Broken::encoder_lost_counts, .value = 0.2}, 1, 0.6);
  is.add({.kind = Broken::encoder_reversed}, 1, 0);
  double worst =
      worst_of({off(is.phase[0].channel.at(5), 21), off(is.phase[0].channel.inverse(21), 5),
                off(is.phase[1].channel.at(5), 9), off(is.rotor.at(0.5), -0.6),
                off(is.rotor.at(1), -1), off(is.rotor.inverse(-1), 1)});
  is.add({.kind = Broken::sensor_dead, .phase = 1}, 1, 0);
  is.add({.kind = Broken::encoder_frozen}, 1, 0.7);
  worst = worst_of({worst, off(is.phase[1].channel.at(5), 0), off(is.rotor.at(3), 0.7)});
  is.complete();
  worst = worst_of({worst, unless(!is.crossed && !is.leaks)});
  is.add({.kind = Broken::power_exchanged, .phase = 0, .other = 2}, 1, 0);
  is.complete();
  worst = worst_of({worst, unless(is.crossed), off(is.phase[0].watched, 2), off(is.watcher(2), 0),
                    off(is.watcher(0), 2), off(is.watcher(1), 1)});
  is.add({.kind = Broken::sensors_exchanged, .phase = 0, .other = 2}, 1, 0);
  is.crossed = false;
  is.complete();
  return worst_of({worst, unless(!is.crossed), off(is.watcher(2), 2)});
}

}  // namespace

int main() {
  check("course: pieces, steps, ends", courses(), 0);
  check("integrals: of a cubic and of its square", integrals(), 1e-14);
  check("asymmetric bridge: paths and turn-ons", own_switches(), 1e-15);
  check("Miller converter: paths and turn-ons", shared_switches(), 1e-15);
  check("stiff link: powers and rates", stiff_links(), 1e-7);
  check("battery: powers and rates", batteries(), 1e-7);
  check("array: the equation of its diode", diode_equation(), 3e-6);
  check("array: powers and rates", arrays(), 1e-4);
  check("shaft: torques against the rotation", loads(), 1e-12);
  check("shaft: the load within a step", load_within_a_step(), 1e-12);
  check("pump: cubic over speed, straight over the head", pumps(), 1e-9);
  check("faults: legs of broken switches", broken_legs(), 0);
  check("faults: what flows past a winding", broken_windings(), 1e-14);
  check("faults: what sensors show", broken_sensors(), 1e-14);
  return failures == 0 ? 0 : 1;
}
