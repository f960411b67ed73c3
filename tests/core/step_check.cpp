// The rates of the plant and an integration step, alone and with phases that couple: against
// differences along the solution, balances of energy and the order of each rule.
#include <array>
#include <cmath>
#include <functional>

#include "any_pairs.hpp"
#include "errors.hpp"
#include "srm/machine/lehuy.hpp"
#include "srm/sim/guard.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr int N = 3;
constexpr double R = 0.72;
using Motor3 = Plant<LeHuy<double>, N>;

/// Three phases, two of whose pairs may couple.
struct Bench {
  AnyPairs any;
  Motor3 plant;
  Circuit<N> circuit;
  PairPieces pieces;

  Bench(const Bench&) = delete;
  Bench(Bridge bridge, bool couples, AllLegs<N> legs)
      : plant{.machine = lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468),
              .R = R,
              .source = Battery{.E = {{0, 1}, {240, 740}}, .R = 0.4, .C = 2e-3},
              .bridge = bridge,
              .shaft = {.rotation = Rotation::turning, .J = 0.01, .tau_0 = {{0, 1}, {3, 203}}}} {
    if (couples) {
      any.pairs.N_r = 4;
      any.pairs.factor = 4e-11;
      plant.coupling = any.pairs;
      pieces.resize(2);
    }
    circuit.paths = paths(plant, legs);
    circuit.flows.fill(true);
  }

  Instant<N> at(const State<N>& x, double t = 0) {
    Instant<N> now{};
    now.x = x;
    evaluate(plant, x, circuit.flows, pieces, now.jets, now.links);
    rates(plant, x, now.jets, now.links, circuit, {t, 0}, now.rates);
    return now;
  }
  std::array<double, N> d2i(const Instant<N>& now) const {
    const Rates<N>& r = now.rates;
    if (plant.coupling.any()) {
      return bends<N>(circuit.flows, now.jets, now.links, r.i, r.v, r.omega_m);
    }
    std::array<double, N> d{};
    for (int k = 0; k < N; ++k) {
      if (circuit.flows[k]) d[k] = bend(now.jets[k], r.i[k], r.v[k], r.omega_m);
    }
    return d;
  }
  State<N> rate(const State<N>& x, double t = 0) {
    const Rates<N> r = at(x, t).rates;
    State<N> dx;
    for (int k = 0; k < N; ++k) dx.i[k] = r.i[k].rate;
    dx.omega_m = r.alpha.now;
    dx.theta_m = x.omega_m;
    dx.u_dc = r.u_dc.rate;
    return dx;
  }
  /// The state after a time, by many steps of the classical rule of order 4.
  State<N> later(State<N> x, double t) {
    constexpr int steps = 40;
    const double h = t / steps;
    for (int n = 0; n < steps; ++n) {
      const double now = n * h, half = now + h / 2;
      const State<N> a = rate(x, now), b = rate(moved(x, a, h / 2), half),
                     c = rate(moved(x, b, h / 2), half), d = rate(moved(x, c, h), now + h);
      x = moved(moved(moved(moved(x, a, h / 6), b, h / 3), c, h / 3), d, h / 6);
    }
    return x;
  }
  double i_dc(const State<N>& x) { return at(x).rates.i_dc.now; }
};

const State<N> somewhere{.i = {40, 30, 12}, .omega_m = 150, .theta_m = 0.31, .u_dc = 231};
const Bridge own = AsymmetricBridge{{1, 0.02, 0.7, 0.03}};
const Bridge shared = SharedSwitchBridge{{1, 0.02, 0.7, 0.03}};
constexpr AllLegs<N> legs_of_all = {Leg::magnetize, Leg::demagnetize, Leg::freewheel};
constexpr AllLegs<N> legs_of_shared = {Leg::magnetize, Leg::freewheel, Leg::freewheel};

