// One step of the laws that lead flux linkages to a reference: at the end of the sample each phase
// is where the voltage can bring it, on its goal or nearest to it.
#include <cmath>
#include <limits>
#include <vector>

#include "errors.hpp"
#include "srm/control/guard/guarded.hpp"
#include "srm/control/law/deadbeat.hpp"
#include "srm/control/law/ditc.hpp"
#include "srm/control/law/finite_set_mpc.hpp"
#include "srm/control/law/pwm_current.hpp"
#include "srm/control/law/torque_sharing.hpp"
#include "srm/machine/lehuy.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr int N = 3;
constexpr double T_s = 2e-4, R = 0.72, u_dc = 240, omega_m = 20;
constexpr Leg down = Leg::demagnetize, still = Leg::freewheel, up = Leg::magnetize;
using M = LeHuy<double>;
using Y = Measurement<double, N>;

M machine() { return lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468); }

/// The same profile at every torque: the feedback of the mean has no say.
struct Guide {
  std::vector<double> values = std::vector<double>(2 * 90);
  double omega = 100;
  Guide() {
    for (int j = 0; j < 180; ++j) values[static_cast<std::size_t>(j)] = goal((j % 90) * turn / 90);
  }
  static double goal(double theta) { return std::fmax(0.3 * std::sin(theta - 0.2), 0); }
  ReferenceProfile<double> profile() const {
    return {{{values.data(), 180}, 2, 90, 30}, {&omega, 1}, u_dc, 0};
  }
  double at(double theta) const { return profile().at(10, omega_m, u_dc).at(wrap(theta)); }
};

Feasible<double> never_feasible() { return {.tau_max = 1, .motoring = {}, .braking = {}}; }

/// Any currents, angles and senses of the torque.
template <class Judge>
double of_any(const Judge& judge) {
  double worst = 0;
  for (int n = 0; n < 400; ++n) {
    Y y{.theta_e = std::fmod(0.1 + 1.618 * n, turn),
        .omega_m = n % 2 ? omega_m : -omega_m,
        .u_dc = u_dc};
    for (int k = 0; k < N; ++k)
      y.i[k] = std::fmax(40 * std::sin(0.7 * n + 2 * k) + 15, n % 5 == 0 ? -1 : 0);
    worst = worst_of({worst, judge(n, y, n % 3 == 0 ? -10.0 : 10.0)});
  }
  return worst;
}

/// The angle of phase k in the frame of positive torque.
double mirrored(double theta_e, int k, double tau) {
  return wrap((tau < 0 ? -1 : 1) * phase_angle<N>(theta_e, k));
}

/// Volt-seconds of an order over a sample, per volt.
double seconds(const PhaseCommand<double>& c) {
  double sum = 0, from = 0;
  for (int n = 0; n <= max_edges; ++n) {
    const double to = n < max_edges ? std::fmin(c.t_edge[n], T_s) : T_s;
    sum += static_cast<int>(c.leg[n]) * (to - from);
    from = to;
  }
  return sum;
}

/// The duty cycle that takes a flux linkage to its reference, R i counted, within the voltage; with
/// a delay from where the last one takes it.
double deadbeat(bool follows) {
  const Guide guide;
  double worst = 0;
  for (int delay : {0, 1}) {
    const Deadbeat<M, N> law{.machine = machine(),
                             .R = R,
                             .sharing = {.shape = Shape::cubic, .theta_on = 0.2, .theta_ov = 0.7},
                             .feasible = follows ? never_feasible() : always_feasible<double>(),
                             .guide = guide.profile(),
                             .i_max = 100,
                             .T_s = T_s,
                             .delay = delay};
    worst = worst_of({worst, of_any([&](int n, const Y& y, double tau) {
                        Deadbeat<M, N>::State x;
                        for (int k = 0; k < N; ++k) x.duty[k] = std::sin(n + 3.0 * k);
                        const auto last = x.duty;
                        const auto c = law.step(x, y, tau);
                        const double end = y.theta_e + 4 * y.omega_m * T_s * (1 + delay);
                        double wrong = 0;
                        for (int k = 0; k < N; ++k) {
                          const double theta = mirrored(wrap(end), k, tau),
                                       i = std::fmax(y.i[k], 0);
                          double goal = guide.at(theta), i_mean = y.i[k];
                          if (!follows) {
                            const double i_ref = current_for_torque(
                                machine(), law.sharing.share<N>(theta) * 10, theta, 100.0);
                            goal = i_ref > 0 ? machine().at(i_ref, theta).psi : 0;
                            i_mean = (i + i_ref) / 2;
                          }
                          double psi = machine().at(i, phase_angle<N>(y.theta_e, k)).psi;
                          if (delay > 0) psi = std::fmax(psi + T_s * (last[k] * u_dc - R * i), 0);
                          const double duty =
                              std::fmin(std::fmax(((goal - psi) / T_s + R * i_mean) / u_dc, -1), 1);
                          wrong = worst_of({wrong, off(seconds(c[k]) / T_s, goal > 0 ? duty : -1)});
                        }
                        return wrong;
                      })});
  }
  return worst;
}

