// The derivatives that a machine answers, against differences of what it answers at two points.
#include <cmath>
#include <cstdio>
#include <vector>

#include "srm/machine/flux_map.hpp"
#include "srm/machine/lehuy.hpp"

using namespace srm;

namespace {

int failures = 0;

void check(const char* law, double worst) {
  const bool ok = worst < 1e-7;
  std::printf("%s %-40s %.1e\n", ok ? "ok  " : "FAIL", law, worst);
  failures += !ok;
}

/// The largest error of all derivatives over currents and angles, each relative to the greatest
/// value that it takes.
template <class M>
double worst_error(const M& machine, double i_max) {
  const double di = i_max * 1e-5, dtheta = 1e-5;  // electrical
  double worst[8] = {}, most[8] = {};
  for (double i = 0.011 * i_max; i < i_max; i += 0.0531 * i_max) {
    for (double theta = 0.0123; theta < 6.25; theta += 0.0721) {
      const auto here = machine.at(i, theta);
      const Jet<double> jet = machine.jet(i, theta);
      const auto up = machine.at(i + di, theta), down = machine.at(i - di, theta);
      const auto on = machine.at(i, theta + dtheta), back = machine.at(i, theta - dtheta);
      const double per_i = 1 / (2 * di), per_theta = machine.N_r / (2 * dtheta);
      const double expected[8] = {here.psi,
                                  here.tau,
                                  here.L_inc,
                                  here.psi_theta,
                                  (on.tau - back.tau) * per_theta,
                                  (up.L_inc - down.L_inc) * per_i,
                                  (on.L_inc - back.L_inc) * per_theta,
                                  (on.psi_theta - back.psi_theta) * per_theta};
      const double found[8] = {jet.psi,       jet.tau, jet.L_inc,   jet.psi_theta,
                               jet.tau_theta, jet.L_i, jet.L_theta, jet.psi_theta_2};
      for (int n = 0; n < 8; ++n) {
        worst[n] = std::fmax(worst[n], std::fabs(found[n] - expected[n]));
        most[n] = std::fmax(most[n], std::fabs(expected[n]));
      }
    }
  }
  double all = 0;
  for (int n = 0; n < 8; ++n) all = std::fmax(all, worst[n] / most[n]);
  return all;
}

/// One piece in current and one cell in angle, any coefficients: a polynomial everywhere.
double worst_of_a_map() {
  std::vector<double> knot{0.0, 1e3}, coefficient;
  std::vector<std::uint8_t> piece(1, 0);
  for (int n = 0; n < 2 * 4 * 5; ++n) coefficient.push_back(std::sin(1.0 + n * n));
  const FluxMap<double> map{.N_r = 6,
                            .n_i = 2,
                            .n_theta = 1,
                            .n_slot = 1,
                            .theta_span = pi<double>,
                            .cells_per_rad = 1 / pi<double>,
                            .slots_per_A = 1e-3,
                            .knot = {knot.data(), 2},
                            .piece = {piece.data(), 1},
                            .coefficient = {coefficient.data(), 2 * 4 * 5}};
  return worst_error(map, 3.0);
}

}  // namespace

int main() {
  check("analytic machine",
        worst_error(lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468), 200));
  check("flux map", worst_of_a_map());
  return failures == 0 ? 0 : 1;
}
