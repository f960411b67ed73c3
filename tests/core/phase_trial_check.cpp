// A trial of one phase: when its current has reached what it is magnetized to, in whichever channel
// it shows, and when it has where none shows.
#include <cmath>

#include "doubted.hpp"
#include "srm/control/guard/phase_trial.hpp"

using namespace srm;
using namespace doubted;

namespace {

constexpr int N = 3;
using Known = Diagnosis<double>;
using Trial = PhaseTrial<double>;
using Y = Measurement<double, N>;

/// Phase 1 is magnetized, by this many volt-seconds so far; channel 2 showed a current before.
struct Sample {
  Known known = diagnosis();
  Protection<double> p = protection(1);
  Trial::State x{
      .to_come = 3, .phase = 1, .magnetizes = true, .tried = 255, .flow = 4, .volt_seconds = 0.01};
  Y y{.theta_e = 2.1, .u_dc = u_dc};
  Known::Span flux{0, 1};
  Command<double, N> orders{};

  /// Whether the trial ends in this sample; then it is counted, and the legs are off.
  bool ends() {
    const double u = T_s * u_dc, before = x.volt_seconds + u;
    const bool tries = known.trial.step(
        x, known.flux, true, p, machine(), y, [&](int) { return flux; }, orders);
    const bool ended = !x.magnetizes;
    worst += unless(tries && x.tried == (ended ? 0 : 255));
    worst += unless((orders[1].leg[0] == Leg::magnetize) == !ended);
    worst += unless(off(x.volt_seconds, ended ? 0 : before) < 1e-12);
    if (ended) worst += unless(off(x.left, 1.25 * before + 3 * u) < 1e-12 && x.to_come == 2);
    return ended;
  }
  double worst = 0;
};

/// A current of 12 A, in any channel but the one that showed one before.
double by_a_current() {
  double worst = 0;
  for (int k = 0; k < N; ++k) {
    for (double i : {12 - 1e-9, 12.0}) {
      Sample s;
      s.y.i[k] = i;
      worst += unless(s.ends() == (k != 2 && i >= 12)) + s.worst;
    }
  }
  return worst;
}

/// Where a channel shows less, the flux linkage is more than 12 A have at any angle; where none
/// does, it is more than without a current, or than the map has with 24 A at the angle, which may
/// be wrong by 2 %.
double by_a_flux_linkage() {
  double worst = 0;
  for (double more : {-1e-9, 1e-9}) {
    for (bool shows : {false, true}) {
      for (bool small : {false, true}) {
        Sample s;
        if (!small) s.known.flux.psi_zero = 1;
        s.y.i[0] = shows ? i_zero + 1e-9 : i_zero;
        const double at_twice = machine().at(24, phase_angle<N>(2.1, 1)).psi;
        const double least = shows   ? s.known.trial.psi
                             : small ? s.known.flux.psi_zero
                                     : 0.98 * at_twice;
        s.flux = {least + more, 1};
        worst += unless(s.ends() == (more > 0)) + s.worst;
      }
    }
  }
  return worst;
}

/// At the latest with twice the volt-seconds of the greatest flux linkage.
double by_time() {
  double worst = 0;
  for (double more : {-1e-9, 1e-9}) {
    Sample s;
    s.x.volt_seconds = 2 * s.known.flux.psi_max - T_s * u_dc + more;
    worst += unless(s.ends() == (more > 0)) + s.worst;
  }
  return worst;
}

}  // namespace

int main() {
  check("by a current in a channel that showed none", by_a_current(), 0);
  check("by a flux linkage, with and without a current that shows", by_a_flux_linkage(), 0);
  check("by time", by_time(), 0);
  return failures == 0 ? 0 : 1;
}
