// Current references of a guide that is followed by its flux linkages: what each phase is given in
// a sample, and the torque by which the mean is held, at any currents, speeds, voltages, senses.
#include <cmath>
#include <vector>

#include "errors.hpp"
#include "srm/control/part/guide_currents.hpp"
#include "srm/machine/lehuy.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr int N = 3, columns = 90;
constexpr double T_s = 1e-4, R = 0.72, i_max = 60, tau_max = 30;
using M = LeHuy<double>;

M machine() { return lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468); }
double psi(double i, double theta) { return i > 0 ? machine().at(i, theta).psi : 0; }
double tau(double i, double theta) { return i > 0 ? machine().at(i, theta).tau : 0; }

/// The same currents at every torque: the feedback of the mean has no say.
struct Guide {
  std::vector<double> values;
  double omega = 100;
  Guide() {
    for (int j = 0; j < 2 * columns; ++j) {
      values.push_back(std::fmax(70 * std::sin(j % columns * turn / columns - 0.3), 0));
    }
  }
  ReferenceProfile<double> profile() const {
    return {{{values.data(), 2 * columns}, 2, columns, tau_max}, {&omega, 1}, 240, 0};
  }
  double at(double theta) const { return profile().at(10, 0, 240).at(wrap(theta)); }
};

/// What a phase needs to be on the guide at the end of its sample, against 0.7 of the voltage.
double reference(const Guide& guide, double delay, double before, double i, double theta,
                 double turned, double u_dc) {
  const double begin = wrap(theta + turned * delay), end = wrap(theta + turned * (delay + 1));
  double from = psi(i, theta);
  if (delay != 0) {
    const double left = from - T_s * R * i;
    from = std::fmin(std::fmax(psi(before, begin), std::fmax(left - T_s * u_dc, 0)),
                     std::fmax(left + T_s * u_dc, 0));
  }
  const double needed = (psi(guide.at(end), end) - from) / T_s + R * i;
  if (needed > 0.7 * u_dc) return i_max;
  if (needed < -0.7 * u_dc) return 0;
  return std::fmin(guide.at(theta + turned * (delay + 0.5)), i_max);
}

double follows() {
  const Guide guide;
  double worst = 0;
  int all = 0, none = 0, held = 0;
  for (int n = 0; n < 900; ++n) {
    const double delay = n % 3 == 0 ? 0 : n % 3 == 1 ? 1 : 1.5, tau_ref = n % 2 ? 10 : -10;
    const double u_dc = 100 + 30 * (n % 7), omega_m = 150 * std::sin(0.37 * n);
    const double sense = tau_ref < 0 ? -1 : 1, turned = sense * 4 * omega_m * T_s;
    const GuideCurrents<M, N> law{machine(), R, i_max, T_s, delay};
    Measurement<double, N> y{.theta_e = wrap(1.618 * n), .omega_m = omega_m, .u_dc = u_dc};
    FollowedCurrents<double, N> x;
    for (int k = 0; k < N; ++k) {
      const double here = guide.at(sense * phase_angle<N>(y.theta_e, k));
      y.i[k] = n % 11 == 0 ? -1 : here + 4 * std::sin(0.7 * n + 2 * k);
      x.i_ref[k] = n % 5 == k ? i_max : n % 5 == 3 ? 0 : here + 4 * std::sin(n + k);
      x.i_before[k] = std::fmax(y.i[k] + 5 * std::sin(n + 3 * k), 0);
    }
    x.mean.tau_before = (tau_ref < 0) == (omega_m < 0) ? 10 : -10;  // below 0: it brakes
    const auto was = x;
    law.follow(x, guide.profile(), y, tau_ref);
    double given = 0;
    for (int k = 0; k < N; ++k) {
      const double theta = wrap(sense * phase_angle<N>(y.theta_e, k));
      const double i = std::fmax(y.i[k], 0), before = was.i_before[k];
      const double i_ref = reference(guide, delay, was.i_ref[k], i, theta, turned, u_dc);
      worst = worst_of({worst, off(x.i_ref[k], i_ref), off(x.i_before[k], i)});
      (i_ref == i_max ? all : i_ref == 0 ? none : held) += 1;
      const bool regulated = was.i_ref[k] > 0 && was.i_ref[k] < i_max;
      given += regulated ? tau(before + 0.6 * (i - before), wrap(theta - turned / 2))
                         : (tau(i, theta) + tau(before, wrap(theta - turned))) / 2;
    }
    const double share = std::fmin(std::fabs(turned) / 3, 1);
    worst =
        worst_of({worst, off(x.mean.miss, std::fmin(std::fmax(share * (1 - given / 10), -2), 2))});
  }
  return worst_of({worst, unless(all > 200 && none > 200 && held > 200)});
}

}  // namespace

int main() {
  check("guide of currents: references, and the mean torque", follows(), 1e-9);
  return failures != 0;
}
