// Readings against their limits, currents against the voltage of their legs, frozen sensors, and
// angles against the speed: each at the edge of its limit.
#include <cmath>
#include <limits>

#include "coil.hpp"
#include "errors.hpp"
#include "srm/control/guard/protection.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr double T_s = 1e-4;
constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr Leg down = Leg::demagnetize, still = Leg::freewheel, up = Leg::magnetize;
constexpr Coil coil{.L = 6e-3, .part = 2.0 / 3};  // 2 mH to 10 mH

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
    const bool good = p.admits(x, coil, y, reference, p.levels);
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
      const bool admitted = p.admits(x, coil, y, 0, p.levels);
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
    if (!p.admits(x, coil, y, 0, p.levels)) return false;
    wrong = wrong || x.fault.status != Status::ok;
    Command<double, 3> c{hold<double>(leg), hold<double>(down), hold<double>(down)};
    p.remember(x, 4, y, c, p.levels);
    return true;
  }
};

/// Currents against the voltage of their legs, at the machine's inductance.
double currents() {
  double worst = 0;
  const double L = coil.at(1, 1).psi, rise = 100 * T_s / L;  // of a sample [A]
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

}  // namespace

int main() {
  check("readings: at their limits", ranges(), 0);
  check("readings: one that is out of range, and two", doubts(), 0);
  check("currents against the voltage", currents(), 0);
  check("orders that are kept for the next sample", kept_orders(), 0);
  check("current sensors that are frozen", frozen_sensors(), 0);
  check("angles against the speed", angles(), 1e-12);
  return failures == 0 ? 0 : 1;
}