/// A leg is kept that ends within the band of the reference; else the one that ends nearest. No
/// magnetizing above the current limit.
double ditc() {
  const Guide guide;
  int kept = 0, over = 0;
  const Ditc<M, N> law{.machine = machine(),
                       .conduction = {},
                       .turn_on = {},
                       .bands = {.inner = 0.5, .outer = 1},
                       .feasible = never_feasible(),
                       .guide = guide.profile(),
                       .psi_band = 0.03,
                       .R = R,
                       .i_max = 45,
                       .T_s = T_s};
  const double worst = of_any([&](int n, const Y& y, double tau) {
    Ditc<M, N>::State x;
    for (int k = 0; k < N; ++k) x.leg[k] = static_cast<Leg>((n + k) % 3 - 1);
    const auto last = x.leg;
    law.step(x, y, tau);
    double wrong = 0;
    for (int k = 0; k < N; ++k) {
      const double goal = guide.at(mirrored(wrap(y.theta_e + 4 * y.omega_m * T_s), k, tau)),
                   i = std::fmax(y.i[k], 0);
      const double psi = i > 0 ? machine().at(i, mirrored(y.theta_e, k, tau)).psi : 0;
      const auto away = [&](Leg leg) {
        return std::fabs(std::fmax(psi + T_s * (static_cast<int>(leg) * u_dc - R * i), 0) - goal);
      };
      const bool limited = i > 45;
      double least = std::fmin(away(down), away(still));
      if (!limited) least = std::fmin(least, away(up));
      const Leg start = limited && last[k] == up ? still : last[k];
      const bool keeps = away(start) <= 0.03;
      kept += keeps;
      over += limited;
      wrong = worst_of({wrong, keeps ? off(x.leg[k], start) : off(away(x.leg[k]), least),
                        unless(!limited || x.leg[k] != up)});
    }
    return wrong;
  });
  return worst_of({worst, unless(kept > 100 && over > 50)});
}

/// Within its window a phase is alone, the newest one, or an older one that goes out; outside it
/// demagnetizes, and so does all where no torque is asked for. No magnetizing above the limit.
double roles() {
  int alone = 0, two = 0, none = 0;
  const Ditc<M, N> law{.machine = machine(),
                       .conduction = {.theta_on = -0.3,
                                      .theta_off = 2.5,
                                      .brake_on = 0.5,
                                      .brake_off = 3.4,
                                      .omega_start = 0},
                       .turn_on = {},
                       .bands = {.inner = 2, .outer = 6},
                       .feasible = always_feasible<double>(),
                       .guide = {},
                       .psi_band = 0,
                       .R = R,
                       .i_max = 45,
                       .T_s = T_s};
  const double worst = of_any([&](int n, const Y& y, double tau) {
    if (n % 7 == 0) tau = 0;
    Ditc<M, N>::State x;
    for (int k = 0; k < N; ++k) x.leg[k] = static_cast<Leg>((n + k) % 3 - 1);
    const auto last = x.leg;
    law.step(x, y, tau);
    const bool braking = tau * y.omega_m < 0;
    const Window<double> window = law.conduction.window<N>(y.omega_m, tau);
    double given = 0, past[N];
    int inside = 0;
    for (int k = 0; k < N; ++k) {
      const double theta = mirrored(y.theta_e, k, tau);
      if (y.i[k] > 0) given += machine().at(y.i[k], theta).tau;
      past[k] = wrap(braking ? window.theta_off - theta : theta - window.theta_on);
      inside += past[k] < window.theta_off - window.theta_on;
    }
    const double asked =
        MeanTorqueFeedback<double>{}.asked(std::fabs(tau), given, 4 * y.omega_m * T_s, braking, 0);
    const double newest = std::fmin(past[0], std::fmin(past[1], past[2]));
    (inside == 1 ? alone : inside == 2 ? two : none) += 1;
    double wrong = 0;
    for (int k = 0; k < N; ++k) {
      Leg leg = down;
      if (past[k] < window.theta_off - window.theta_on && tau != 0) {
        const Role role = inside == 1         ? Role::single
                          : past[k] == newest ? Role::incoming
                                              : Role::outgoing;
        leg = law.bands.leg(role, given - asked, last[k]);
        if (leg == up && y.i[k] > 45) leg = still;
      }
      wrong = worst_of({wrong, off(x.leg[k], leg)});
    }
    return wrong;
  });
  return worst_of({worst, unless(alone > 50 && two > 50)});
}

