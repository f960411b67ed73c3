// Parts of the control laws, each against its formula or its own words.
#include <cmath>
#include <limits>
#include <utility>

#include "errors.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/feasible.hpp"
#include "srm/control/part/mean_torque.hpp"
#include "srm/control/part/mean_torque_feedback.hpp"
#include "srm/control/part/mirror.hpp"
#include "srm/control/part/profile_follower.hpp"
#include "srm/control/part/pulse_table.hpp"
#include "srm/control/part/sharing.hpp"
#include "srm/control/part/step_assist.hpp"
#include "srm/control/part/switching_weight.hpp"
#include "srm/machine/lehuy.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr Leg up = Leg::magnetize, still = Leg::freewheel, down = Leg::demagnetize;

/// Motoring, braking and starting: the window below its speed is centred on a quarter of a turn.
template <int N>
double windows() {
  const Conduction<double> c{
      .theta_on = -0.2, .theta_off = 2.5, .brake_on = 0.4, .brake_off = 3.6, .omega_start = 20};
  const auto is = [&](double omega_m, double tau, double on, double to) {
    const Window<double> w = c.window<N>(omega_m, tau);
    return worst_of({off(w.theta_on, on), off(w.theta_off, to)});
  };
  const double half = N == 2 ? turn / 4 : 1.1 * turn / 2 / N;  // a tenth wider than a stroke
  return worst_of({is(20, 1, -0.2, 2.5), is(-20, -1, -0.2, 2.5), is(20, -1, 0.4, 3.6),
                   is(-50, 1, 0.4, 3.6), is(-50, 0, -0.2, 2.5), is(50, 0, -0.2, 2.5),
                   is(19.9, -1, turn / 4 - half, turn / 4 + half),
                   is(-19.9, 1, turn / 4 - half, turn / 4 + half)});
}

/// A phase's angle is mirrored for torque of the other sense.
double mirrored() {
  double worst = 0;
  for (int k = 0; k < 3; ++k) {
    for (double theta = 0.01; theta < turn; theta += 0.1) {
      const double forward = drive_angle<3>(theta, k, 1.0), back = drive_angle<3>(theta, k, -1.0);
      worst =
          worst_of({worst, off(std::sin(forward), std::sin(theta - k * turn / 3)),
                    off(std::cos(forward), std::cos(theta - k * turn / 3)),
                    off(std::sin(back), -std::sin(forward)), off(std::cos(back), std::cos(forward)),
                    unless(forward >= 0 && back < turn)});
    }
  }
  return worst;
}

/// Currents over the torque lie on straight lines between 17 entries, of either sense.
double mean_currents() {
  MeanTorque<double> table{.tau_max = 32, .i_ref = {}, .i_brake = {}};
  for (int j = 0; j <= 16; ++j) {
    table.i_ref[j] = j * j;
    table.i_brake[j] = 1000 + j;
  }
  return worst_of({off(table.current(0, false), 0), off(table.current(7, false), 12.5),
                   off(table.current(-7, false), 12.5), off(table.current(99, false), 256),
                   off(table.current(31, true), 1015.5),
                   off(table.current(std::numeric_limits<double>::quiet_NaN(), true), 0),
                   off(constant_current(80.0).current(0, true), 0),
                   off(constant_current(80.0).current(0.1, true), 80),
                   off(constant_current(80.0).current(-5.0, false), 80)});
}

