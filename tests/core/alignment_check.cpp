// The alignment routine of commissioning: the order of the phases, direction and zero that it
// concludes from where a rotor rests, how long it waits, and how it takes energy out of a swing.
#include <algorithm>
#include <cmath>
#include <vector>

#include "errors.hpp"
#include "srm/control/commission/alignment.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr double T_s = 1e-3, pi_ = turn / 2, slack = 0.01, K_p = 2;
constexpr Alignment<double> routine{.hold = {.pi = {.K_p = K_p, .K_iT = 0}, .duty_max = 0.5},
                                    .i_hold = 5,
                                    .i_low = 2,
                                    .slack = slack,
                                    .n_rest = 20,
                                    .n_wait = 400};

/// A rotor without inertia. It turns to the phase that is driven by the shorter way, and friction
/// stops it short of it; half a period away it stays.
template <int N>
struct Bench {
  std::array<int, N> place{};     // of each leg, in the order of the rising angle
  double zero = 0.3;              // angle shown where leg 0 is unaligned [rad]
  double friction = 0.1;          // distance at which it stops the rotor [rad]
  std::array<double, N> moved{};  // of the phases from their places [rad]
  double i = 4;                   // that the phase carries [A]
  double angle = 2;               // [rad]
  int dead = -1;                  // a phase that does not turn the rotor
  Alignment<double>::State<N> x{};
  std::vector<int> driven{};  // the phase of each visit
  std::vector<double> done{};

  double target(int k) const { return zero + pi_ + place[k] * turn / N + moved[k]; }
  void step() {
    const int k = x.visit == 1 ? x.second : x.first;
    const bool begins = x.n == 0;
    if (begins) driven.push_back(k);
    Measurement<double, N> y{.theta_e = wrap(angle), .u_dc = 100};
    y.i[k] = i;
    const Command<double, N> orders = routine.step(x, y, T_s);
    int on = 0;
    for (int j = 0; j < N; ++j) on += orders[j].leg[1] == Leg::magnetize ? 1 << j : 0;
    if (on != 1 << k) driven.push_back(-1);  // 4 A are less than the reference
    if (x.n == 0) done.push_back(x.progress());
    const double away = std::remainder(target(k) - angle, turn);
    const bool stuck = k == dead || std::fabs(std::fabs(away) - pi_) < 0.01;
    const double left = std::fabs(away) - friction;
    if (!stuck && left > 0) angle += std::copysign(std::fmin(left, 0.3), away);
  }
  Finding run() {
    for (int n = 0; n < 9999 && x.finding == Finding::running; ++n) step();
    return x.finding;
  }
};

/// Every zero, order and direction, whatever the friction: it stops the rotor on both sides.
double orders_and_zeros() {
  double worst = 0;
  for (double zero : {0.0, 0.3, 3.1, pi_, 6.2}) {
    for (const auto& place : {std::array{0, 1, 2}, std::array{0, 2, 1}}) {
      Bench<3> b{.place = place, .zero = zero};
      worst += unless(b.run() == Finding::done && b.x.place[1] == place[1]);
      worst += unless(b.x.place[0] == 0 && b.x.place[2] == place[2]);
      worst += unless(b.x.direction == (place[1] == 1 ? 1 : -1));
      worst = worst_of({worst, std::fabs(std::remainder(b.x.zero - zero, turn)), b.x.spread});
    }
    for (const auto& place :
         {std::array{0, 1, 2, 3}, std::array{0, 3, 2, 1}, std::array{0, 2, 1, 3}}) {
      Bench<4> b{.place = place, .zero = zero};
      worst += unless(b.run() == Finding::done);
      worst += unless(b.x.direction == (place[1] == 1 ? 1 : place[1] == 3 ? -1 : 0));
      for (int k = 0; k < 4; ++k) worst += unless(b.x.place[k] == place[k]);
      worst = worst_of({worst, std::fabs(std::remainder(b.x.zero - zero, turn)), b.x.spread});
    }
  }
  return worst;
}

/// Three visits to each pair of phases. The first visit of all does not count, nor does one at
/// whose phase the rotor already is.
double visits() {
  Bench<3> b{.place = {0, 1, 2}, .angle = 0.3 + pi_ + 2};
  double worst =
      unless(b.run() == Finding::done && b.driven == std::vector{0, 1, 0, 0, 2, 0, 1, 2, 1});
  for (int n = 0; n < 8; ++n) worst = worst_of({worst, off(b.done[n], (n + 1) / 9.0)});
  worst += unless(b.x.n_below == std::array{1, 2, 1} && b.x.n_above == std::array{1, 1, 1});
  return worst;
}

/// Phases that are not a stroke apart: the zero is the mean, and no more than a quarter passes.
double places() {
  double worst = 0;
  for (double part : {0.99, 1.01}) {
    const double most = part * turn / 3 / 4 * 3 / 2;  // of one phase of three, off the mean by 2/3
    Bench<3> b{.place = {0, 1, 2}, .moved = {0, most, 0}};
    worst += unless(b.run() == (part < 1 ? Finding::done : Finding::no_order));
    worst = worst_of({worst, off(b.x.spread, most * 2 / 3)});
    if (part < 1) worst = worst_of({worst, off(b.x.zero, 0.3 + most / 3)});
  }
  Bench<5> twice{.place = {0, 1, 2, 4, 1}};
  return worst + unless(twice.run() == Finding::no_order);
}