/// With every bridge, with and without pairs.
double of_each(const std::function<double(Bench&)>& error) {
  double worst = 0;
  for (bool couples : {false, true}) {
    Bench a(own, couples, legs_of_all), b(shared, couples, legs_of_shared);
    worst = worst_of({worst, error(a), error(b)});
  }
  return worst;
}

double part(double found, double expected, double least) {
  return std::fabs(found - expected) / (std::fabs(expected) + least);
}

/// Each rate against the difference of its quantity along the solution.
double rates_of_all(Bench& b) {
  const double dt = 1e-7;
  const Instant<N> now = b.at(somewhere);
  const State<N> dx = b.rate(somewhere);
  const Instant<N> on = b.at(moved(somewhere, dx, dt), dt),
                   back = b.at(moved(somewhere, dx, -dt), -dt);
  double worst = 0;
  const auto compare = [&](const std::function<Moving(const Rates<N>&)>& of, double least) {
    const double rate = (of(on.rates).now - of(back.rates).now) / (2 * dt);
    worst = worst_of({worst, part(of(now.rates).rate, rate, least)});
  };
  const auto d2i = b.d2i(now);
  for (int k = 0; k < N; ++k) {
    compare([&](const Rates<N>& r) { return r.v[k]; }, 1e3);
    const double bend = (on.rates.i[k].rate - back.rates.i[k].rate) / (2 * dt);
    const double voltage = (on.jets[k].psi - back.jets[k].psi) / (2 * dt);
    worst = worst_of({worst, part(d2i[k], bend, 1e5), part(now.rates.v[k].now, voltage, 1)});
  }
  compare([](const Rates<N>& r) { return r.tau; }, 100);
  const double slope = 200 / 0.01;  // of the load, which the rate leaves out
  const double alpha = (on.rates.alpha.now - back.rates.alpha.now) / (2 * dt) + slope;
  worst = worst_of({worst, part(now.rates.alpha.rate, alpha, 1e4)});
  compare([](const Rates<N>& r) { return r.omega_m; }, 10);
  compare([](const Rates<N>& r) { return r.i_dc; }, 1e3);
  compare([](const Rates<N>& r) { return r.u_dc; }, 1e3);
  compare([](const Rates<N>& r) { return r.source.i; }, 1e3);
  return worst;
}

/// What the field gains is what the windings give less what the shaft takes.
double field_balance(Bench& b) {
  const double dt = 1e-7;
  const Rates<N> r = b.at(somewhere).rates;
  const State<N> dx = b.rate(somewhere);
  const double gain = (field_energy(b.plant, moved(somewhere, dx, dt)) -
                       field_energy(b.plant, moved(somewhere, dx, -dt))) /
                      (2 * dt);
  double given = -r.tau.now * somewhere.omega_m;
  for (int k = 0; k < N; ++k) given += r.v[k].now * somewhere.i[k];
  return part(given, gain, 1);
}

/// Kirchhoff's laws: the legs, their devices, the windings.
double voltages() {
  double worst = 0;
  const State<N>& x = somewhere;
  const auto judge = [&](Bench& b, std::array<double, N> u, double i_dc) {
    const Rates<N> r = b.at(x).rates;
    for (int k = 0; k < N; ++k) {
      worst = worst_of({worst, off(winding_voltage(b.plant, b.circuit, x, k), u[k]),
                        off(r.v[k].now, u[k] - R * x.i[k])});
    }
    worst = worst_of({worst, off(r.i_dc.now, i_dc),
                      off(source_now(b.plant, b.circuit, x, 0).i.now, (240 - x.u_dc) / 0.4),
                      off(source_now(b.plant, b.circuit, x, 0).du_dc.now, r.u_dc.rate)});
  };
  const auto [i_0, i_1, i_2] = x.i;
  const double u = x.u_dc, all = i_0 + i_1 + i_2;
  for (bool couples : {false, true}) {
    Bench a(own, couples, legs_of_all), b(shared, couples, legs_of_shared);
    judge(a, {u - 2 - 0.04 * i_0, -u - 1.4 - 0.06 * i_1, -1.7 - 0.05 * i_2}, i_0 - i_1);
    judge(b,
          {u - 2 - 0.02 * i_0 - 0.02 * all, -1.7 - 0.03 * i_1 - 0.02 * all,
           -1.7 - 0.03 * i_2 - 0.02 * all},
          i_0);
  }
  return worst;
}