/// Torque a stroke before turn-off takes the flux linkage that is built up since turn-on.
double turn_on() {
  TurnOn<double> t{.tau_max = 16, .psi = {}, .psi_brake = {}};
  for (int j = 0; j < 9; ++j) {
    t.psi[j] = 0.1 * j;
    t.psi_brake[j] = 0.2 * j;
  }
  const auto motoring = t.window<3>({0.1, 2.9}, 3, -400, 200, false),
             braking = t.window<3>({0.1, 2.9}, 3, 400, 200, true);
  t.tau_max = 0;
  const auto given = t.window<3>({0.1, 2.9}, 3, 400, 200, false);
  return worst_of({off(motoring.theta_on, 2.9 - turn / 3 - 2 * 0.15), off(motoring.theta_off, 2.9),
                   off(braking.theta_on, 0.1), off(braking.theta_off, 0.1 + turn / 3 + 2 * 0.3),
                   off(given.theta_on, 0.1), off(given.theta_off, 2.9)});
}

/// The voltage of a current loop: bandwidth times inductance, back-EMF and resistance, within the
/// dc link; its integral waits where all of it is used.
double pwm_current() {
  const PwmCurrent<M, N> law{.machine = machine(),
                             .R = R,
                             .conduction = {.theta_on = 0.2,
                                            .theta_off = 2.6,
                                            .brake_on = 0.4,
                                            .brake_off = 3.2,
                                            .omega_start = 0},
                             .reference = constant_current(30.0),
                             .bandwidth = 800,
                             .T_s = T_s};
  int full = 0, inner = 0;
  const double worst = of_any([&](int n, const Y& y, double tau) {
    PwmCurrent<M, N>::State x;
    x.u_integral = {5, -3, 1};
    const auto before = x.u_integral;
    const auto c = law.step(x, y, tau);
    const auto window = law.conduction.window<N>(y.omega_m, tau);
    double wrong = n < 0;
    for (int k = 0; k < N; ++k) {
      const double i = std::fmax(y.i[k], 0);
      const auto at = machine().at(i, phase_angle<N>(y.theta_e, k));
      const double u = 800 * at.L_inc * (30 - i) + R * 30 + y.omega_m * at.psi_theta + before[k];
      const bool on = conducts(mirrored(y.theta_e, k, tau), window.theta_on, window.theta_off);
      const bool all = std::fabs(u) >= u_dc;
      if (on) (all ? full : inner) += 1;
      wrong = worst_of({wrong,
                        off(seconds(c[k]) / T_s, on ? std::fmin(std::fmax(u / u_dc, -1), 1) : -1),
                        off(x.u_integral[k], !on   ? 0
                                             : all ? before[k]
                                                   : before[k] + 800 * R * T_s * (30 - i))});
    }
    return wrong;
  });
  Y y{.theta_e = 1, .u_dc = u_dc};
  PwmCurrent<M, N>::State x;
  return worst_of({worst, unless(full > 50 && inner > 50), off(law.step(x, y, 0)[0].leg[0], down)});
}

FiniteSetMpc<M, N> finite_set(const Guide& guide, const double& w_psi, const double& feedback) {
  return {.machine = machine(),
          .guide = guide.profile(),
          .horizon = 1,
          .w_psi = {&w_psi, 1},
          .feedback = {&feedback, 1},
          .w_i = 0.01,
          .w_sw = 1e-6,
          .t_end = 3e-5,
          .R = R,
          .i_max = 45,
          .T_s = 2e-5,
          .delay = 0};
}

