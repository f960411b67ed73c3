// One sample of predictive torque control at any angle, current and speed, against its words: which
// mode it is in, which levels a phase may take, what a torque far from its reference, a limit of
// the current and a step of the reference change; and that units are nothing to it.
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "errors.hpp"
#include "sharing_guide.hpp"
#include "srm/control/law/edge_mpc.hpp"
#include "within.hpp"

using namespace srm;
using sharing_guide::columns, sharing_guide::machine, sharing_guide::rows, sharing_guide::tau_max;

namespace {

constexpr int N = 3;
constexpr double R = 0.72, u_dc = 540, i_max = 90, slack = 0.01, w_sw = 1.5e-6;
using M = LeHuy<double>;
using Law = EdgeMpc<M, N>;
using Phases = std::array<PhasePrediction<double>, N>;

/// The flux linkages of a sharing function, in other units of flux linkage and current where asked
/// for.
struct Guide {
  std::vector<double> values = sharing_guide::values();
  double omega = 30, psi_slack = slack, psi_unit = 1, i_unit = 1;
  Guide in(double psi, double i) const {
    Guide other = *this;
    for (double& value : other.values) value *= psi;
    other.psi_slack *= psi, other.psi_unit = psi, other.i_unit = i;
    return other;
  }
  double u() const { return u_dc * psi_unit; }
  double tau() const { return psi_unit * i_unit; }
  Law law(double T_s, int delay) const {
    const double L = psi_unit / i_unit;
    return {.machine = lehuy<double>(4, 0.67e-3 * L, 23.62e-3 * L, 0.15e-3 * L, 450 * i_unit,
                                     0.468 * psi_unit),
            .guide = {{{values.data(), rows * columns}, rows, columns, tau_max * tau()},
                      {&omega, 1},
                      u(),
                      0},
            .w_sw = w_sw * tau() * tau(),
            .psi_slack = {&psi_slack, 1},
            .R = R * L,
            .i_max = i_max * i_unit,
            .T_s = T_s,
            .delay = delay};
  }
};

/// A sample, and what the law remembers of the one before.
struct Sample {
  Measurement<double, N> y;
  double tau_ref;
  Law::State x;
};

/// Near the guide or far from it, in every quadrant; a phase may be over its limit.
Sample drawn(std::mt19937& random, const Guide& guide) {
  const auto any = [&](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random);
  };
  Sample s{};
  s.tau_ref = any(0.05, 1.05) * tau_max * (any(0, 1) < 0.5 ? 1 : -1);
  const double speed = any(0, 1) < 0.5 ? any(10, 80) : any(80, 500);
  s.y.omega_m = speed * (any(0, 1) < 0.7 ? 1 : -1) * (s.tau_ref > 0 ? 1 : -1);
  s.y.theta_e = any(0, turn);
  s.y.u_dc = u_dc;
  const auto profile = guide.law(20e-6, 0).guide.at(std::fabs(s.tau_ref), s.y.omega_m, u_dc);
  const int far = any(0, 1) < 0.4;
  for (int k = 0; k < N; ++k) {
    const double theta = drive_angle<N>(s.y.theta_e, k, s.tau_ref);
    const double i = current_from_flux(machine(), profile.at(theta), theta, 150.0);
    s.y.i[k] = any(0, 1) < 0.2 ? 0 : std::max(i + any(-1, 1) * (far ? 30 : 1), 0.0);
    if (any(0, 1) < 0.05) s.y.i[k] = any(i_max, 1.3 * i_max);
    if (any(0, 1) < 0.2) s.y.i[k] = any(0, 0.006 * i_max);  // about none
    const Leg legs[] = {Leg::demagnetize, Leg::freewheel, Leg::magnetize};
    s.x.ordered[k] = hold<double>(legs[random() % 3]);
  }
  s.x.mean.part.fill(std::vector{0.0, 0.05, 0.3}[random() % 3]);  // a tenth is the most
  s.x.steps.reference = s.tau_ref;
  s.x.mean.tau_before = s.tau_ref * (s.y.omega_m < 0 ? -1 : 1);
  s.x.tau = std::fabs(s.tau_ref) * any(0.9, 1.1);
  return s;
}

