// Parts of the frame around a control law, each against its formula or its own words.
#include <cmath>

#include "errors.hpp"
#include "srm/control/frame/comparator.hpp"
#include "srm/control/frame/edge_limits.hpp"
#include "srm/control/frame/limited_pi.hpp"
#include "srm/control/frame/speed_pi.hpp"
#include "srm/control/frame/speed_ramp.hpp"
#include "srm/control/frame/timer_ticks.hpp"
#include "srm/control/frame/user_limits.hpp"
#include "srm/control/frame/whole_periods.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr Leg up = Leg::magnetize, still = Leg::freewheel, down = Leg::demagnetize;

/// The comparator's rule as a table: below the band, in it, above it, above the run-away threshold.
double comparators() {
  double worst = 0;
  for (Leg chop : {still, down}) {
    PhaseCommand<double> c = regulate(100.0, 10.0, chop);
    set_thresholds(c, Comparators::analog);
    worst = worst_of({worst, off(c.i_lower, 90), off(c.i_upper, 110), off(c.i_centre, 100),
                      off(c.i_runaway, 120)});
    for (Leg leg : {down, still, up}) {
      const Leg low = leg == down ? chop : leg;
      // At a threshold the leg is as between it and the reference.
      worst = worst_of({worst, off(compared(c, leg, 90.0), low), off(compared(c, leg, 100.0), low),
                        off(compared(c, leg, 110.0), leg),
                        off(compared(c, leg, 120.0), leg == down ? down : chop)});
      worst =
          worst_of({worst, off(compared(c, leg, 89.0), up), off(compared(c, leg, 95.0), low),
                    off(compared(c, leg, 105.0), leg),
                    off(compared(c, leg, 115.0), leg == down ? down : chop),
                    off(compared(c, leg, 121.0), down), off(compared(c, leg, std::nan("")), down)});
    }
    set_thresholds(c, Comparators::two_level);
    worst = worst_of({worst, off(compared(c, down, 1e6), chop), off(compared(c, up, 111.0), chop)});
    c = regulate(10.0, 10.0, chop);  // a reference in its own band starts at half of it
    set_thresholds(c, Comparators::analog);
    worst = worst_of({worst, off(c.i_lower, 5), off(c.i_upper, 15)});
    worst = worst_of({worst, off(compared(regulate(0.0, 1.0), up, -1.0), down)});
  }
  PhaseCommand<double> c = regulate(100.0, 10.0);
  set_thresholds(c, Comparators::analog);
  c.gate = Gate::window;
  c.theta_on = -0.5;
  c.theta_off = 2;
  const double k_1 = turn / 3;  // where phase 1 is at zero
  return worst_of({worst, off(compared<3>(c, up, 50.0, k_1 - 0.4, 1), up),
                   off(compared<3>(c, up, 50.0, k_1 - 0.6, 1), down),
                   off(compared<3>(c, up, 50.0, k_1 + 1.9, 1), up),
                   off(compared<3>(c, up, 50.0, k_1 + 2.1, 1), down)});
}

/// An order that is compared at the sample is a leg that is held, and keeps its reference.
double compared_at_samples() {
  Command<double, 2> c{regulate(100.0, 10.0), hold<double>(still)};
  for (PhaseCommand<double>& order : c) set_thresholds(order, Comparators::sampled);
  std::array<Leg, 2> leg = all_demagnetized<2>();
  compare_now<double, 2>(c, Measurement<double, 2>{.i = {50, 50}}, leg);
  return worst_of({off(leg[0], up), off(leg[1], still), off(c[0].leg.back(), up),
                   off(c[0].i_ref, 100), unless(c[0].gate == Gate::timer)});
}

/// Limits of a user cut references, and no leg magnetizes above the current.
double limits_of_a_user() {
  const UserLimits<double> u{.tau = 5, .i = 40};
  double worst = worst_of({off(u.cut(7), 5), off(u.cut(-7), -5), off(u.cut(-4), -4)});
  Command<double, 3> c{regulate(100.0, 2.0), pulse<double>(still, up, 1e-5, 2e-5),
                       pulse<double>(down, up, 1e-5, 2e-5)};
  u.apply<3>(c, Measurement<double, 3>{.i = {0, 41, 39}}, Comparators::analog);
  worst = worst_of({worst, off(c[0].i_ref, 40), off(c[0].i_upper, 42), off(c[1].leg[1], still),
                    off(c[1].leg[0], still), off(c[2].leg[1], up), off(c[2].leg[0], down)});
  c[0] = regulate(30.0, 2.0);
  u.apply<3>(c, Measurement<double, 3>{}, Comparators::analog);
  return worst_of({worst, off(c[0].i_ref, 30)});
}