/// A table that is bilinear itself is read exactly, and held outside of its axes.
double pulse_tables() {
  const double omega[] = {10, 20, 40}, tau[] = {0, 1, 3, 4};
  double value[3][12];
  const auto exact = [](double w, double t, int n) { return (n + 1) * (w * t - 2 * w + 7 * t); };
  for (int n = 0; n < 3; ++n) {
    for (int j = 0; j < 12; ++j) value[n][j] = exact(omega[j / 4], tau[j % 4], n);
  }
  PulseTable<double> table{{omega, 3}, {tau, 4}, {value[0], 12}, {value[1], 12}, {value[2], 12}};
  double worst = unless(table.is_there() && table.is_consistent());
  for (double w = 0; w < 60; w += 2.5) {
    for (double t = 0; t < 6; t += 0.25) {
      const Pulse<double> p = table.at(w, t);
      const double a = std::fmin(std::fmax(w, 10), 40), b = std::fmin(t, 4);
      worst = worst_of({worst, off(p.window.theta_on, exact(a, b, 0)),
                        off(p.window.theta_off, exact(a, b, 1)), off(p.i_ref, exact(a, b, 2))});
    }
  }
  table.theta_off.size = 11;
  worst = table.is_consistent() ? 1 : worst;
  table.theta_off.size = 12;
  const double level[] = {0, 1, 1, 4};
  table.tau.data = level;
  return table.is_consistent() || PulseTable<double>{}.is_there() ? 1 : worst;
}

/// The rises by their formulae, and the share by its table; feasible up to alignment.
double rises() {
  Sharing<double> s{.shape = Shape::linear, .theta_on = 0.1, .theta_ov = 0.8};
  for (int j = 0; j <= 32; ++j) s.table[j] = j * j / 1024.0;
  double worst = 0;
  for (double x = 0; x <= 1; x += 1 / 64.0) {
    const double table = (std::floor(32 * x) * std::floor(32 * x) +
                          (32 * x - std::floor(32 * x)) * (2 * std::floor(32 * x) + 1)) /
                         1024;
    const double rise[] = {x, 3 * x * x - 2 * x * x * x, (1 - std::cos(turn / 2 * x)) / 2,
                           (1 - std::exp(-5 * x * x)) / (1 - std::exp(-5)), table};
    for (int n = 0; n < 5; ++n) {
      s.shape = static_cast<Shape>(n);
      worst =
          worst_of({worst, off(s.rise(0.8 * x), rise[n]), off(s.share<3>(0.1 + 0.8 * x), rise[n]),
                    off(s.share<3>(0.1 + turn / 3 + 0.8 * x), 1 - rise[n])});
    }
  }
  const double free = turn / 2 - turn / 3;
  const auto feasible = [&](double on, double ov) {
    s.theta_on = on;
    s.theta_ov = ov;
    return s.is_feasible<3>();
  };
  const bool right = feasible(0, free - 1e-9) && feasible(0.5, free - 0.5 - 1e-9) &&
                     !feasible(-1e-9, 0.5) && !feasible(0.1, 0) && !feasible(0.5, free - 0.499);
  return right ? worst : 1;
}

/// The greatest speed over voltage lies on straight lines between nine torques.
double boundary() {
  Feasible<double> f{.tau_max = 16, .motoring = {}, .braking = {}};
  for (int j = 0; j < 9; ++j) {
    f.motoring[j] = 20 - j;
    f.braking[j] = 5;
  }
  const bool right = f.at(5, 17.5 * 100 - 1e-9, 100, false) &&
                     !f.at(5, 17.5 * 100 + 1e-9, 100, false) && f.at(5, 500, 100, true) &&
                     !f.at(5, 500.1, 100, true) && f.at(99, 1200, 100, false) &&
                     always_feasible<double>().at(1e3, 1e6, 1, true);
  return unless(right);
}

/// A plant that gives a part of what is asked for: the mean error after 40 turns.
double settles(double part, bool braking, double most) {
  MeanTorqueFeedback<double> x;
  double asked = 0;
  for (int n = 0; n < 4000; ++n) asked = x.asked(10, part * asked, 0.0628, braking, most);
  return part * asked / 10 - 1;
}

double mean_feedback() {
  double worst = 0;
  for (double part : {0.8, 0.95, 1.3}) {
    for (bool braking : {false, true}) {
      worst = std::fmax(worst, std::fabs(settles(part, braking, 20)));
    }
  }
  return worst;
}