/// What the law predicts, and the units of its decisions.
struct Known {
  Phases phases;
  double demand, turn, e, A, pulse;

  Known(const Law& law, Sample s) {
    const double size = std::fabs(s.tau_ref);
    turn = 4 * std::fabs(s.y.omega_m) * law.T_s;
    const double most = std::fmin(tau_max, 1.1 * size);
    demand = s.x.mean.asked(size, s.x.tau, turn, s.y.omega_m * s.tau_ref < 0, most);
    const auto profile = law.guide.at(demand, s.y.omega_m, s.y.u_dc);
    const Prediction<M, N> ahead{law.machine, profile, law.R,      law.T_s,
                                 law.delay,   law.T_s, slack / 100};
    phases = ahead.at(s.y, s.tau_ref, s.x);
    e = -demand;
    double rate = std::fmax(1e3 * demand, 1);
    for (const auto& p : phases) {
      e += p.tau;
      const double duty_u = p.goal_rate + R * p.i;
      if (!p.idle) rate = std::fmax(rate, ripple_rate(p.gain, duty_u, s.y.u_dc));
    }
    A = std::cbrt(0.75 * w_sw * rate);
    pulse = 2 * A / rate;
  }
  bool is_far(int k) const { return std::fabs(e) > 5 * A && phases[k].gain > 0; }
  /// By how much a deviation of the flux linkage counts; nothing after a step, far from the torque.
  double per_flux(int k, bool steps) const {
    return steps && is_far(k) ? 0 : std::fabs(phases[k].gain) / (16 * A) + 1 / slack;
  }
  bool falls(int k) const { return phases[k].goal_rate + R * phases[k].i < 0; }
};

/// The torques that any choice of the levels around the guide's voltages leads to after the longer
/// of a pulse and a sample.
bool can_hold(const Known& at, double T_s) {
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (int choice = 0; choice < 1 << N; ++choice) {
    double slope = 0;
    for (int k = 0; k < N; ++k) {
      const auto& p = at.phases[k];
      const int high = choice >> k & 1;
      const int level = p.idle ? -1 : at.falls(k) ? high - 1 : high;
      slope += p.drift + p.gain * p.rate(level, u_dc, R);
    }
    const double e = at.e + slope * std::fmax(T_s, at.pulse);
    least = std::fmin(least, e), most = std::fmax(most, e);
  }
  return most >= -5 * at.A && least <= 5 * at.A;
}

/// How often each case was drawn.
struct Drawn {
  int holds = 0, follows = 0, starts = 0, over = 0, far = 0, above = 0, below = 0, otherwise = 0;
  int third = 0, fourth = 0, fifth = 0;  // levels that only the case allows
  int helped = 0, reached = 0, torque_edges = 0, flux_edges = 0, held = 0, moved = 0;
};

/// A change of the reference by more than a twentieth counts as a step, for a stroke.
double strokes(const Guide& guide) {
  double worst = 0;
  for (double to : {20.0, 20.99, 19.1, 21.1, 18.9, -20.0}) {
    Law::State x;
    x.steps.reference = 20;
    const Measurement<double, N> y{.theta_e = 1, .omega_m = 30, .u_dc = u_dc};
    guide.law(20e-6, 0).step(x, y, to);
    const bool steps = std::fabs(to - 20) > 0.05 * std::fabs(to);
    worst = worst_of({worst, off(x.steps.left, steps ? turn / N : 0), off(x.steps.reference, to)});
  }
  return worst;
}