/// Conditional integration: at a limit the integral moves inwards only.
double integrals() {
  const SpeedPi<double> pi_law{.K_p = 2, .K_i = 10, .tau_min = -8, .tau_max = 5, .T_s = 0.01};
  SpeedPi<double>::State x;
  double worst = off(pi_law.step(x, 1, 0), 2);
  worst = worst_of({worst, off(x.tau_integral, 0.1), off(pi_law.step(x, 11, 1, 0.5), 5),
                    off(x.tau_integral, 0.1), off(pi_law.step(x, 0, 9), -8),
                    off(x.tau_integral, 0.1), off(pi_law.step(x, 0, 0, -20), -8)});
  worst = worst_of({worst, off(pi_law.step(x, 1, 0, -20), -8), off(x.tau_integral, 0.2)});
  const LimitedPi<double> limited{.K_p = 2, .K_iT = 0.1};
  double integral = 0;
  worst = worst_of({worst, off(limited.step(integral, 1, -8, 5), 2), off(integral, 0.1),
                    off(limited.step(integral, 9, -8, 5), 5), off(integral, 0.1),
                    off(limited.step(integral, -9, -8, 5), -8), off(integral, 0.1),
                    off(limited.step(integral, 1, -8, 0.05), 0.05), off(integral, 0.05)});
  integral = 4.95;
  limited.step(integral, -30, -60, 5);
  return worst_of({worst, off(integral, 1.95)});
}

/// The reference moves as fast as the torque that the load leaves, and no faster than its rate.
double ramps() {
  const SpeedRamp<double> ramp{.J = 0.5, .tau = 10, .rate = 1e9, .T_s = 0.01};
  SpeedRamp<double>::State x;
  double worst = off(ramp.step(x, 100, 7, 4), 6);  // 10 - 4 N m for 12 rad/s^2
  worst =
      worst_of({worst, off(x.omega_ref, 7.12), off(ramp.step(x, -100, 7, 4), -14),
                off(x.omega_ref, 6.84), off(ramp.step(x, 100, 7, 12), 0), off(x.omega_ref, 6.84),
                off(ramp.step(x, 6.9, 7, 0), 0.5 * 0.06 / 0.01), off(x.omega_ref, 6.9)});
  const SpeedRamp<double> slow{.J = 0.5, .tau = 10, .rate = 3, .T_s = 0.01};
  slow.step(x, 100, 0, 0);
  worst = worst_of({worst, off(x.omega_ref, 6.93)});
  slow.step(x, -100, 0, 0);
  worst = worst_of({worst, off(x.omega_ref, 6.9)});
  const SpeedRamp<double> none{.J = 0.5, .tau = 0, .rate = 3, .T_s = 0.01};
  return worst_of({worst, off(none.step(x, 55, 0, 0), 0), off(x.omega_ref, 55)});
}

/// Means of a wave that repeats with the period are free of it, over one period or several.
double whole_period_means(double t_least, double direction) {
  const WholePeriods<double> of{.T_s = 1e-4, .t_settle = 0.01, .t_least = t_least, .t_most = 1};
  WholePeriods<double>::State x;
  double theta = 1, u = 0;
  int n = 0;
  for (; n < 9000; ++n) {
    theta = wrap(theta + direction * turn / 100 * (1 + 1e-12));
    const double wave = n < 98 ? 1e6 : std::sin(3 * theta);
    u = 300 + 5 * wave;
    if (of.add(x, u, 10 + wave, -4 + wave, theta)) break;
  }
  const auto m = of.means(x, u);
  const int periods = static_cast<int>(std::ceil(t_least / 0.01 - 1e-9));
  return worst_of({off(m.u, 300), off(m.i, 10), off(m.tau, -4), off(m.p, 3000 + 5 * 0.5),
                   off(m.t, periods * 0.01), off(m.rise, 0), unless(n < 9000)});
}

/// A rotor that turns back shows the mirror image of what it shows forwards: the same means, also
/// where a sample lies well past the end of a period.
double means_of_both_directions() {
  const WholePeriods<double> of{.T_s = 1e-4, .t_settle = 0, .t_least = 0.025, .t_most = 1};
  WholePeriods<double>::Means means[2];
  for (int side : {0, 1}) {
    WholePeriods<double>::State x;
    const double sense = side == 0 ? 1 : -1;
    double theta = 0, u = 0;
    for (int n = 0; n < 9000; ++n) {
      theta += sense * turn / 15.3;
      u = 300 + std::cos(theta);
      if (of.add(x, u, 1, 2, wrap(theta))) break;
    }
    means[side] = of.means(x, u);
  }
  return worst_of({off(means[0].t, means[1].t), off(means[0].u, means[1].u),
                   off(means[0].rise, means[1].rise)});
}

double means_where_the_rotor_stands() {
  const WholePeriods<double> of{.T_s = 1e-3, .t_settle = 0, .t_least = 0.01, .t_most = 0.05};
  WholePeriods<double>::State x;
  int n = 1;
  while (!of.add(x, 100 + n, 2, 1, 3) && n < 1000) ++n;
  const auto m = of.means(x, 100 + n);
  return worst_of({off(n, 50), off(m.t, 0.049), off(m.u, 125), off(m.rise, 49), off(m.p, 250)});
}

