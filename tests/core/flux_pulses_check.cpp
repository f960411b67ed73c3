// The pulses from which commissioning takes the flux linkages: how long each part lasts, what a row
// of the recording says of the voltage, and what ends the routine.
#include <cmath>
#include <map>

#include "errors.hpp"
#include "srm/control/commission/flux_pulses.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr int N = 3;
constexpr double T_s = 20e-6;
using Pulses = FluxPulses<double>;
using Part = Pulses::Part;

constexpr Pulses routine{.duty = 0.5,
                         .i_top = 5,
                         .i_beside = 3,
                         .i_end = 1,
                         .slack = 0.02,
                         .v_switch = 3,
                         .v_diode = 1,
                         .n_rest = 3,
                         .n_pulse = 20,
                         .delay = 0,
                         .hold = {.pi = {.K_p = 2, .K_iT = 0}, .duty_max = 0.5},
                         .duty_dead = 0.05,
                         .n_settle = 4};

/// The current of the pulsed phase rises and falls by an ampere a sample.
struct Bench {
  Pulses pulses = routine;
  Pulses::State x{};
  Measurement<double, N> y{.theta_e = 1, .omega_m = 0, .u_dc = 100};
  Command<double, N> orders{};
  std::map<Part, int> steps{};
  int ends_at = 5;  // where the current stops rising [A]

  Bench(int k = 0, int count = 2, int held = -1, double i_held = 0) {
    pulses.start<N>(x, k, count, held, i_held);
  }
  void step() {
    orders = pulses.step(x, y, T_s);
    ++steps[x.part];
    double& i = y.i[x.k];
    if (x.part == Part::rise && i < ends_at) i += 1;
    if (x.part != Part::rise && i > 0) i -= 1;
  }
  Finding run() {
    for (int n = 0; n < 1000 && x.finding == Finding::running; ++n) step();
    return x.finding;
  }
};

/// A phase rests, rises to 5 A in five samples, falls to none in five, and rests as long as both
/// took, before the next pulse. The step in which a part begins counts.
double parts() {
  Bench b;
  double worst = unless(b.run() == Finding::done && b.x.row.pulse == 2 && b.x.progress() == 1);
  worst += unless(b.steps[Part::rise] == 2 * 5 && b.steps[Part::fall] == 2 * 5);
  worst += unless(b.steps[Part::decay] == 2 * (1 + 10));
  worst += unless(b.steps[Part::rest] == 3 + (1 + 3) + 1 && b.steps[Part::settle] == 0);
  Bench one(2, 0);  // a pulse at least
  worst += unless(one.run() == Finding::done && one.x.row.pulse == 1 && one.x.k == 2);
  Bench nobody(N, 1);
  return worst + unless(nobody.x.k == 0);
}

/// Rows count from the rest before a pulse; the legs of the others are off.
double rows() {
  Bench b(1);
  double worst = 0;
  int sample = 0;
  for (int n = 0; n < 40; ++n) {
    const double i = b.y.i[1];
    b.step();
    ++sample;
    if (b.x.part == Part::rest && b.x.n == 0) sample = 0;  // a pulse has ended
    worst = worst_of({worst, off(b.x.row.i, i), off(b.x.row.theta_e, 1)});
    worst += unless(b.x.row.sample == sample && b.x.row.u_held == 0 && b.x.row.i_held == 0);
    worst += unless(b.orders[0].leg[0] == Leg::demagnetize && b.orders[2].t_edge[0] >= T_s);
    const bool drives = b.x.part == Part::rise || b.x.part == Part::fall;
    worst += unless((b.orders[1].t_edge[0] < T_s) == drives);
    worst += unless(!drives || b.orders[1].leg[1] ==
                                   (b.x.part == Part::rise ? Leg::magnetize : Leg::demagnetize));
  }
  return worst;
}

/// A longer rise or fall than the longest has no current, or too much.
double longest() {
  Bench low;
  low.ends_at = 4;
  double worst = unless(low.run() == Finding::no_current && low.steps[Part::rise] == 1 + 21);
  for (int most : {3, 4}) {
    Bench slow;
    slow.pulses.n_pulse = most;
    worst += unless(slow.run() == (most == 3 ? Finding::no_current : Finding::done));
  }
  return worst;
}