/// A law follows the guide for a period from where its levels cannot hold the torque.
double modes(const Guide& guide) {
  std::mt19937 random(11);
  double worst = 0;
  Drawn count;
  for (int n = 0; n < 4000; ++n) {
    const Law law = guide.law(n % 2 ? 20e-6 : 50e-6, n / 2 % 2);
    Sample s = drawn(random, guide);
    const Known at(law, s);
    const bool holds = can_hold(at, law.T_s);
    const double before = n % 3 == 0 ? (n % 9) * 0.05 : 0;
    s.x.short_left = before;
    const double left = std::fmax(before - at.turn, 0);
    law.step(s.x, s.y, s.tau_ref);
    const double expected = left > 0 ? left : holds ? 0 : turn;
    worst = worst_of({worst, off(s.x.short_left, expected)});
    if (!(left > 0)) (holds ? count.holds : count.follows) += 1;
  }
  return worst_of({worst, unless(count.holds > 300 && count.follows > 300)});
}

/// The levels that a phase may take, and those that it is ordered. Far from its torque every phase
/// drives towards it with all of the voltage, as a rule, and always after a step.
double levels(const Guide& guide) {
  std::mt19937 random(12);
  double worst = 0;
  Drawn count;
  for (int n = 0; n < 6000; ++n) {
    const Law law = guide.law(n % 2 ? 20e-6 : 50e-6, n / 2 % 2);
    Sample s = drawn(random, guide);
    const bool steps = n % 3 == 0;
    if (steps) s.x.steps.left = 1;
    const Known at(law, s);
    if (!steps && !can_hold(at, law.T_s)) continue;
    const Command<double, N> c = law.step(s.x, s.y, s.tau_ref);
    worst = worst_of({worst, unless(s.x.steps.reached == !(at.e < -0.05 * at.demand))});
    worst = worst_of({worst, off(s.x.steps.left, steps ? 1 - at.turn : 0) - 1e-12});
    count.reached += s.x.steps.reached;
    for (int k = 0; k < N; ++k) {
      const auto& p = at.phases[k];
      if (p.idle) continue;
      const bool far = at.is_far(k), over = p.i > i_max;
      const double away = (p.psi - p.goal) * at.per_flux(k, steps);
      int lowest = at.falls(k) ? -1 : 0, highest = at.falls(k) ? 0 : 1;
      if (away > 2 || over || (far && at.e > 0)) lowest = -1;
      if (away <= -2 || (far && at.e < 0)) highest = 1;
      if (over) highest = 0;
      const bool starts = p.i < 0.003 * i_max && p.psi < p.goal && p.goal_rate > u_dc / 2;
      if (starts) lowest = highest;
      double before = 0;
      for (int edge = 0; edge <= max_edges; ++edge) {
        const int level = static_cast<int>(c[k].leg[edge]);
        worst = worst_of({worst, unless(level >= lowest && level <= highest)});
        if (edge == max_edges || c[k].t_edge[edge] > 1) break;  // the rest is never reached
        worst = worst_of({worst, unless(c[k].t_edge[edge] >= before),
                          unless(c[k].t_edge[edge] < law.T_s),
                          unless(c[k].leg[edge] != c[k].leg[edge + 1])});
        before = c[k].t_edge[edge];
      }
      // Beyond twice the slack the third level does what the other two cannot.
      const bool above = away > 2 && !at.falls(k) && !over && !far;
      const bool below = away < -2 && at.falls(k) && !over && !far;
      count.third += above && c[k].leg[0] == Leg::demagnetize;
      count.fourth += below && c[k].leg[0] == Leg::magnetize;
      count.fifth += over && away < 2 && !at.falls(k) && c[k].leg[0] == Leg::demagnetize;
      count.starts += starts, count.over += over, count.above += away > 2, count.below += away < -2;
      if (!far || over || starts) continue;
      const bool towards = c[k].leg[0] == (at.e < 0 ? Leg::magnetize : Leg::demagnetize);
      if (steps) worst = worst_of({worst, unless(towards)});
      count.far += 1, count.otherwise += !towards;
    }
  }
  return worst_of({worst, unless(count.starts > 30 && count.over > 200 && count.far > 2000),
                   unless(count.above > 100 && count.below > 100 && count.reached > 1000),
                   unless(count.third > 5 && count.fourth > 5 && count.fifth > 50),
                   unless(count.otherwise < 0.02 * count.far)});
}