/// Ticks to the nearest, none of what does not come; each switch opens in its own turn.
double ticks() {
  double worst = worst_of({off(ticks_of(1.4e-6, 1e6, 50), 1), off(ticks_of(1.6e-6, 1e6, 50), 2),
                           off(ticks_of(-3e-6, 1e6, 50), 0), off(ticks_of(49.6e-6, 1e6, 50), 50),
                           off(ticks_of(never<double>, 1e6, 50), 50),
                           off(ticks_of(std::nan(""), 1e6, 50), 50)});
  const PhaseCommand<double> c = pulse<double>(still, up, 10e-6, 30e-6);
  for (Freewheel opens : {Freewheel::upper_opens, Freewheel::lower_opens}) {
    const LegEdges e = leg_edges(c, opens, 1e6, 50);
    const bool upper = opens == Freewheel::upper_opens;
    const SwitchEdges &moves = upper ? e.upper : e.lower, &stays = upper ? e.lower : e.upper;
    worst = worst_of({worst, off(moves.on, 0), off(moves.count, 2), off(moves.tick[0], 10),
                      off(moves.tick[1], 30), off(stays.on, 1), off(stays.count, 0)});
  }
  const PhaseCommand<double> short_one = pulse<double>(down, up, 10.1e-6, 10.3e-6);
  const PhaseCommand<double> at_once = pulse<double>(down, up, 0.2e-6, 20e-6);
  const SwitchEdges none = switch_edges(short_one, true, 1e6, 50);
  const SwitchEdges begins = switch_edges(at_once, true, 1e6, 50);
  const SwitchEdges late = switch_edges(regulate(9.0, 1.0), true, 1e6, 50);
  return worst_of({worst, off(none.on, 0), off(none.count, 0), off(begins.on, 1),
                   off(begins.count, 1), off(begins.tick[0], 20), off(late.on, 0),
                   off(late.count, 0)});
}

/// An edge in the window before the sample moves to its start, or is left to the next order.
double edges_before_a_sample() {
  const EdgeLimits<double> limits{.t_min = 3, .t_blank = 7, .T_s = 100};
  double worst = 0;
  for (double t : {92.0, 93.0, 94.0, 96.4, 96.6, 99.0, 100.0}) {
    PhaseCommand<double> c = hold<double>(still);
    c.t_edge[0] = t;
    limits.apply(c);
    const double expected = t <= 93 ? t : t < 96.5 ? 93 : never<double>;
    worst = worst_of({worst, off(c.t_edge[0], expected)});
  }
  return worst;
}

/// Edges of random orders: never falling, no state too short, none just before the sample.
double edges() {
  const EdgeLimits<double> limits{.t_min = 3, .t_blank = 7, .T_s = 100};
  unsigned seed = 1;
  double worst = unless(limits.any() && !EdgeLimits<double>{}.any());
  for (int n = 0; n < 20000; ++n) {
    PhaseCommand<double> c = hold<double>(still);
    double before = 0;
    for (double& t : c.t_edge) {
      seed = seed * 1664525 + 1013904223;
      t = before += (n % 2 ? 60.0 : 8.0) * (seed >> 8) / (1 << 24);
    }
    const PhaseCommand<double> asked = c;
    limits.apply(c);
    before = 0;
    for (int j = 0; j < max_edges && c.t_edge[j] < 100; ++j) {
      const double gap = c.t_edge[j] - before;
      if (gap < 0 || (gap > 1e-9 && gap < 3 - 1e-9) || c.t_edge[j] > 93 + 1e-9) worst = 1;
      before = c.t_edge[j];
    }
    const double first = asked.t_edge[0];
    if (first > 3 && first <= 93 && c.t_edge[0] != first) worst = 1;  // in order: as asked
    if (first < 1.49 && c.t_edge[0] != 0) worst = 1;                  // nearer to none
    if (first > 1.51 && first < 3 && c.t_edge[0] != 3) worst = 1;     // nearer to the least
  }
  return worst;
}

}  // namespace

int main() {
  check("comparator: legs by the current", comparators(), 1e-12);
  check("comparator: legs at samples", compared_at_samples(), 0);
  check("limits of a user: torque, reference, legs", limits_of_a_user(), 1e-12);
  check("integrals: none at a limit, but inwards", integrals(), 1e-12);
  check("ramp: as fast as the torque allows", ramps(), 1e-9);
  for (double t : {0.01, 0.015, 0.03}) {
    check("whole periods: means of a wave, forwards", whole_period_means(t, 1), 1e-6);
    check("whole periods: means of a wave, backwards", whole_period_means(t, -1), 1e-6);
  }
  check("whole periods: both directions", means_of_both_directions(), 1e-9);
  check("whole periods: at standstill after the longest time", means_where_the_rotor_stands(),
        1e-9);
  check("ticks: edges of both switches", ticks(), 0);
  check("edge limits: edges just before a sample", edges_before_a_sample(), 0);
  check("edge limits: random orders", edges(), 0);
  return failures == 0 ? 0 : 1;
}