/// Shorted turns and a path past the winding: what the dc link gives is what the legs take, and its
/// rate is right too.
double leaks() {
  Bench b(own, false, legs_of_all);
  const double G = 0.05, G_link = 0.01, u = somewhere.u_dc;
  const Path outer = AsymmetricBridge{{1, 0.02, 0.7, 0.03}}.path(Leg::magnetize);
  const double share = 1 / (1 + outer.R * G);
  b.circuit.paths.phase[0] = {share * outer.level, share * outer.v, share * outer.R + R};
  b.circuit.leak = {{{G, outer.level, G_link, 0}, {0, -1}, {}}};
  b.circuit.leaks = true;
  const double u_0 = winding_voltage(b.plant, b.circuit, somewhere, 0);
  const double terminal = somewhere.i[0] + G * u_0;
  const double i_dc = terminal - somewhere.i[1] + G_link * u;
  return worst_of({off(u_0, u - outer.v - outer.R * terminal), off(b.i_dc(somewhere), i_dc),
                   off(source_now(b.plant, b.circuit, somewhere, 0).du_dc.now,
                       ((240 - u) / 0.4 - i_dc) / 2e-3) /
                       1e3,
                   1e-4 * rates_of_all(b)});
}

/// Magnetics that are moved on a little, against those that are evaluated there: what is left falls
/// with the square of the way, of the torque over the currents with its third power.
double moved_magnetics() {
  double most = 0;
  for (bool couples : {false, true}) {
    Bench b(own, couples, legs_of_all);
    const auto miss = [&](double part, double dtheta, bool torque) {
      Instant<N> near = b.at(somewhere);
      const std::array<double, N> d{0.4 * part, -0.3 * part, 0.2 * part};
      State<N> x = somewhere;
      for (int k = 0; k < N; ++k) x.i[k] += d[k];
      x.theta_m += dtheta * part;
      const Instant<N> there = b.at(x);
      if (couples) {
        move_all<N>(near.jets, near.links, d, dtheta * part);
      } else {
        for (int k = 0; k < N; ++k) move(near.jets[k], d[k], dtheta * part);
      }
      double tau = 0, tau_theta = 0, worst = 0;
      for (int k = 0; k < N; ++k) {
        const Jet<double>&m = near.jets[k], &is = there.jets[k];
        tau += m.tau - is.tau;
        tau_theta += (m.tau_theta - is.tau_theta) * (dtheta == 0);
        worst =
            worst_of({worst, off(m.L_inc, is.L_inc) * 1e3, off(m.psi_theta, is.psi_theta) * 10});
      }
      worst = std::fmax(worst, std::fabs(tau_theta));
      for (int n = 0; n < near.links.n; ++n) {
        worst = worst_of({worst, off(near.links.of[n].L, there.links.of[n].L) * 1e3});
      }
      return torque ? std::fabs(tau) : worst;
    };
    // A quarter and an eighth, in percent more; what is smaller is rounding.
    const auto rate = [&](double dtheta, bool torque, double order) {
      const double left = miss(0.02, dtheta, torque), less = miss(0.01, dtheta, torque);
      most = worst_of({most, (less - 1e-11) / (left * order)});
    };
    rate(0, false, 0.25);
    rate(0.01, false, 0.25);
    rate(0, true, 0.125);
    rate(0.01, true, 0.25);
  }
  return most;
}