/// Phases that the guide gives no current are off, but where they help after a step.
double idle_phases(const Guide& guide) {
  std::mt19937 random(13);
  double worst = 0;
  Drawn count;
  for (int n = 0; n < 3000; ++n) {
    const Law law = guide.law(20e-6, n % 2);
    Sample s = drawn(random, guide);
    const bool steps = n % 3 != 0, braking = s.y.omega_m * s.tau_ref < 0;
    if (steps) s.x.steps.left = 1;
    const Known at(law, s);
    if (!steps && !can_hold(at, law.T_s)) continue;
    const Command<double, N> c = law.step(s.x, s.y, s.tau_ref);
    Command<double, N> expected{};
    if (steps && !s.x.steps.reached && !braking) {
      const StepAssist<M, N> assist{i_max, law.T_s, law.delay};
      const auto profile = law.guide.at(at.demand, s.y.omega_m, s.y.u_dc);
      assist.magnetize_ahead(s.y, s.tau_ref, at.phases, profile, at.turn, expected);
    }
    for (int k = 0; k < N; ++k) {
      if (!at.phases[k].idle) continue;
      for (int j = 0; j <= max_edges; ++j) {
        worst = worst_of({worst, off(c[k].leg[j], expected[k].leg[j])});
      }
      count.helped += expected[k].leg[0] == Leg::magnetize;
    }
  }
  return worst_of({worst, unless(count.helped > 30)});
}

/// Straight lines from the prediction: a leg changes where the torque comes to its band or the flux
/// linkage of a phase is off by its slack, in the part that the torque does not see.
double edges(const Guide& guide) {
  std::mt19937 random(14);
  double worst = 0;
  Drawn count;
  for (int n = 0; n < 6000; ++n) {
    const Law law = guide.law(n % 2 ? 20e-6 : 50e-6, n / 2 % 2);
    Sample s = drawn(random, guide);
    const Known at(law, s);
    if (!can_hold(at, law.T_s)) continue;
    const Command<double, N> c = law.step(s.x, s.y, s.tau_ref);
    double gain_squared = 0;
    for (const auto& p : at.phases) gain_squared += p.idle ? 0 : p.gain * p.gain;
    const double band = std::fmax(1, 0.53 * law.T_s / at.pulse) * at.A;
    for (const auto& order : c) {
      for (const double t : order.t_edge) {
        if (t > 1) continue;
        double e = at.e, along = 0, most = 0;
        std::array<double, N> moved{};
        for (int k = 0; k < N; ++k) {
          const auto& p = at.phases[k];
          e += t * p.drift;
          if (p.idle) e += t * p.gain * p.rate(-1, u_dc, R);
          if (p.idle) continue;
          double from = 0;  // the flux linkage at t
          for (int j = 0; j <= max_edges && from < t; ++j) {
            const double to = j < max_edges ? std::fmin(c[k].t_edge[j], t) : t;
            moved[k] += (to - from) * p.rate(static_cast<int>(c[k].leg[j]), u_dc, R);
            from = to;
          }
          e += p.gain * moved[k];
          along += p.gain * (p.psi + moved[k] - p.goal - t * p.goal_rate);
        }
        for (int k = 0; k < N; ++k) {
          const auto& p = at.phases[k];
          if (p.idle) continue;
          const double away = p.psi + moved[k] - p.goal - t * p.goal_rate -
                              (gain_squared > 0 ? p.gain / gain_squared * along : 0);
          most = std::fmax(most, std::fabs(away) * at.per_flux(k, false));
        }
        const bool torque = std::fabs(e) > band * (1 - 1e-9), flux = most > 1 - 1e-9;
        worst = worst_of({worst, unless(torque || flux)});
        count.torque_edges += torque, count.flux_edges += flux && !torque;
      }
    }
  }
  return worst_of({worst, unless(count.torque_edges > 300 && count.flux_edges > 50)});
}

