// What watches over a drive, each part against its own words at the edge of every limit: readings
// and their ranges, flux linkages that voltages allow, the search of an angle, phases that are
// unlike, and the states of a drive.
#include <cmath>
#include <limits>
#include <string_view>

#include "errors.hpp"
#include "srm/control/guard/angle_search.hpp"
#include "srm/control/guard/likeness.hpp"
#include "srm/control/guard/protection.hpp"
#include "srm/control/guard/sequence.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr double T_s = 1e-4, pi_ = turn / 2;
constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr Leg down = Leg::demagnetize, still = Leg::freewheel, up = Leg::magnetize;

/// No iron: the inductance is a cosine, 2 mH to 10 mH.
struct Coil {
  using Scalar = double;
  int N_r = 4;
  Magnetics<double> at(double i, double theta_e) const {
    const double L = 6e-3 - 4e-3 * std::cos(theta_e);
    return {.psi = L * i, .W_c = L * i * i / 2, .tau = 0, .L_inc = L, .psi_theta = 0};
  }
};

/// What an order may do over a sample, against the window at every angle that the rotor may have.
double expectations() {
  double worst = 0;
  int held = 0, off_ = 0, either = 0;
  for (int n = 0; n < 2000; ++n) {
    const double theta = std::fmod(0.7 + 1.618 * n, turn), on = std::fmod(2.3 * n, turn);
    const double to = wrap(on + 0.4 + std::fmod(0.9 * n, 5.0)), error = 0.01 * (n % 5);
    const double ahead = 0.6 * std::sin(n);
    PhaseCommand<double> c = regulate(5.0, 0.5, still);
    set_thresholds(c, Comparators::analog);
    c.gate = Gate::window;
    c.theta_on = on;
    c.theta_off = to;
    const double from = theta + std::fmin(ahead, 0) - error,
                 last = theta + std::fmax(ahead, 0) + error;
    int inside = 0;
    for (int j = 0; j <= 400; ++j) inside += conducts(wrap(from + (last - from) * j / 400), on, to);
    const Expected<double> e = expected(c, theta, ahead, error, 0.2, T_s);
    const bool is_held = e.least == 1 && e.most == -1, is_off = e.least == -1 && e.most == -1;
    worst = worst_of({worst, unless(is_held == (inside == 401)), unless(is_off == (inside == 0))});
    if (is_held) worst = worst_of({worst, off(e.below, 4.5 - 0.2), off(e.above, 6 + 0.2)});
    if (!is_held && !is_off) {
      worst =
          worst_of({worst, unless(e.least == -1 && e.most == 1 && !(e.below > 0) && e.above > 0)});
    }
    (is_held ? held : is_off ? off_ : either) += 1;
  }
  // A window begins with its first angle, and ends before its last.
  PhaseCommand<double> half = regulate(5.0, 0.5, still);
  half.gate = Gate::window;
  half.theta_off = 1;
  const auto least_most = [&](double theta_e, double ahead, double least, double most) {
    const Expected<double> e = expected(half, theta_e, ahead, 0.0, 0.2, T_s);
    worst = worst_of({worst, off(e.least, least), off(e.most, most)});
  };
  least_most(0, 0.5, 1, -1);
  least_most(0.5, 0.5, -1, 1);
  least_most(1, 0.5, -1, -1);
  least_most(1.5, -0.5, -1, -1);
  const auto timer = expected(pulse(still, up, 1e-5, 4e-5), 1.0, 0.1, 0.1, 0.2, T_s);
  PhaseCommand<double> none = regulate(0.0, 0.5, still), open{};
  none.gate = open.gate = Gate::window;
  none.theta_off = open.theta_off = 3;
  const auto without = expected(none, 1.0, 0.1, 0.1, 0.2, T_s);
  open.gate = Gate::off;
  open.i_ref = 5;
  const auto nothing = expected(open, 1.0, 0.1, 0.1, 0.2, T_s);
  return worst_of({worst, unless(held > 200 && off_ > 200 && either > 100), off(timer.least, 0.3),
                   off(timer.most, 0.3), off(without.least, -1), off(without.most, -1),
                   off(nothing.least, -1), off(nothing.most, -1)});
}