/// What is left alone, limited, forgotten by other references, or no error of the mean.
double feedback_at_its_ends() {
  MeanTorqueFeedback<double> x, still_moving;
  for (int n = 0; n < 2000; ++n) x.asked(10, 9.96, 0.06, false, 20);  // 0.4 %: left alone
  double worst = off(x.asked(10, 9.96, 0.06, false, 20), 10);
  worst = worst_of({worst, off(settles(0.5, false, 12), -0.4), off(settles(0.5, false, 8), -0.5)});
  for (int n = 0; n < 3000; ++n) still_moving.asked(n % 2 ? 10 : 5, 0, 0.3, false, 20);
  worst = worst_of({worst, off(still_moving.part[0], 0)});
  for (int n = 0; n < 3000; ++n) x.asked(10, 5, -0.06, true, 20);  // backwards, and braking
  const double motoring = x.part[0];
  worst =
      worst_of({worst, off(motoring, 0), off(x.part[1], 1), off(x.asked(0, 5, 0.06, true, 20), 0)});
  for (int n = 0; n < 3000; ++n) x.asked(10, 5, 0, true, 20);  // at standstill nothing winds up
  for (int n = 0; n < 9000; ++n) x.asked(10, 99, 0.06, true, 20);
  return worst_of({worst, off(x.part[1], -0.95)});
}

/// A step of the reference lasts a stroke, or until the torque is there.
double steps() {
  TorqueStep<double> x;
  const auto lasts = [&](double tau, double angle) {
    x.next(tau, angle, 2);
    return x.lasts();
  };
  bool right = lasts(10, 0.5) && lasts(10, 0.5) && lasts(10, 1.4) && !lasts(10, 0.2);
  right = right && !lasts(10.4, 0.1) && lasts(11, 0.1) && lasts(11, 0.1);
  x.reached = true;
  right = right && !lasts(11, 0.1) && lasts(-11, 0.1) && !x.reached;
  TorqueStep<double> none;  // no torque, and none before
  none.next(0, 0.1, 2);
  return unless(right && !none.lasts());
}

/// After a step an idle phase helps that comes past unaligned before the one in charge has its flux
/// linkage, a quarter of a turn before it at most; up to a quarter of a turn behind it, and up to
/// the flux linkage early in its stroke.
double helps(double u_dc) {
  const double level = 0.3, T_s = 1e-4, speed = 0.02, built = 0.2;
  double values[2 * 36] = {};
  for (int j = 0; j < 36; ++j) values[36 + j] = j < 7 ? level : j < 13 ? 0.35 : 0.1;
  const double omega = 100;
  const ReferenceProfile<double> guide{{{values, 72}, 2, 36, 1}, {&omega, 1}, u_dc, 0};
  const StepAssist<LeHuy<double>, 3> assist{.i_max = 80, .T_s = T_s, .delay = 2};
  const double lead = std::min((1.2 * 0.35 - built) / u_dc / T_s * speed, turn / 4);
  double worst = 0;
  for (double ahead = -1.5 * lead; ahead < turn / 4 + 0.3; ahead += 0.011) {
    for (double psi : {0.0, level - u_dc * T_s - 1e-6, level - u_dc * T_s + 1e-6}) {
      std::array<PhasePrediction<double>, 3> phases{};
      phases[0].psi = built;
      phases[0].gain = 1;
      phases[2].psi = 9;  // it has passed: its torque falls with the flux linkage
      phases[2].gain = -1;
      phases[1].psi = psi;
      phases[1].idle = true;
      const Measurement<double, 3> y{.theta_e = wrap(ahead - 2 * speed + turn / 3), .u_dc = u_dc};
      for (double i : {79.0, 81.0}) {
        phases[1].i = i;
        Command<double, 3> c{hold<double>(up), hold<double>(down), hold<double>(down)};
        assist.magnetize_ahead(y, 1, phases, guide.at(1, 100, u_dc), speed, c);
        const bool near_by = ahead > -lead && ahead < turn / 4;
        const bool room = i < 80 && psi < level - u_dc * T_s;
        worst = worst_of({worst,
                          off(c[1].leg[0], !near_by ? down
                                           : room   ? up
                                                    : still),
                          off(c[0].leg[0], up), off(c[2].leg[0], down)});
      }
    }
  }
  return worst;
}