/// A phase that follows keeps its leg while that leads it to within an eighth of what a pulse
/// moves, half as much as one of even duty does; else it ends nearer to the guide.
double following(const Guide& guide) {
  std::mt19937 random(15);
  double worst = 0;
  Drawn count;
  for (int n = 0; n < 3000; ++n) {
    const Law law = guide.law(20e-6, n % 2);
    Sample s = drawn(random, guide);
    s.x.short_left = 3;
    const Known at(law, s);
    const auto before = s.x.ordered;
    const Command<double, N> c = law.step(s.x, s.y, s.tau_ref);
    for (int k = 0; k < N; ++k) {
      const auto& p = at.phases[k];
      const int level = static_cast<int>(before[k].leg.back());
      const double missing = std::fmax(p.goal + p.goal_rate * law.T_s, 0) - p.psi;
      const double kept = std::fabs(p.rate(level, u_dc, R) * law.T_s - missing);
      const bool keeps = kept <= u_dc * at.pulse / 8 && !(p.i > i_max && level > 0);
      const double given = magnetizing_time(c[k], law.T_s) * u_dc - R * p.i * law.T_s;
      if (keeps) {
        worst = worst_of({worst, unless(c[k].t_edge[0] > 1), off(c[k].leg[0], before[k].leg[4])});
      } else if (!(p.i > i_max) && p.i > 0 && std::fabs(missing) < 0.9 * u_dc * law.T_s) {
        worst = worst_of({worst, unless(std::fabs(given - missing) < 0.1 * kept + 1e-4)});
      }
      (keeps ? count.held : count.moved) += 1;
    }
  }
  return worst_of({worst, unless(count.held > 300 && count.moved > 300)});
}

/// Units are nothing to it: of flux linkage and current in powers of two, every order is the same.
double units(const Guide& guide) {
  std::mt19937 random(16);
  const Guide other = guide.in(2, 4);
  double worst = 0;
  for (int n = 0; n < 3000; ++n) {
    const double T_s = n % 2 ? 20e-6 : 50e-6;
    Sample s = drawn(random, guide);
    if (n % 3 == 0) s.x.steps.left = 1;
    if (n % 3 == 1) s.x.short_left = 1;
    Sample o = s;
    for (double& i : o.y.i) i *= 4;
    o.y.u_dc *= 2, o.tau_ref *= 8, o.x.tau *= 8, o.x.steps.reference *= 8, o.x.mean.tau_before *= 8;
    const auto a = guide.law(T_s, n / 2 % 2).step(s.x, s.y, s.tau_ref);
    const auto b = other.law(T_s, n / 2 % 2).step(o.x, o.y, o.tau_ref);
    for (int k = 0; k < N; ++k) {
      worst = worst_of({worst, unless(a[k].leg == b[k].leg && a[k].t_edge == b[k].t_edge)});
    }
    worst = worst_of({worst, off(s.x.short_left, o.x.short_left), off(8 * s.x.tau, o.x.tau)});
  }
  return worst;
}

}  // namespace

int main() {
  const Guide guide;
  check("holds the torque, or follows the guide for a period [rad]", modes(guide), 1e-9);
  check("a step lasts for a stroke [rad]", strokes(guide), 1e-12);
  check("levels that a phase may take", levels(guide), 0);
  check("phases without current", idle_phases(guide), 0);
  check("edges where a band is left", edges(guide), 0);
  check("flux linkages that follow the guide", following(guide), 0);
  check("units of flux linkage and current", units(guide), 0);
  return failures == 0 ? 0 : 1;
}