/// Between which flux linkages a sample leads, and what a reading leaves of them.
double flux_bounds() {
  const FluxBounds<double> flux{
      .R = 2, .T_s = T_s, .i_error = 0.5, .model_error = 0.1, .u_margin = 0.05};
  const double u = 200, volt_seconds = T_s * u;
  const auto leads = [&](const Expected<double>& order, double i0, double i1, double least,
                         double most) {
    FluxBounds<double>::State x{.least = 0.1, .most = 0.3};
    flux.advance(x, order, i0, i1, u);
    return worst_of({off(x.least, least), off(x.most, most)});
  };
  const Expected<double> half{0.5, 0.5, 1e30, -1e30}, band{1, -1, 5, 7};
  double worst = worst_of(
      {leads(half, 4, 3, 0.1 + 0.45 * volt_seconds - 2 * 4 * T_s, 0.3 + 0.55 * volt_seconds),
       leads(half, -4, -3, 0.1 + 0.45 * volt_seconds, 0.3 + 0.55 * volt_seconds),
       leads(band, 4, 4.9, 0.1 + 0.95 * volt_seconds - 2 * 4.9 * T_s, 0.3 + 1.05 * volt_seconds),
       leads(band, 4, 5, 0.1 - 1.05 * volt_seconds - 2 * 5 * T_s, 0.3 + 1.05 * volt_seconds),
       leads(band, 7.1, 8, 0.1 - 1.05 * volt_seconds - 2 * 8 * T_s, 0.3 - 0.95 * volt_seconds),
       leads(band, 7, 8, 0.1 - 1.05 * volt_seconds - 2 * 8 * T_s, 0.3 + 1.05 * volt_seconds)});
  FluxBounds<double>::State low{.least = 0.001, .most = 0.001};
  flux.advance(low, {-1, -1, 1e30, -1e30}, 1, 1, u);
  FluxBounds<double>::State again{.least = 0, .most = 0.001};
  flux.advance(again, {-1, 0.2, 1e30, -1e30}, 1, 1, u);
  worst =
      worst_of({worst, off(low.least, 0), off(low.most, 0), off(again.most, 1.05 * volt_seconds)});
  const auto narrows = [&](double least, double most, double psi, double to_least, double to_most) {
    FluxBounds<double>::State x{.least = least, .most = most};
    const int side = flux.narrow(x, 5, psi);  // wrong by 0.1 + 0.5/5 of psi
    return worst_of({off(side, 0), off(x.least, to_least), off(x.most, to_most)});
  };
  FluxBounds<double>::State x{.least = 0.1, .most = 0.3}, y = x;
  return worst_of({worst, narrows(0.1, 0.3, 0.2, 0.16, 0.24), narrows(0.2, 0.21, 0.2, 0.2, 0.21),
                   narrows(0, 0.3, 0.3, 0.24, 0.3), off(flux.narrow(x, 5, 0.1 / 1.2 - 1e-9), -1),
                   off(flux.narrow(y, 5, 0.3 / 0.8 + 1e-9), 1)});
}

Protection<double> protection(int frozen = 0, int delay = 0) {
  return {.flux = {.R = 0.1, .T_s = T_s, .i_error = 0.1, .model_error = 0.1, .u_margin = 0.1},
          .levels = {.i_trip = 50,
                     .u_dc_min = 10,
                     .u_dc_max = 400,
                     .omega_max = 300,
                     .angle_slack = 0.05},
          .advance = {},
          .i_zero = 1,
          .delay = delay,
          .frozen = frozen};
}
using State = Protection<double>::State<3>;

Measurement<double, 3> quiet() { return {.theta_e = 1, .omega_m = 0, .u_dc = 100}; }

