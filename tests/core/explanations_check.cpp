// What is left of the explanations of a contradiction, against what is wrong in truth: the fault
// that there is is never dropped, and all others are, so that it is named. Exchanged cables before
// and behind the sensors, angles that are off or run backwards, and broken phases.
#include "doubted.hpp"
#include "srm/machine/inverse.hpp"

using namespace srm;
using namespace doubted;

namespace {

constexpr double turning = 4 * 157.0;  // electrical speed [rad/s]

/// What is wrong: which winding the orders of a phase go to and a channel shows; the angle.
template <int N>
struct Wrong {
  std::array<int, N> ordered, shown;  // windings
  double offset = 0;                  // [rad]
  bool backwards = false;
  double held = 0;  // of the angle, from a period on: it stays [rad]
  int dead_channel = -1, open_phase = -1;
  int part_of = -1;  // a channel that shows another part of its current from a sample on
  double part = 1;
  int part_from = 0;

  Wrong() {
    for (int k = 0; k < N; ++k) ordered[k] = shown[k] = k;
  }
  Wrong swapped(int a, int b, bool power, bool sensors) const {
    Wrong w = *this;
    if (power) std::swap(w.ordered[a], w.ordered[b]);
    if (sensors) std::swap(w.shown[a], w.shown[b]);
    return w;
  }
};

struct Named {
  Status status = Status::ok;
  int phase = -2, first = -1;  // of the fault, and of the first contradiction
  int samples = 0;             // of doubt
  double i_most = 0;           // [A]
  bool kept = true;            // what is wrong in truth was never dropped
};

/// The mean level of an order over a sample.
double mean_level(const PhaseCommand<double>& order) {
  double from = 0, mean = 0;
  for (int n = 0; n <= max_edges; ++n) {
    const double to = n < max_edges ? std::fmin(order.t_edge[n], T_s) : T_s;
    mean += static_cast<int>(order.leg[n]) * (to - from) / T_s;
    from = to;
  }
  return mean;
}

/// A run from standstill of the currents: trials of each phase, then windows with a current band.
/// left(explanations, first phase): whether the truth is still among them.
template <int N>
Named run(const Wrong<N>& wrong, double theta_0, int delay, double omega_e, auto&& left,
          int samples = 4000, double spread = 1e9, double map_error = 0.02) {
  auto d = diagnosis();
  d.likeness.spread = spread;
  d.flux.map_error = map_error;
  const auto p = protection(delay);
  typename Diagnosis<double>::template State<N> x;
  typename Protection<double>::template State<N> guard;
  x.trial = PhaseTrial<double>::begun<N>(d.flux.psi_max);
  std::array<double, N> psi{}, i{};  // of the windings
  Command<double, N> orders{}, next{};
  Named found;
  for (int n = 0; n < samples; ++n) {
    const double theta = wrap(theta_0 + omega_e * n * T_s);
    double told = wrong.held > 0 && n * T_s * std::fabs(omega_e) > wrong.held ? theta_0 : theta;
    told = wrap((wrong.backwards ? -told : told) + wrong.offset);
    Measurement<double, N> y{.theta_e = told, .omega_m = omega_e / 4, .u_dc = u_dc};
    for (int k = 0; k < N; ++k) y.i[k] = k == wrong.dead_channel ? 0 : i[wrong.shown[k]];
    if (wrong.part_of >= 0 && n >= wrong.part_from) y.i[wrong.part_of] *= wrong.part;
    if (d.finds(x, guard, p, machine(), y)) {
      found.status = guard.fault.status;
      found.phase = guard.fault.phase;
      found.first = x.first.phase;
      found.samples = static_cast<int>(x.doubted);
      found.kept = found.kept && (x.doubted == 0 || left(x.left, x.first.phase));
      return found;
    }
    if (x.doubted > 0) found.kept = found.kept && left(x.left, x.first.phase);
    Command<double, N> given{};
    if (!d.tries(x, p, machine(), y, given)) {
      for (int k = 0; k < N; ++k) {
        const double at = phase_angle<N>(told, k);
        const bool in = at > 0.3 && at < 2.2;
        given[k] = hold<double>(!in           ? Leg::demagnetize
                                : y.i[k] < 40 ? Leg::magnetize
                                              : Leg::freewheel);
      }
    }
    p.remember(guard, 4, y, given, p.levels);
    d.remember(x, p, given);
    orders = delay > 0 ? next : given;
    next = given;
    for (int k = 0; k < N; ++k) {
      const int w = wrong.ordered[k];
      const double u = k == wrong.open_phase ? -u_dc : mean_level(orders[k]) * u_dc;
      psi[w] = std::fmax(psi[w] + T_s * (u - R * i[w]), 0);
      const double at = phase_angle<N>(wrap(theta + omega_e * T_s), w);
      i[w] = current_from_flux(machine(), psi[w], at, 400.0);
      found.i_most = std::fmax(found.i_most, i[w]);
    }
  }
  found.samples = static_cast<int>(x.doubted);
  found.first = x.first.phase;
  return found;
}

/// Over all runs: status and phase that are not expected, a truth that was dropped, and currents.
struct Tally {
  double named = 0, kept = 0;
  double i_most = 0;  // before the fault has its name [A]
  int longest = 0;    // doubt [samples]