double difference(const State<N>& a, const State<N>& b) {
  double most = std::fmax(std::fabs(a.omega_m - b.omega_m), 10 * std::fabs(a.u_dc - b.u_dc));
  most = std::fmax(most, 1e3 * std::fabs(a.theta_m - b.theta_m));
  for (int k = 0; k < N; ++k) most = std::fmax(most, std::fabs(a.i[k] - b.i[k]));
  return most;
}

/// By how much more than its order says the error falls when the step is halved. whole: of the
/// step, else of its prediction. u_scale: of the voltage, whose corrections above a hundred
/// thousandth of it ask for the rates once more [V].
double order(Bench& b, bool whole, double u_scale = 1e6) {
  const bool held = b.plant.shaft.rotation == Rotation::locked;
  b.plant.shaft.B = whole ? 0.2 : 0.0;
  const Instant<N> start = b.at(somewhere);
  const StepStart<N> s{.circuit = b.circuit, .pieces = b.pieces, .t = 0, .d2i = b.d2i(start)};
  const auto miss = [&](double h) {
    Instant<N> end{};
    if (whole) {
      const Trial y = step(b.plant, start, s, {100, u_scale}, h, Guard{}, h, end);
      if (!y.fine || y.landed || y.h != h) return HUGE_VAL;
    } else {
      predict(start, s, h, end.x);
    }
    return difference(end.x, b.later(somewhere, h));
  };
  const double h = 4e-5;
  return held ? miss(h) : miss(h / 2) / miss(h) * (whole ? 16 : 8);
}

/// Where speed and voltage are held they are known, not predicted.
double error_at_held_speed(Bench& b) {
  b.plant.source = StiffSource{constant(231)};
  b.plant.shaft.rotation = Rotation::locked;
  return order(b, true);
}

/// The prediction of a current is corrected by almost all that it is off at once.
double first_correction(Bench& b) {
  const Instant<N> start = b.at(somewhere);
  const StepStart<N> s{.circuit = b.circuit, .pieces = b.pieces, .t = 0, .d2i = b.d2i(start)};
  const double h = 4e-5;
  Instant<N> end{};
  predict(start, s, h, end.x);
  evaluate(b.plant, end.x, b.circuit.flows, b.pieces, end.jets, end.links);
  const State<N> there = b.later(somewhere, h);
  const auto d = corrections(start, end, s, h, {}, b.plant.coupling.any());
  double left = 0, was = 0;
  for (int k = 0; k < N; ++k) {
    was = std::fmax(was, std::fabs(there.i[k] - end.x.i[k]));
    left = std::fmax(left, std::fabs(there.i[k] - end.x.i[k] - d[k]));
  }
  const double most = std::fmax(std::fabs(d[0]), std::fmax(std::fabs(d[1]), std::fabs(d[2])));
  const Trial y = step(b.plant, start, s, {50, 240}, h, Guard{}, h, end);
  return worst_of({left / was, off(y.spread, most / 50)});
}