/// Among all combinations of the phases that are asked, the one that costs least by the formula at
/// the head of leg_search.hpp.
double least_cost() {
  const Guide guide;
  const double w_psi = 4e3, feedback = 0;
  const FiniteSetMpc<M, N> law = finite_set(guide, w_psi, feedback);
  return of_any([&](int n, const Y& y, double tau) {
    FiniteSetMpc<M, N>::State x;
    for (int k = 0; k < N; ++k) x.ordered[k] = hold<double>(static_cast<Leg>((n + k) % 3 - 1));
    const auto last = x.ordered;
    Memory<double, N> none;
    const auto phases =
        Prediction<M, N>{
            machine(), guide.profile().at(10, y.omega_m, u_dc), R, law.T_s, 0, law.T_s, u_dc * 1e-7}
            .at(y, tau, none);
    const auto cost = [&](int combination) {
      double sum = 0, e = -10;
      for (int k = 0, digits = combination; k < N; ++k, digits /= 3) {
        const PhasePrediction<double>& p = phases[k];
        const int level = digits % 3 - 1;
        if (p.idle && level >= 0) return std::numeric_limits<double>::infinity();
        const bool carries = p.psi > 0;
        const double rise = carries || level > 0 ? law.T_s * (level * u_dc - R * p.i) : 0;
        const double psi = std::fmax(p.psi + rise, 0), moved = psi - p.psi;
        const double goal = p.goal + p.goal_rate * law.T_s;
        sum += law.t_end * w_psi * (psi - goal) * (psi - goal);
        if (psi > 0) {
          const double i = std::fmax(p.i + p.i_drift * law.T_s + p.i_gain * moved, 0);
          e += p.tau + p.drift * law.T_s + p.gain * moved;
          sum += law.t_end * 0.01 * i * i;
          if (i > 45 && level > -1) sum += 1e12;
        }
        if (carries) sum += 1e-6 / 2 * std::abs(level - static_cast<int>(last[k].leg.back()));
      }
      return sum + law.t_end * e * e;
    };
    double least = std::numeric_limits<double>::infinity();
    for (int combination = 0; combination < 27; ++combination)
      least = std::fmin(least, cost(combination));
    const auto c = law.step(x, y, tau);
    int chosen = 0;
    for (int k = N - 1; k >= 0; --k) chosen = 3 * chosen + static_cast<int>(c[k].leg[0]) + 1;
    return off(cost(chosen), least) / (1 + least);
  });
}

/// Over more samples than one: torque and guide are straight lines to the end of the last.
double whole_horizon() {
  const Guide guide;
  const double w_psi = 4e3, feedback = 0;
  FiniteSetMpc<M, N> law = finite_set(guide, w_psi, feedback);
  law.horizon = 3;
  return of_any([&](int n, const Y& y, double tau) {
    FiniteSetMpc<M, N>::State x;
    std::array<int, N> last;
    for (int k = 0; k < N; ++k) {
      last[k] = (n + k) % 3 - 1;
      x.ordered[k] = hold<double>(static_cast<Leg>(last[k]));
    }
    Memory<double, N> none;
    const Prediction<M, N> prediction{
        machine(),  guide.profile().at(10, y.omega_m, u_dc), R, law.T_s, 0, 3 * law.T_s,
        u_dc * 1e-7};
    LegSearch<double, N> search{.phases = prediction.at(y, tau, none),
                                .tau_ref = 10,
                                .u_dc = u_dc,
                                .R = R,
                                .i_max = 45,
                                .T_s = law.T_s,
                                .t_end = law.t_end,
                                .w_psi = w_psi,
                                .w_i = 0.01,
                                .w_sw = 1e-6,
                                .horizon = 3};
    const auto best = search.best(last);
    const auto c = law.step(x, y, tau);
    double wrong = 0;
    for (int k = 0; k < N; ++k) wrong += off(c[k].leg[0], static_cast<Leg>(best.level[k]));
    return wrong;
  });
}