/// A phase that does not turn the rotor, by an eighth of a period at least; no current; no rest.
double refusals() {
  Bench<3> still{.place = {0, 1, 2}, .dead = 1};
  double worst = unless(still.run() == Finding::no_motion);
  for (double part : {0.99, 1.01}) {
    Bench<3> near{.place = {0, 1, 2}, .friction = (turn / 3 - part * pi_ / 4) / 2};
    // From one rest to the next it turns by a stroke less twice the friction.
    worst += unless(near.run() == (part < 1 ? Finding::no_motion : Finding::done));
    Bench<3> weak{.place = {0, 1, 2}, .i = part * routine.i_low / 2};
    worst += unless(weak.run() == (part < 1 ? Finding::no_current : Finding::done));
  }
  Alignment<double>::State<3> x;
  int n = 0;
  for (; x.finding == Finding::running && n < 999; ++n) {
    Measurement<double, 3> y{.theta_e = wrap(0.1 * n), .u_dc = 100};
    routine.step(x, y, T_s);
  }
  return worst + unless(x.finding == Finding::too_long && n == routine.n_wait + 1);
}

/// The angle of a rest is a mean with a triangle over time, of angles no more than six slacks
/// apart; here across the end of a turn.
double rests() {
  double worst = 0;
  for (double width : {5.9, 6.1}) {
    const auto since_start = [&](int n) {
      const double part = std::fmin(n, 19) / 19;
      return width * slack * part * part;
    };
    Alignment<double>::State<3> x;
    int n = 0;
    for (; x.visit == 0 && n < 99; ++n) {
      const Measurement<double, 3> y{
          .i = {4, 0, 0}, .theta_e = wrap(6.27 + since_start(n)), .u_dc = 100};
      routine.step(x, y, T_s);
    }
    double mean = 0;
    for (int j = 0; j < 20; ++j) mean += (j < 10 ? j : 20 - j) / 100.0 * since_start(j);
    const bool at_once = width < 6;
    worst = worst_of(
        {worst, off(n, at_once ? 20 : 39), off(x.before, at_once ? mean : since_start(19))});
  }
  return worst;
}

/// A return by more than the slack is a turning point, either way round from the start.
double turning_points() {
  double worst = 0;
  for (double sense : {1.0, -1.0}) {
    Swing<double> s;
    s.start(0);
    for (int n = 1; n <= 60; ++n) {  // to 10, to -8, to 16
      const double x = sense * (n <= 10 ? n : n <= 28 ? 20 - n : n - 36);
      s.follow(x, 2.5, 1.5);
      worst += unless(s.idle == n % 2 && s.turned == (n < 13 ? 0 : n < 31 ? 1 : 2));
      worst += unless(s.comes(x, 18) == (n >= 31 && n < 37) && !s.comes(x, 18.1));
      const double far = sense > 0 ? s.high : -s.low, near = sense > 0 ? s.low : -s.high;
      worst = worst_of({worst, off(far, n < 13 ? 0 : 10), off(near, n < 31 ? 0 : -8)});
    }
    for (int n = 1; n < 9; ++n) {
      s.follow(sense * 24, 2.5, 1.5);
      worst += unless(s.idle == n);
    }
  }
  return worst;
}

/// While a swing comes back the current is low. A rotor that friction holds in it is at rest.
double swings() {
  const auto at = [](int n) { return 0.5 * std::cos(n * turn / 40); };
  const auto seen = [&](double angle) {
    return Measurement<double, 3>{.i = {3, 0, 0}, .theta_e = wrap(angle), .u_dc = 100};
  };
  double worst = 0;
  Alignment<double>::State<3> x, held;
  for (int n = 0; n < 200; ++n) {
    const Command<double, 3> orders = routine.step(x, seen(at(n)), T_s);
    const bool low = orders[0].leg[1] == Leg::demagnetize;
    const int part = n % 20;  // since a turning point
    if (part > 1 && part != 10) worst += unless(low == (n > 40 && part < 10));
  }
  int n = 0;
  for (; held.visit == 0 && n < 200; ++n) routine.step(held, seen(at(std::min(n, 45))), T_s);
  return worst + unless(x.visit == 0 && n == 45 + 10 + 20);
}

}  // namespace

int main() {
  check("order, direction and zero", orders_and_zeros(), 1e-12);
  check("visits, and which of them count", visits(), 1e-12);
  check("phases off their places", places(), 1e-12);
  check("motion, current and rest that are too little", refusals(), 0);
  check("the mean of a rest", rests(), 1e-12);
  check("turning points of a swing", turning_points(), 0);
  check("current in a swing", swings(), 0);
  return failures == 0 ? 0 : 1;
}