/// The integrals of a step: what the field and the link gain, what the source gives.
double energies_from(Bench& b, const State<N>& x) {
  const double h = 5e-6;
  const Instant<N> start = b.at(x);
  const StepStart<N> s{.circuit = b.circuit, .pieces = b.pieces, .t = 0, .d2i = b.d2i(start)};
  Instant<N> end{};
  step(b.plant, start, s, {100, 240}, h, Guard{}, h, end);
  Integrals<N> q;
  add(q, start.rates, end.rates, R, 5, h);
  double copper = 0;
  for (const double i_squared : q.i_squared) copper += R * i_squared;
  const double field = field_energy(b.plant, end.x) - field_energy(b.plant, x);
  const double link = stored(b.plant.source, end.x.u_dc) - stored(b.plant.source, x.u_dc);
  const double work = 0.01 / 2 * (std::pow(end.x.omega_m, 2) - std::pow(x.omega_m, 2)) +
                      3 * (end.x.theta_m - x.theta_m) + 100 * h * h * x.omega_m;
  const double charge = std::get<Battery>(b.plant.source).C * (end.x.u_dc - x.u_dc);
  const double i_mean = q.E_source / 240 / h;
  return worst_of({part(q.E_winding - copper - q.E_mech, field, 1e-2),
                   part(q.E_source - q.E_loss - q.E_dc, link, 1e-2), part(q.E_mech, work, 1e-2),
                   part(q.E_loss, 0.4 * i_mean * i_mean * h, 1e-2) * 1e-4,
                   part(q.tau * q.tau / h, q.tau_squared, 1e-2) * 1e-4, off(q.tau_ref, 5 * h),
                   part(q.i_cap, charge, 1e-3),
                   part(q.i_cap * q.i_cap / h, q.i_cap_squared, 1e-2) * 1e-4,
                   part(q.error_squared, q.tau_squared - 10 * q.tau + 25 * h, 1e-6)});
}

/// From currents, and from none in the phase that is magnetized.
double energies(Bench& b) {
  State<N> starts = somewhere;
  starts.i[0] = 0;
  return worst_of({energies_from(b, somewhere), energies_from(b, starts)});
}

/// A step that is to end on a value ends on it, where a plain step of that length does.
double landings(Bench& b) {
  const Instant<N> start = b.at(somewhere);
  const StepStart<N> s{.circuit = b.circuit, .pieces = b.pieces, .t = 0, .d2i = b.d2i(start)};
  const Scale scale{100, 240};
  double worst = 0;
  Instant<N> there{}, end{};
  const double h = 3e-5;
  step(b.plant, start, s, scale, h, Guard{}, h, there);
  for (int k : {0, 1, 2, Guard::angle, Guard::link}) {
    Guard g{.k = k};
    g.value = watched(g, there.x);
    g.direction = g.value > watched(g, start.x) ? 1 : -1;
    worst = worst_of({worst, unless(distance(g, start.x) > 0 && !(distance(g, there.x) > 0))});
    const Trial y = step(b.plant, start, s, scale, 0.9 * h, g, 2 * h, end);
    // A voltage is found by the slope at the start.
    const double known = k == Guard::link ? 1e-3 : 1;
    worst = worst_of({worst, unless(y.landed && y.fine), off(watched(g, end.x), g.value),
                      known * part(y.h, h, 0), known * 0.02 * difference(end.x, there.x)});
    const Trial late = step(b.plant, start, s, scale, 0.9 * h, g, 0.95 * h, end);
    worst = worst_of({worst, unless(!late.landed)});
  }
  const double behind = start.x.i[0] - 2e-6 * start.rates.i[0].rate;  // before the step begins
  const Trial back = step(b.plant, start, s, scale, 1e-6, {0, behind, -1}, h, end);
  worst = worst_of({worst, unless(!back.landed)});
  return worst;
}

/// A phase without current sees what the others induce; may_open spares no phase that opens.
double openings() {
  Bench b(own, true, legs_of_all);
  b.any.pairs.factor = b.plant.coupling.factor = 1e-8;
  double worst = 0;
  int spared = 0;
  for (int k = 0; k < N; ++k) {
    for (double omega : {-300.0, 20.0, 150.0}) {
      State<N> x = somewhere;
      x.i = {5, 4, 3};
      x.i[k] = 0;
      x.omega_m = omega;
      b.circuit.flows.fill(true);
      b.circuit.flows[k] = false;
      const Instant<N> now = b.at(x);
      const double theta_e = electrical_angle(b.plant, x.theta_m, 0);
      const double v =
          induced<N>(b.plant.coupling, b.pieces, b.circuit.flows, now.rates.i, theta_e, omega, k);
      const State<N> dx = b.rate(x);
      const auto linked = [&](double dt) {
        const State<N> y = moved(x, dx, dt);
        double psi = 0;
        for (int n = 0; n < 2; ++n) {
          const int first = b.any.first[n], second = b.any.second[n];
          const auto m =
              b.any.pairs.at(n, y.i[first], y.i[second], electrical_angle(b.plant, y.theta_m, 0));
          if (first == k) psi += m.psi_first;
          if (second == k) psi += m.psi_second;
        }
        return psi;
      };
      worst = worst_of({worst, part(v, (linked(1e-8) - linked(-1e-8)) / 2e-8, 1e-4)});
      const auto may = [&](double drive) {
        return may_open<N>(b.plant.coupling, b.pieces, b.circuit.flows, now.rates.i, omega, k,
                           drive);
      };
      worst = worst_of({worst, unless(may(v + 1e-9) && may(1e-9))});
      spared += !may(-1);  // far from what they can induce
    }
  }
  return worst_of({worst, unless(spared == 9)});
}