/// A reading at its limit passes, one beyond it is a fault of its own name.
double ranges() {
  const Protection<double> p = protection();
  double worst = 0;
  using Y = Measurement<double, 3>;
  const auto judged = [&](const Y& y, double reference, Status status, int phase, double value,
                          double limit) {
    State x;
    const bool good = p.admits(x, Coil{}, y, reference, p.levels);
    const double wrong = worst_of({unless(good == (status == Status::ok)),
                                   unless(x.fault.status == status), unless(!x.latched)});
    if (status == Status::ok) return wrong;
    const bool same = x.fault.value == value || (value != value && x.fault.value != x.fault.value);
    return worst_of({wrong, unless(x.fault.phase == phase && same && x.fault.limit == limit)});
  };
  const auto at = [&](auto change, double last, Status status, int phase, double limit) {
    Y y = quiet();
    change(y, last);
    const double next = std::nextafter(
        last, last == 0 || last == -1 || last == 10 || last == -300 ? -infinite : infinite);
    worst = worst_of({worst, judged(y, 0, Status::ok, 0, 0, 0)});
    change(y, next);
    worst = worst_of({worst, judged(y, 0, status, phase, next, limit)});
  };
  at([](Y& y, double v) { y.i[1] = v; }, 50, Status::over_current, 1, 50);
  at([](Y& y, double v) { y.i[2] = v; }, -1, Status::sensor_out_of_range, 2, -1);
  at([](Y& y, double v) { y.u_dc = v; }, 400, Status::over_voltage, -1, 400);
  at([](Y& y, double v) { y.u_dc = v; }, 10, Status::under_voltage, -1, 10);
  at([](Y& y, double v) { y.omega_m = v; }, 300, Status::over_speed, -1, 300);
  at([](Y& y, double v) { y.omega_m = v; }, -300, Status::over_speed, -1, 300);
  at([](Y& y, double v) { y.theta_e = v; }, 0, Status::sensor_out_of_range, -1, two_pi<double>);
  at([](Y& y, double v) { y.theta_e = v; }, std::nextafter(two_pi<double>, 0.0),
     Status::sensor_out_of_range, -1, two_pi<double>);
  const double nan = std::nan("");
  Y y = quiet();
  worst = worst_of({worst, judged(y, nan, Status::not_a_number, -1, nan, 0),
                    judged(y, infinite, Status::not_a_number, -1, infinite, 0)});
  for (int part = 0; part < 4; ++part) {
    y = quiet();
    (part == 0 ? y.i[2] : part == 1 ? y.theta_e : part == 2 ? y.omega_m : y.u_dc) = nan;
    worst = worst_of({worst, judged(y, 0, Status::not_a_number, part == 0 ? 2 : -1, nan, 0)});
  }
  return worst;
}

/// One sample out of range stops the law for itself alone; a second one among the next 16 for good.
double doubts() {
  const Protection<double> p = protection();
  double worst = 0;
  for (int good : {0, 3, 14, 15, 16, 40}) {
    State x;
    const auto sample = [&](double u) {
      Measurement<double, 3> y = quiet();
      y.u_dc = u;
      const bool admitted = p.admits(x, Coil{}, y, 0, p.levels);
      if (admitted) p.remember(x, 4, y, Command<double, 3>{}, p.levels);
      return admitted;
    };
    worst = worst_of({worst, unless(sample(100) && !sample(500) && !x.latched)});
    for (int n = 0; n < good; ++n) worst = worst_of({worst, unless(sample(100))});
    worst = worst_of({worst, unless(!sample(500) && x.latched == (good < 16))});
    if (x.latched) {
      worst = worst_of({worst, unless(!sample(100) && !sample(100)), off(x.fault.age, 2)});
      x.fault.age = 0xFFFFFFFF;
      worst = worst_of({worst, unless(!sample(100)), off(x.fault.age, 0xFFFFFFFF)});
    }
  }
  return worst;
}

/// Samples of one drive; i: what its channels show.
struct Samples {
  Protection<double> p;
  State x{};
  double theta_e = 1;
  bool wrong = false;  // a fault is told of a sample that is admitted

  bool admits(std::array<double, 3> i, Leg leg, double omega_m = 0, double u_dc = 100) {
    const Measurement<double, 3> y{.i = i, .theta_e = theta_e, .omega_m = omega_m, .u_dc = u_dc};
    if (!p.admits(x, Coil{}, y, 0, p.levels)) return false;
    wrong = wrong || x.fault.status != Status::ok;
    Command<double, 3> c{hold<double>(leg), hold<double>(down), hold<double>(down)};
    p.remember(x, 4, y, c, p.levels);
    return true;
  }
};