/// Between two speeds of a guide its profiles are blended by 1/omega, at the speed with the same
/// voltage for a radian; beyond its ends one serves alone. Its rows lie over the root of the
/// torque.
double speeds_of_a_guide() {
  constexpr double top[3] = {0.3, 0.5, 0.2}, omega[3] = {50, 80, 200}, u_ref = 200, drop = 30;
  double values[3 * 2 * 4] = {};
  for (int j = 0; j < 12; ++j) values[j / 4 * 8 + 4 + j % 4] = top[j / 4];
  const ReferenceProfile<double> guide{{{values, 24}, 2, 4, 10}, {omega, 3}, u_ref, drop};
  double worst = 0;
  for (double part : {0.09, 0.64, 1.0}) {
    const double lost = drop * std::sqrt(part);
    for (double u_dc : {20.0, 150.0, 200.0, 260.0}) {
      for (double speed = -300; speed < 300; speed += 7.3) {
        const double with_u = (u_ref - lost) / std::max(u_dc - lost, u_ref / 100);
        const double same = std::abs(speed) * with_u;
        double weights[3] = {1, 0, 0};
        if (same >= omega[2]) {
          weights[2] = std::exchange(weights[0], 0);
        } else if (same > omega[0]) {
          const int j = same > omega[1] ? 1 : 0;
          const double w = (1 / omega[j] - 1 / same) / (1 / omega[j] - 1 / omega[j + 1]);
          weights[0] = 0;
          weights[j] = 1 - w;
          weights[j + 1] = w;
        }
        double blend = 0;
        for (int j = 0; j < 3; ++j) blend += weights[j] * top[j];
        const Profile<double> found = guide.at(10 * part, speed, u_dc);
        worst = worst_of(
            {worst, off(found.at(1.3), std::sqrt(part) * blend), off(found.of({top, 3}), blend)});
      }
    }
  }
  return worst;
}

/// A phase with 0.2 Wb and 50 A.
PhasePrediction<double> near(double goal, double goal_rate) {
  PhasePrediction<double> x{};
  x.psi = 0.2;
  x.i = 50;
  x.goal = goal;
  x.goal_rate = goal_rate;
  return x;
}

/// The mean voltage of a followed sample brings the flux linkage to its goal, where it can.
double follows() {
  const ProfileFollower<double, 1> follower{.R = 0, .i_max = 100, .T_s = 1e-4};
  double worst = 0;
  for (Leg last : {down, still, up}) {
    for (double missing = -0.03; missing <= 0.03; missing += 0.001) {
      PhasePrediction<double> x = near(0.19 + missing, 100);
      Command<double, 1> c{hold<double>(last)};
      follower.follow({x}, 1e-9, 200, c);
      const double reach = std::fmin(std::fmax(missing, -0.02), 0.02);
      worst = worst_of({worst, off(magnetizing_time(c[0], 1e-4) * 200, reach)});
      const bool stays = c[0].leg[0] == last || c[0].leg[0] == still || !(c[0].t_edge[0] < 1e-4);
      if (!stays) worst = 1;
      x.i = 101;  // no voltage forwards above the limit
      c = {hold<double>(last)};
      follower.follow({x}, 1e-9, 200, c);
      worst = worst_of({worst, off(magnetizing_time(c[0], 1e-4) * 200, std::fmin(reach, 0))});
    }
  }
  PhasePrediction<double> x = near(0.2009, 0);
  Command<double, 1> c{hold<double>(still)};
  follower.follow({x}, 1e-3, 200, c);
  worst = worst_of({worst, off(c[0].leg[0], still), unless(!(c[0].t_edge[0] < 1))});
  for (Leg last : {still, up}) {
    x.goal = last == up ? 0.2209 : 0.2009;
    x.i = last == up ? 50 : 101;  // above the limit a leg may freewheel on, but not magnetize
    c = {hold<double>(last)};
    follower.follow({x}, 1e-3, 200, c);
    worst = worst_of({worst, off(c[0].leg[0], last), unless(!(c[0].t_edge[0] < 1))});
  }
  x = near(0.2011, 0);
  c = {hold<double>(still)};
  follower.follow({x}, 1e-3, 200, c);
  return worst_of({worst, unless(c[0].t_edge[0] < 1e-4)});
}