/// What a phase without current is induced at most, where it can be: all numbers of the table are
/// positive, and the functions of the currents a single convex cubic.
double most_induced() {
  AnyPairs any;
  const double last = 9.0, cells = 5 / pi<double>;
  double worst = 0;
  any.C.clear();
  for (int n = 0; n < 2 * 8 * 9;
       ++n) {  // over the angle a straight line, of each pair of functions
    any.C.push_back((1 + n / 9 % 8) * (1 + n % 9 / 3) * (2.0 + n % 3));
  }
  any.f.clear();
  for (int n = 0; n < 2 * 3 * 3; ++n) {
    const double i = any.knot[static_cast<std::size_t>(n / 3 % 3)], c = 1 + n % 3;
    any.f.insert(any.f.end(),
                 {i * (c + i * (0.5 + 0.2 * i)), c + i * (1 + 0.6 * i), 0.5 + 0.6 * i, 0.2});
  }
  any.pairs.f.data = any.f.data();
  any.pairs.C.data = any.C.data();
  double L[2]{}, psi_theta[2]{};  // of the first and of the second function of C's rows
  for (int p = 0; p < 3; ++p) {
    for (int q = 0; q < 3; ++q) {
      const double C = (1 + p) * (2.0 + q), of_p = 1 + p, of_q = 1 + q;  // slopes at no current
      L[0] += 8 * C * of_p * (of_q + last * (1 + 0.6 * last));
      L[1] += 8 * C * of_q * (of_p + last * (1 + 0.6 * last));
      psi_theta[0] += C * of_p * last * (of_q + last * (0.5 + 0.2 * last));
      psi_theta[1] += C * of_q * last * (of_p + last * (0.5 + 0.2 * last));
    }
  }
  const double factor = any.pairs.factor, most_L = factor * std::fmax(L[0], L[1]),
               most_psi_theta = factor * std::fmax(psi_theta[0], psi_theta[1]) * 6 * cells;
  for (int n = 0; n < 2; ++n) {
    PairPiece piece;
    piece.jet(any.pairs, n, 1, 1, 0.3);
    worst = worst_of({worst, part(piece.most_induced(-2, 0), 2 * most_L, 0),
                      part(piece.most_induced(0, -3), 3 * most_psi_theta, 0),
                      part(piece.most_induced(2, 3), 2 * most_L + 3 * most_psi_theta, 0)});
  }
  return worst;
}