/// Currents against the voltage of their legs, at the machine's inductance.
double currents() {
  double worst = 0;
  const double L = Coil{}.at(1, 1).psi, rise = 100 * T_s / L;  // of a sample [A]
  for (int delay : {0, 1}) {
    Samples sound{protection(0, delay)}, low = sound, high = sound, dead = sound, over = sound;
    const auto of = [&](int n) { return std::fmax(0, n - delay) * rise; };
    Status found[4]{};
    for (int n = 0; n < 9; ++n) {
      worst = worst_of({worst, unless(sound.admits({of(n), 0, 0}, up))});
      if (!low.admits({of(n) > 1 ? 0.7 * of(n) : of(n), 0, 0}, up)) found[0] = low.x.fault.status;
      if (!high.admits({of(n) > 1 ? 1.5 * of(n) + 1 : 0, 0, 0}, up)) found[1] = high.x.fault.status;
      if (!dead.admits({0, 0, 0}, up)) found[2] = dead.x.fault.status;
      if (!over.admits({0, 0, n > 3 ? 5.0 : 0.0}, down)) found[3] = over.x.fault.status;
    }
    worst = worst_of({worst, unless(found[0] == Status::current_too_low && low.x.fault.phase == 0),
                      unless(found[1] == Status::current_too_high && high.x.fault.phase == 0),
                      unless(found[2] == Status::dead_current_sensor && dead.x.fault.phase == 0),
                      unless(found[3] == Status::current_too_high && over.x.fault.phase == 2),
                      unless(low.x.latched && !sound.x.latched && !sound.wrong)});
  }
  // A reading of zero may be off by i_zero and the error of a reading: 1.1 A, after five samples.
  Samples low{protection()};
  int n = 0;
  while (n < 20 && low.admits({0, 0, 0}, up, 0, 11)) ++n;
  return worst_of({worst, off(n, std::floor(L * 1.1 / (0.9 * 11 * T_s)) + 1)});
}

/// What is kept of the orders for the next sample: with a delay, those of the sample before.
double kept_orders() {
  double worst = 0;
  for (int delay : {0, 1}) {
    const Protection<double> p = protection(0, delay);
    State x;
    PhaseCommand<double> c = regulate(5.0, 0.5, still);
    set_thresholds(c, Comparators::analog);
    c.gate = Gate::window;
    c.theta_on = 0.8;
    c.theta_off = 2;
    Expected<double> last{-1, 1, never<double>, -never<double>};
    for (double theta_e = 0.3; theta_e < 2.6; theta_e += 0.05) {
      const Measurement<double, 3> y{.theta_e = theta_e, .omega_m = 250, .u_dc = 100};
      p.remember(x, 4, y, Command<double, 3>{c, c, c}, p.levels);
      const auto e = expected(c, theta_e, 4 * 250 * T_s * (1 + delay), 0.05, 0.1, T_s);
      const auto is = [&](const Expected<double>& a, const Expected<double>& b) {
        return a.least == b.least && a.most == b.most && a.below == b.below && a.above == b.above;
      };
      worst = worst_of({worst, unless(is(x.pending[0], e) && is(x.acting[0], delay ? last : e))});
      last = e;
    }
  }
  return worst;
}

/// Equal readings of a phase whose readings differ without current: at the number that is asked
/// for.
double frozen_sensors() {
  double worst = 0;
  const auto until = [&](int frozen, bool noisy, int resting) {
    Samples s{protection(frozen)};
    s.p.flux.model_error = 50;  // currents are judged by their changes alone
    s.p.flux.u_margin = 50;
    for (int n = 0; n < resting; ++n) s.admits({noisy && n % 2 ? 0.3 : 0.1, 0, 0}, down);
    for (int n = 0; n < 3; ++n) s.admits({5.0 + n, 0, 0}, still);
    for (int n = 1; n < 20; ++n) {
      if (!s.admits({7, 0, 0}, still)) {
        return s.x.fault.status == Status::frozen_current_sensor && s.x.fault.limit == frozen ? n
                                                                                              : -1;
      }
    }
    return 20;
  };
  return worst_of({worst, off(until(4, true, 30), 4), off(until(9, true, 30), 9),
                   off(until(4, false, 30), 20), off(until(0, true, 30), 20),
                   off(until(4, true, 19), 4), off(until(4, true, 17), 20)});
}