/// The mean current halfway takes R i of the voltage.
double follows_against_resistance() {
  const ProfileFollower<double, 1> follower{.R = 0.5, .i_max = 100, .T_s = 1e-4};
  PhasePrediction<double> x = near(0.21, 0);
  x.i_gain = 1000;
  x.i_drift = 1e5;
  x.bias = 7;
  Command<double, 1> c{hold<double>(up)};
  follower.follow({x}, 0, 200, c);
  const double i = 50 + (1e5 * 1e-4 + 1000 * 0.01) / 2;
  return off(magnetizing_time(c[0], 1e-4) * 200, 0.01 + (0.5 * i - 7) * 1e-4);
}

double cube_roots() {
  double worst = worst_of({off(cube_root(0.0), 0), off(cube_root(-1.0), 0)});
  for (double x = 1e-12; x < 1e12; x *= 1.3) {
    worst = std::fmax(worst, std::fabs(cube_root(x) / std::cbrt(x) - 1));
  }
  return worst;
}

/// Ripple grows as D (1 - D), of either sign of the voltage; near full voltage as at a tenth.
double ripple_rates() {
  return worst_of({off(ripple_rate(10.0, 50.0, 200.0), 10 * 200 * 0.25 * 0.75),
                   off(ripple_rate(-10.0, -50.0, 200.0), 10 * 200 * 0.25 * 0.75),
                   off(ripple_rate(10.0, 199.0, 200.0), 10 * 200 * 0.1 * 0.9),
                   off(ripple_rate(10.0, 1.0, 200.0), 10 * 200 * 0.1 * 0.9),
                   off(ripple_rate(10.0, -1.0, 200.0), 10 * 200 * 0.1 * 0.9)});
}

}  // namespace

int main() {
  check("conduction: windows by speed and torque, 3 phases", windows<3>(), 1e-15);
  check("conduction: windows by speed and torque, 2 phases", windows<2>(), 1e-15);
  check("mirror: angles for torque of the other sense", mirrored(), 1e-9);
  check("mean torque: currents between the entries", mean_currents(), 1e-12);
  check("pulse table: a bilinear table", pulse_tables(), 1e-9);
  check("sharing: rises by their formulae", rises(), 1e-7);
  check("feasible: the boundary between its torques", boundary(), 0);
  check("feedback: mean torque of a plant that gives a part", mean_feedback(), 0.006);
  check("feedback: dead band, limits, standstill", feedback_at_its_ends(), 0.02);
  check("step: lasts a stroke or until the torque is there", steps(), 0);
  check("step: idle phases that help", helps(200), 0);
  check("step: idle phases that help at a low voltage", helps(20), 0);
  check("guide: between its speeds and voltages", speeds_of_a_guide(), 1e-12);
  check("follower: flux linkage at the end of the sample", follows(), 1e-12);
  check("follower: voltage against the resistance", follows_against_resistance(), 1e-12);
  check("switching weight: cube roots", cube_roots(), 2e-7);
  check("switching weight: ripple over the duty", ripple_rates(), 1e-9);
  return failures == 0 ? 0 : 1;
}