/// Half of the mean of two readings of the dc link, less the thresholds: of two switches for half
/// of the time when it magnetizes, of two diodes when it demagnetizes, and of one each besides.
double voltages() {
  double worst = 0;
  for (int delay : {0, 1}) {
    Bench b;
    b.pulses.delay = delay;
    double before = 0, now = 0, ordered = 0;
    for (int n = 0; n < 60 && b.x.finding == Finding::running; ++n) {
      const double u = (b.y.u_dc + b.x.u_dc) / 2, in_effect = delay > 0 ? before : now;
      b.step();
      const double drops = in_effect > 0 ? 3 + 1 + 0.5 * 2 : 3 + 1 - 0.5 * 2;
      worst = worst_of({worst, off(b.x.row.u_mean, in_effect == 0 ? 0 : in_effect * u - drops)});
      ordered = b.x.part == Part::rise ? 0.5 : b.x.part == Part::fall ? -0.5 : 0;
      before = now;
      now = ordered;
      b.y.u_dc = 100 + n % 7;
    }
  }
  return worst;
}

/// The rotor is clamped within the slack of where it was found, over the end of a period too.
double clamped() {
  double worst = 0;
  for (double at : {1.0, 0.005, turn - 0.005}) {
    for (double moved : {0.0199, -0.0199, 0.0201, -0.0201}) {
      Bench b;
      b.y.theta_e = at;
      b.step();
      b.y.theta_e = std::fmod(at + moved + turn, turn);
      worst += unless(b.run() == (std::fabs(moved) < 0.02 ? Finding::done : Finding::rotor_moved));
    }
  }
  return worst;
}

/// A second phase at 8 A: it settles first, within a quarter; a pulse beside it ends earlier, and
/// rows say its voltage and current.
double beside() {
  double worst = 0;
  for (double i : {6.0, 10.0, 5.99, 10.01}) {
    Bench b(0, 1, 2, 8);
    b.y.i[2] = i;
    worst += unless(b.x.part == Part::settle && b.x.row.pulse == -1 && b.x.progress() == 0);
    const Finding found = b.run();
    worst += unless(b.steps[Part::settle] == 4);
    worst += unless(found == (i >= 6 && i <= 10 ? Finding::done : Finding::no_current));
    if (found == Finding::done) worst += unless(b.steps[Part::rise] == 3);
    // 2 V/A, at most half of 100 V; what the order of the step before gave.
    const double duty = 2 * (8 - i) / 100, ordered = duty < 0 && duty > -0.05 ? 0 : duty;
    worst = worst_of({worst, off(b.x.row.i_held, i),
                      off(b.x.row.u_held, 100 * ordered - (3 + 1 + ordered * 2))});
  }
  Bench first(1, 1, 0, 8);  // the first phase is one that can be held
  first.y.i[0] = 8;
  worst += unless(first.run() == Finding::done && first.steps[Part::rise] == 3);
  worst = worst_of({worst, off(first.x.row.i_held, 8), off(first.x.row.u_held, -(3 + 1))});
  worst += unless(first.orders[0].leg[0] == Leg::freewheel);
  for (double i : {10.4, 10.6}) {  // in place of less than a dead time it freewheels
    Bench b(0, 1, 2, 8);
    b.y.i[2] = i;
    b.step();
    worst += unless((b.orders[2].leg[1] == Leg::demagnetize) == (i > 10.5));
  }
  for (const auto& [held, i_held] : {std::pair{0, 8.0}, {-1, 8.0}, {N, 8.0}, {2, 0.0}, {2, -1.0}}) {
    Bench none(0, 1, held, i_held);
    worst += unless(none.x.held == -1 && none.x.part == Part::rest && none.x.row.pulse == 0);
  }
  return worst;
}

}  // namespace

int main() {
  check("flux pulses: how long each part lasts", parts(), 0);
  check("their rows, and the legs of other phases", rows(), 0);
  check("no current within the longest part", longest(), 0);
  check("voltage of a row, less the devices [V]", voltages(), 1e-12);
  check("the rotor stays within the slack", clamped(), 0);
  check("a second phase that is held [V]", beside(), 1e-12);
  return failures != 0;
}