/// An angle that does not advance by what the speed says.
double angles() {
  double worst = 0;
  for (double wrong : {0.0, 0.004, -0.004}) {
    Samples s{protection()};
    const double omega = 100;
    int stopped = -1;
    for (int n = 0; n < 200 && stopped < 0; ++n) {
      if (!s.admits({0, 0, 0}, down, omega)) stopped = n;
      s.theta_e = wrap(s.theta_e + 4 * omega * T_s + wrong);
    }
    double slip = 0;
    int expected = 0;
    while (std::fabs(slip) <= 0.05 && expected < 200) {
      slip = slip * 63.0 / 64 + wrong;
      ++expected;
    }
    worst = worst_of({worst, off(stopped, wrong == 0 ? -1 : expected)});
    if (wrong != 0)
      worst = worst_of({worst, unless(s.x.fault.status == Status::stuck_angle),
                        off(s.x.fault.value, slip), off(s.x.fault.limit, 0.05)});
  }
  return worst;
}

/// The angle at which a current has a flux linkage, between the ends of the search.
double searches() {
  double worst = 0;
  for (int turn_ = 0; turn_ < 2; ++turn_) {
    for (double angle = 0.02; angle < 3.13; angle += 0.1) {
      AngleSearch<double> s{.turn = turn_};
      const double psi = Coil{}.at(5, angle).psi;
      s.begin(psi, 5, 0);
      worst = worst_of({worst, unless(!s.ends())});
      int steps = 0;
      while (!s.ends() && s.step(Coil{})) ++steps;
      worst = worst_of({worst, off(steps, 4), unless(s.found && s.low <= angle && s.high >= angle),
                        off(s.high - s.low, pi_ / 128)});
    }
    for (double psi : {0.009, 0.051}) {  // less and more than at any angle
      AngleSearch<double> s{.turn = turn_};
      s.begin(psi, 5, 0);
      while (!s.ends() && s.step(Coil{})) continue;
      const bool none = s.least() ? psi > 0.05 : psi < 0.01;
      worst = worst_of({worst, unless(s.found == !none)});
    }
  }
  return worst;
}

/// Of whole steps on a circle, those in the arc of a phase around unaligned or aligned.
double arcs() {
  double worst = 0;
  constexpr int n = 24, N = 3;
  int inside = 0;
  for (int turn_ = 0; turn_ < 2 * N; ++turn_) {
    for (double low = 0.1; low < 3; low += 0.37) {
      for (double shown : {0.0, 1.0, 5.0}) {
        AngleSearch<double> s{.theta_e = shown, .low = low, .high = low + 0.01, .turn = turn_};
        std::uint32_t offset = (1U << n) - 1, reversed = offset;
        const double error = 0.05;
        s.narrow<n, N>(offset, reversed, error);
        for (int j = 0; j < n; ++j) {
          const auto has = [&](double theta) {
            const double at = wrap(theta - turn_ / 2 * turn / N);
            const double past = std::fmin(at, turn - at);  // from unaligned
            const double reach = error + turn / n / 2;
            return s.least() ? past >= low - reach : past <= low + 0.01 + reach;
          };
          const bool a = has(shown + j * turn / n), b = has(j * turn / n - shown);
          worst = worst_of({worst, unless(a == ((offset >> j & 1) != 0)),
                            unless(b == ((reversed >> j & 1) != 0))});
          inside += a;
        }
      }
    }
  }
  return worst_of({worst, unless(inside > 100)});
}