/// When a parabola gets to a value for the first time, and its turn within a step.
double curves() {
  double worst = 0;
  const double infinite = HUGE_VAL;
  for (double t : {0.1, 0.7, 2.0}) {
    for (double rate : {-3.0, -0.5, 0.5, 3.0}) {
      for (double second : {-0.4, 0.0, 0.4}) {
        const double left = t * (rate + t / 2 * second);
        const bool turned = (rate + t * second) * rate < 0;
        if (left * rate > 0 && !turned)
          worst = worst_of({worst, off(arrival(left, rate, second), t)});
        if (second == 0) worst = worst_of({worst, unless(arrival(-left, rate, 0) == infinite)});
      }
    }
  }
  worst =
      worst_of({worst, unless(arrival(1, 1, -1) == infinite && arrival(0, 1, 0.5) == infinite)});
  for (double x : {0.2, 0.5, 0.8}) {  // 5 - c (t - x h)^2 has its extreme there
    for (double c : {-4.0, 4.0}) {
      const double h = 0.6;
      const auto at = [&](double t) {
        return Moving{5 - c * (t - x * h) * (t - x * h), -2 * c * (t - x * h)};
      };
      worst = worst_of({worst, off(extreme(at(0), at(h), h), 5)});
      const Cubic y(at(0), at(h), h);
      worst =
          worst_of({worst, off(y.at(0.3), at(0.3 * h).now), off(y.slope(0.3) / h, at(0.3 * h).rate),
                    off(y.curve(0.3) / h / h, -2 * c)});
    }
  }
  const double steep = extreme({0, 3}, {1, -2}, 1);  // t (3 - 3 t^2 + t^3 ...): a cubic
  double most = 0;
  for (double t = 0; t <= 1; t += 1e-4) most = std::fmax(most, Cubic({0, 3}, {1, -2}, 1).at(t));
  return worst_of({worst, off(extreme({0, 3}, {4, 1}, 1), 4), 1e-4 * off(steep, most)});
}

/// Which of several values a current meets first.
double meetings() {
  Met none, up, down, turn;
  const Span span{1, 5};
  none.consider(span, 0, {2, 1}, {4, 1}, 1);
  up.consider(span, 1, {2, 4}, {6, 4}, 1);
  up.consider(Span{}, 0, {2, 4}, {6, 4}, 1);
  up.consider({Guard::angle, 10, 1}, 0, 11);
  down.consider({Guard::angle, 10, 1}, 0, 20);
  down.consider(span, 2, {2, -5}, {-3, -5}, 1);
  turn.consider(span, 0, {4.5, 4}, {4.5, -4}, 1);
  Met at, away;
  at.consider({0, 5, 1}, 5, 5.1);
  away.consider({0, 5, 1}, 5, 4.9);
  return worst_of({off(none.guard.direction, 0), off(up.guard.k, 1), off(up.part, 0.75),
                   off(up.guard.value, 5), off(down.guard.k, 2), off(down.part, 0.2),
                   off(down.guard.value, 1), off(turn.guard.direction, 1), off(at.part, 0),
                   off(away.guard.direction, 0)});
}

}  // namespace

int main() {
  check("rates: along the solution", of_each(rates_of_all), 1e-5);
  check("rates: power into the field", of_each(field_balance), 1e-6);
  check("rates: voltages of the windings", voltages(), 1e-10);
  check("rates: currents past the windings", leaks(), 1e-9);
  check("step: magnetics that are moved on [of their order]", moved_magnetics(), 1.1);
  check("step: prediction [of order 3]", of_each([](Bench& b) { return order(b, false); }), 1.15);
  check("step: the whole [of order 4]", of_each([](Bench& b) { return order(b, true); }), 1.4);
  check("step: with the voltage that its rates are of",
        of_each([](Bench& b) { return order(b, true, 1e-2); }), 1.4);
  check("step: at held speed and voltage [A]", of_each(error_at_held_speed), 1e-5);
  check("step: what the first correction leaves", of_each(first_correction), 0.003);
  check("step: energies", of_each(energies), 1e-7);
  check("step: ends on a value", of_each(landings), 1e-4);
  check("coupled: what opens a phase", openings(), 1e-5);
  check("coupled: what is induced at most", most_induced(), 1e-12);
  check("guard: arrivals and turns", curves(), 1e-9);
  check("guard: the first of several", meetings(), 1e-12);
  return failures == 0 ? 0 : 1;
}