/// Where feedback holds the mean it asks for a tenth more at most, and for all that the guide has;
/// where the torque is lost for four turns each phase follows its guide, as long as it takes.
double held_mean() {
  const Guide guide;
  const double w_psi = 4e3, on = 1, off_ = 0;
  double worst = 0;
  for (double tau : {0.5, 10.0, 28.0}) {
    const FiniteSetMpc<M, N> law = finite_set(guide, w_psi, on),
                             without = finite_set(guide, w_psi, off_);
    FiniteSetMpc<M, N>::State x, y;
    // Half of the torque is given: the feedback asks for more, up to its limit.
    for (int n = 0; n < 3000; ++n) {
      x.tau = y.tau = 0.6 * tau;
      const Y m{.theta_e = wrap(0.01 * n), .omega_m = 100, .u_dc = u_dc};
      law.step(x, m, tau);
      without.step(y, m, tau);
      x.lost = 0;
    }
    worst = worst_of({worst, unless(x.holds && !y.holds),
                      off(x.hold.part[0], std::fmin(0.1, 30 / tau - 1)), off(y.hold.part[0], 0)});
  }
  const FiniteSetMpc<M, N> law = finite_set(guide, w_psi, on);
  FiniteSetMpc<M, N>::State x;
  const double way = 4 * 100 * law.T_s;
  int n = 0;
  for (; n < 9999 && x.lost < FiniteSetMpc<M, N>::lasting; ++n) {
    law.step(x, {.theta_e = 1, .omega_m = 100, .u_dc = u_dc}, 10.0);
  }
  worst = worst_of({worst, off(n, std::ceil(4 * turn / way))});
  x.ordered[0] = hold<double>(still);
  for (double i : {10.0, 40.0}) {  // ten samples back to the torque do not end it
    const Y m{.i = {i, 0, 0}, .theta_e = 1, .omega_m = 100, .u_dc = u_dc};
    const auto c = law.step(x, m, 10.0);
    const double psi = machine().at(i, 1).psi, goal = guide.at(1 + way);
    const auto away = [&](Leg leg) {
      return std::fabs(psi + law.T_s * (static_cast<int>(leg) * u_dc - R * i) - goal);
    };
    const double least = std::fmin(away(down), std::fmin(away(still), away(up)));
    worst = worst_of({worst, off(away(c[0].leg[0]), least)});
  }
  // What has been off is made good by as long a way on which the torque is there.
  FiniteSetMpc<M, N>::State back;
  back.holds = true;
  back.lost = 1;
  double i = 1;
  for (int round = 0; round < 60; ++round) i += (10 - machine().at(i, 1).tau) * 0.3;
  law.step(back, {.i = {i, 0, 0}, .theta_e = 1, .omega_m = 100, .u_dc = u_dc}, 10.0);
  return worst_of({worst, off(back.lost, 1 - way), off(back.tau, machine().at(i, 1).tau)});
}

/// A guarded drive motors where its reference is a torque or the sign of one.
double motoring() {
  Guarded<M, DriveControl<Deadbeat<M, N>>> drive{};
  double worst = 0;
  for (const Outer outer : {Outer::torque, Outer::speed, Outer::none, Outer::pv}) {
    drive.control.frame.outer = outer;
    worst = worst_of(
        {worst, unless(drive.motors() == (outer == Outer::torque || outer == Outer::none))});
  }
  return worst;
}

/// Where the shares are not feasible a phase has the guide's current; one below a quarter of the
/// band is off.
double follows_currents() {
  const Guide guide;
  const TorqueSharing<M, N> law{.machine = machine(),
                                .sharing = {},
                                .feasible = never_feasible(),
                                .guide = guide.profile(),
                                .R = R,
                                .i_max = 60,
                                .i_band = 0.4,
                                .T_s = T_s};
  int off_ = 0, on = 0;
  const double worst = of_any([&](int n, const Y& y, double tau) {
    FollowedCurrents<double, N> x, same;
    if (n % 2) x.i_ref = same.i_ref = {0.2, 0, 60};
    const auto orders = law.step(x, y, tau);
    GuideCurrents<M, N>{law.machine, R, 60, T_s, 0}.follow(same, law.guide, y, tau);
    double sum = 0;
    for (int k = 0; k < N; ++k) {
      const bool is = same.i_ref[k] > 0.1;
      if (same.i_ref[k] > 0) (is ? on : off_) += 1;
      sum += off(x.i_ref[k], same.i_ref[k]) + off(orders[k].i_ref, is ? same.i_ref[k] : 0);
    }
    return sum;
  });
  return worst_of({worst, unless(off_ > 20 && on > 20)});
}

}  // namespace

int main() {
  check("deadbeat: to the currents of the shares", deadbeat(false), 1e-9);
  check("deadbeat: to the reference profile", deadbeat(true), 1e-9);
  check("DITC: legs nearest to the reference profile", ditc(), 1e-12);
  check("DITC: roles within the windows", roles(), 0);
  check("DITC: how early a phase is turned on", turn_on(), 1e-12);
  check("PWM current: voltages and their integral", pwm_current(), 1e-9);
  check("finite set: the least cost", least_cost(), 1e-9);
  check("finite set: over three samples", whole_horizon(), 0);
  check("finite set: feedback of the mean, lost torque", held_mean(), 1e-6);
  check("a guarded drive: whether it motors", motoring(), 0);
  check("sharing: currents of the guide, off below a quarter", follows_currents(), 0);
  return failures == 0 ? 0 : 1;
}