/// Phase 1 of three has another ratio of its two flux linkages; each allowance by itself hides
/// as much as it says.
double unlikeness() {
  double worst = 0;
  struct Case {
    Likeness<double> part;
    double most;  // ratio apart that it hides
  };
  // Samples of 5 A with 0.1 Wb, 3 a window, 4 samples old; the voltage brings 0.02 Wb a sample.
  Likeness<double> none{};
  none.recent = 1000;
  Case cases[8]{};
  for (Case& c : cases) c.part = none;
  cases[0].part.spread = 0.02;
  cases[0].most = 0.04 * 1.3;  // 0.3 is taken by the resistance
  cases[1].part.i_gain = 0.03;
  cases[1].most = 0.06 * 1.3;
  cases[2].part.i_offset = 0.1;
  cases[2].most = 2 * 0.02 * 1.3;
  cases[3].part.i_noise = 0.1;
  cases[3].most = 2 * 0.1 * std::sqrt(3.0) / 15;
  cases[4].part.psi_error = 0.002;
  cases[4].most = 2 * 0.02;
  cases[5].part.u_noise = 0.0005;
  cases[5].most = 2 * 0.0005 * std::sqrt(12.0) * std::sqrt(3.0) / 0.3;
  cases[6].most = 2 * 0.003 / 0.1;  // what is left open by the sample itself
  cases[7].part.spread = 1e-9;
  cases[7].most = 2e-9 * 1.3;
  for (int which = 0; which < 8; ++which) {
    for (double sense : {-1.0, 1.0}) {
      for (double part : {0.99, 1.01}) {
        const Likeness<double>& like = cases[which].part;
        Likeness<double>::State<3> x;
        int found = -1;
        const double unlike = 1 + sense * part * cases[which].most;
        for (int period = 0; period < 3; ++period) {
          for (int k = 0; k < 3; ++k) {
            for (int n = 0; n < 3; ++n) {
              x.now += 5;
              worst = worst_of({worst, unless(!like.ends(x, k, 0.6))});
              like.hears(x, k,
                         {.theta_e = 0.3 + 0.05 * n,
                          .i = 5,
                          .psi = k == 1 ? 0.1 * unlike : 0.1,
                          .map = 0.1,
                          .taken = 0.03,
                          .left = which == 6 ? 0.003 : 0,
                          .age = 4});
            }
            worst = worst_of({worst, unless(like.ends(x, k, 0.6) && !like.ends(x, k, 0.5))});
            const int now = like.concludes(x, k, 0.02);
            if (now >= 0) found = now;
          }
        }
        worst = worst_of({worst, off(found, part > 1 ? 1 : -1)});
      }
    }
  }
  return worst;
}

/// What all phases have in common hides a difference only as far as they are not asked alike: by
/// what resistance, voltage and place on the map differ. Old ratios count for nothing.
double common_errors() {
  double worst = 0;
  const auto finds = [&](const Likeness<double>& like, double unlike, double taken, int age,
                         double i, int wait) {
    Likeness<double>::State<3> x;
    int found = -1;
    for (int period = 0; period < 3; ++period) {
      for (int k = 0; k < 3; ++k) {
        x.now += wait;
        for (int n = 0; n < 3; ++n) {
          const double map = k == 1 ? 0.02 * i : 0.1;
          like.hears(x, k,
                     {.theta_e = 0.3,
                      .i = k == 1 ? i : 5,
                      .psi = k == 1 ? map * unlike : map,
                      .map = map,
                      .taken = k == 1 ? taken : 0.03,
                      .left = 0,
                      .age = k == 1 ? age : 4});
        }
        found = std::max(found, like.concludes(x, k, 0.02));
      }
    }
    return found;
  };
  Likeness<double> R{}, u{}, map{};
  R.recent = u.recent = map.recent = 1000;
  R.R_error = 0.2;
  u.u_error = 0.01;
  map.map_error = 0.05;
  worst = worst_of(
      {off(finds(R, 1.001, 0.03, 4, 5, 1), 1), off(finds(R, 1.0199, 0.04, 4, 5, 1), -1),
       off(finds(R, 1.0201, 0.04, 4, 5, 1), 1), off(finds(u, 1.001, 0.03, 4, 5, 1), 1),
       off(finds(u, 1.0099, 0.03, 9, 5, 1), -1), off(finds(u, 1.0101, 0.03, 9, 5, 1), 1),
       off(finds(map, 1.001, 0.03, 4, 5, 1), 1), off(finds(map, 1.0199, 0.03, 4, 4, 1), -1),
       off(finds(map, 1.0201, 0.03, 4, 4, 1), 1), off(finds(map, 1.0199, 0.03, 4, 6.25, 1), -1),
       off(finds(map, 1.0201, 0.03, 4, 6.25, 1), 1), off(finds(R, 1.1, 0.03, 4, 5, 500), 1),
       off(finds(R, 1.1, 0.03, 4, 5, 501), -1)});
  return worst;
}