  void add(const Named& n, Status status, int phase = -1) {
    named += unless(n.status == status && n.phase == phase);
    kept += unless(n.kept);
    i_most = std::fmax(i_most, n.i_most);
    longest = n.samples > longest ? n.samples : longest;
  }
};

template <int N>
void exchanged(Tally& tally, int a, int b, bool power, bool sensors) {
  const auto left = [&](const Explanations& e, int first) {
    const unsigned bits = power && sensors ? e.both : power ? e.power : e.sensors;
    return (first == a || first == b) && (bits >> (a + b - first) & 1U) == 1;
  };
  const bool opposite = 2 * (b - a) == N;  // an angle that runs backwards has the same effect
  for (int delay : {0, 1}) {
    for (double theta : {0.1, 2.0, 4.0}) {
      const auto wrong = Wrong<N>{}.swapped(a, b, power, sensors);
      const Named n = run<N>(wrong, theta, delay, turning, left);
      if (power && sensors && opposite) {
        tally.kept += unless(n.kept && n.status == Status::ok && n.samples > 3800);
      } else {
        tally.add(n,
                  power && sensors && N == 3 ? Status::angle_reversed : Status::phases_exchanged);
      }
    }
  }
}

/// Every pair of phases: motor cables (power), channels (sensors), or cables behind the sensors.
Tally all_pairs(bool power, bool sensors) {
  Tally tally;
  for (int a = 0; a < 4; ++a) {
    for (int b = a + 1; b < 4; ++b) {
      exchanged<4>(tally, a, b, power, sensors);
      if (b < 3) exchanged<3>(tally, a, b, power, sensors);
    }
  }
  return tally;
}

/// By each of the angles that are kept, and up to half a step to each side of it; but about none.
Tally all_angles(bool backwards) {
  Tally tally;
  for (int n = backwards ? 0 : 1; n < Explanations::n_angles; ++n) {
    const auto left = [&](const Explanations& e, int) {
      return ((backwards ? e.reversed : e.offset) >> n & 1U) == 1;
    };
    for (double beside : {-0.49, 0.0, 0.49}) {
      if (!backwards && n < 2 && beside < 0) continue;
      if (!backwards && n > Explanations::n_angles - 2 && beside > 0) continue;
      Wrong<3> wrong;
      wrong.backwards = backwards;
      wrong.offset = (backwards ? 1 : -1) * (n + beside) * turn / Explanations::n_angles;
      for (int delay : {0, 1}) {
        tally.add(run<3>(wrong, 0.2, delay, turning, left),
                  backwards ? Status::angle_reversed : Status::angle_off);
      }
    }
  }
  return tally;
}

Tally all_phases() {
  Tally tally;
  for (int k = 0; k < 4; ++k) {
    const auto left = [&](const Explanations& e, int) { return e.phase == 1 << k; };
    for (bool dead : {false, true}) {
      Wrong<4> wrong;
      (dead ? wrong.dead_channel : wrong.open_phase) = k;
      tally.add(run<4>(wrong, 0.2, 0, turning, left), Status::dead_current_sensor, k);
    }
  }
  return tally;
}

/// A channel that shows more or less while the law runs. Without a comparison of the phases the
/// contradiction waits until the other phases agree with the angle; with it no longer. Where the
/// map may be so wrong, the phase is unlike the others.
Tally all_gains(double spread, double map_error) {
  Tally tally;
  for (int k = 0; k < 3; ++k) {
    for (double part : {0.75, 1.3}) {
      for (int from : {1500, 1650, 1800}) {
        Wrong<3> wrong;
        wrong.part_of = k;
        wrong.part = part;
        wrong.part_from = from;
        const auto left = [&](const Explanations& e, int) { return e.phase == 1 << k; };
        const Named n = run<3>(wrong, 0.2, 0, turning, left, 8000, spread, map_error);
        tally.add(n,
                  map_error > 0.1 ? Status::phase_unlike
                  : part < 1      ? Status::current_too_low
                                  : Status::current_too_high,
                  k);
      }
    }
  }
  return tally;
}

/// A sound drive, in both directions: the law runs after two rounds of trials.
double sound() {
  double worst = 0;
  const auto any = [](const Explanations&, int) { return true; };
  for (double omega : {turning, -turning}) {
    for (int delay : {0, 1}) {
      const Named n = run<4>({}, 0.3, delay, omega, any, 8000);
      worst = worst_of({worst, unless(n.status == Status::ok && n.first == -1 && n.samples == 0),
                        unless(n.i_most > 40)});
    }
  }
  return worst;
}

}  // namespace

/// Trials go to 12 A, the law to 40 A; a channel that shows three quarters to 53 A and a sample.
int main() {
  check("a sound drive is not doubted", sound(), 0);
  const auto told = [](const char* what, const Tally& t, int longest, double i_most = 2 * 12) {
    check(what, t.named, 0);
    check("  of which the truth was dropped", t.kept, 0);
    check("  and the longest doubt [samples]", t.longest, longest);
    check("  and the greatest current [A]", t.i_most, i_most);
  };
  told("motor cables of two phases, not named", all_pairs(true, false), 500);
  told("channels of two phases", all_pairs(false, true), 500);
  told("cables behind the sensors", all_pairs(true, true), 700);
  told("an angle that is off", all_angles(false), 120);
  told("an angle that runs backwards", all_angles(true), 200);
  told("a channel without a signal, and an open phase", all_phases(), 400);
  told("a channel with another gain", all_gains(1e9, 0.02), 250, 60);
  told("and by a comparison of the phases", all_gains(0.02, 0.02), 250, 60);
  told("and where the map may be wrong by half", all_gains(0.02, 0.5), 0, 60);
  return failures == 0 ? 0 : 1;
}