/// Two windows of an electrical period, and any phase: the unlike one is named in each window in
/// which it differed from all others, and no longer once another one changes.
double windows_of_likeness() {
  double worst = 0;
  Likeness<double> like{};
  like.spread = 0.01;
  like.recent = 1000;
  for (int unlike = 0; unlike < 3; ++unlike) {
    const int next = (unlike + 1) % 3, last = (unlike + 2) % 3;
    Likeness<double>::State<3> x;
    const auto hears = [&](int k, int window, double ratio) {
      x.now += 5;
      for (int n = 0; n < (k == 1 ? 6 : 3); ++n) {
        like.hears(x, k,
                   {.theta_e = (window + 0.5) * turn / 12,
                    .i = 5,
                    .psi = 0.1 * ratio,
                    .map = 0.1,
                    .taken = 0,
                    .left = 0,
                    .age = 4});
      }
      return like.concludes(x, k, 0.02);
    };
    for (int window : {3, 11}) {
      for (int k : {next, last, unlike}) {
        worst = worst_of({worst, off(hears(k, window, k == unlike ? 1.1 : 1), -1)});
      }
    }
    auto other = x, forgotten = x;
    worst = worst_of({worst, off(hears(next, 3, 1), unlike), off(hears(last, 11, 1), unlike)});
    x = other;
    worst = worst_of({worst, off(hears(next, 3, 1.1), -1), off(hears(last, 3, 1), -1)});
    x = forgotten;
    like.forget(x);
    worst = worst_of({worst, off(hears(next, 3, 1), -1), off(hears(last, 3, 1), -1),
                      off(hears(unlike, 3, 1.1), -1), off(hears(next, 3, 1), unlike)});
  }
  like.map_error = 1;  // places on the map that are alike hide nothing, however many samples
  Likeness<double>::State<3> x;
  int found = -1;
  for (int n = 0; n < 60; ++n) {
    const int k = n / 6 % 3;
    x.now += 1;
    like.hears(x, k,
               {.theta_e = 0.3,
                .i = 5,
                .psi = k == 1 ? 0.11 : 0.1,
                .map = 0.1,
                .taken = 0,
                .left = 0,
                .age = 4});
    if (n % 6 == 5 || (k == 2 && n % 6 == 2)) found = std::max(found, like.concludes(x, k, 0.02));
  }
  return worst_of({worst, off(found, 1)});
}

Sequence<double> sequence() {
  return {.T_s = 0.25,
          .u_ready = 100,
          .t_precharge = 2,
          .n_settle = 3,
          .n_calibrate = 4,
          .i_offset = 2,
          .t_command = 1,
          .u_chop_on = 300,
          .u_chop_off = 290,
          .reference_max = 10,
          .omega_none = 100};
}

/// Every state is left at its own sample, at the edge of its limit.
double states() {
  const Sequence<double> s = sequence();
  Sequence<double>::State<3> x;
  Request<double> ask{.enable = true};
  Measurement<double, 3> y{.i = {0.5, -2, 2}, .u_dc = 100};
  const auto samples_in = [&](Mode mode, bool commands = false) {
    int n = 0;
    while (x.mode == mode && n < 50) {
      ask.sequence += commands;
      s.step(x, y, ask);
      ++n;
    }
    return n;
  };
  double worst = worst_of({off(samples_in(Mode::off), 1), off(samples_in(Mode::precharge), 3)});
  worst = worst_of({worst, off(samples_in(Mode::calibrate), 4), unless(x.mode == Mode::ready),
                    off(x.offset[0], 0.5), off(x.offset[1], -2), off(x.offset[2], 2)});
  s.correct(x, y);
  worst = worst_of({worst, off(y.i[1], 0)});
  y.u_dc = 99.9;
  worst = worst_of({worst, off(samples_in(Mode::ready), 1), unless(x.mode == Mode::precharge),
                    off(samples_in(Mode::precharge), 9), unless(x.mode == Mode::fault),
                    unless(x.fault.status == Status::precharge_timeout), off(x.fault.value, 99.9)});
  s.step(x, y, ask);
  worst = worst_of({worst, off(x.fault.age, 1)});
  ask.clear = true;
  const bool enabled = s.clear(x, ask, true);
  ask.enable = false;
  const bool stays = s.clear(x, ask, false);
  worst = worst_of({worst, unless(!enabled && !stays && s.clear(x, ask, true)),
                    unless(x.mode == Mode::off && x.fault.status == Status::ok),
                    unless(!s.clear(x, ask, true))});
  ask = {.enable = true};
  y.u_dc = 100;
  for (const Mode mode : {Mode::off, Mode::precharge, Mode::calibrate}) samples_in(mode);
  worst = worst_of({worst, off(x.offset[1], -2), off(samples_in(Mode::ready), 50)});
  ++ask.sequence;
  worst = worst_of({worst, off(samples_in(Mode::ready), 1), unless(x.mode == Mode::run)});
  ++ask.sequence;
  s.step(x, y, ask);
  worst = worst_of({worst, off(samples_in(Mode::run), 5),
                    unless(x.fault.status == Status::command_timeout), off(x.fault.value, 1.25),
                    off(x.fault.limit, 1)});
  s.fail(x, {Status::hardware_trip});
  worst = worst_of({worst, unless(x.fault.status == Status::command_timeout)});
  for (const Mode mode : {Mode::precharge, Mode::calibrate, Mode::ready, Mode::run}) {
    x.mode = mode;
    s.step(x, y, {});
    worst = worst_of({worst, unless(x.mode == Mode::off)});
  }
  x = {};
  x.mode = Mode::calibrate;
  y.i[1] = 2.001;
  return worst_of({worst, off(samples_in(Mode::calibrate), 4), unless(x.mode == Mode::fault),
                   unless(x.fault.status == Status::calibration_failed), off(x.fault.phase, 1)});
}

/// The chopper holds between its two voltages; no motoring torque at the greatest speed.
double limits() {
  const Sequence<double> s = sequence();
  Sequence<double>::State<3> x;
  Measurement<double, 3> y{};
  double worst = 0;
  const auto chops = [&](double u, bool is) {
    y.u_dc = u;
    s.step(x, y, {});
    worst = worst_of({worst, unless(x.chopper == is)});
  };
  constexpr std::array names{"off", "precharge", "calibrate", "ready", "run", "fault"};
  for (int n = 0; n < 6; ++n) {
    worst = worst_of({worst, unless(std::string_view(describe(static_cast<Mode>(n))) == names[n])});
  }
  for (int n : {-1, 6}) {
    worst =
        worst_of({worst, unless(std::string_view(describe(static_cast<Mode>(n))) == "unknown")});
  }
  chops(300, false);
  chops(300.1, true);
  chops(290.1, true);
  chops(290, false);
  chops(299, false);
  const auto gives = [&](double reference, double omega, bool motors, double expected) {
    y.omega_m = omega;
    worst = worst_of({worst, off(s.limited({.reference = reference}, y, motors), expected)});
  };
  gives(12, 0, true, 10);
  gives(-12, 0, true, -10);
  gives(8, 95, true, 8);
  gives(8, 97.5, true, 4);
  gives(8, 100, true, 0);
  gives(8, 120, true, 0);
  gives(-8, -99, true, -1.6);
  gives(-8, 99, true, -8);
  gives(8, -99, true, 8);
  gives(8, 99, false, 8);
  return worst;
}

}  // namespace

int main() {
  check("orders: what they may do over a sample", expectations(), 1e-12);
  check("flux linkage: bounds by voltage and reading", flux_bounds(), 1e-15);
  check("readings: at their limits", ranges(), 0);
  check("readings: one that is out of range, and two", doubts(), 0);
  check("currents against the voltage", currents(), 0);
  check("orders that are kept for the next sample", kept_orders(), 0);
  check("current sensors that are frozen", frozen_sensors(), 0);
  check("angles against the speed", angles(), 1e-12);
  check("search of an angle", searches(), 1e-12);
  check("arcs of whole steps", arcs(), 0);
  check("phases that are unlike: own errors", unlikeness(), 0);
  check("phases that are unlike: common errors", common_errors(), 0);
  check("phases that are unlike: their windows", windows_of_likeness(), 0);
  check("states of a drive", states(), 1e-15);
  check("chopper and limits of the reference", limits(), 1e-12);
  return failures == 0 ? 0 : 1;
}
