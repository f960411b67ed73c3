// The derivatives that a machine answers, against differences of what it answers at two points; and
// those of a pair of phases.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <vector>

#include "any_pairs.hpp"
#include "srm/machine/flux_map.hpp"
#include "srm/machine/lehuy.hpp"
#include "srm/machine/with_inductance.hpp"
#include "srm/plant/pair_piece.hpp"

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

/// Every answer as a derivative of the co-energy, each relative to the greatest value that it
/// takes.
template <class M>
double coenergy_error(const M& machine, double i_max) {
  const double di = i_max * 1e-5, dtheta = 1e-5;
  double worst[4] = {}, most[4] = {};
  for (double i = 0.011 * i_max; i < i_max; i += 0.0531 * i_max) {
    for (double theta = 0.0123; theta < 6.25; theta += 0.0721) {
      const auto here = machine.at(i, theta);
      const auto up = machine.at(i + di, theta), down = machine.at(i - di, theta);
      const auto on = machine.at(i, theta + dtheta), back = machine.at(i, theta - dtheta);
      const double per_i = 1 / (2 * di), per_theta = machine.N_r / (2 * dtheta);
      const double expected[4] = {(up.W_c - down.W_c) * per_i, (on.W_c - back.W_c) * per_theta,
                                  (up.psi - down.psi) * per_i, (on.psi - back.psi) * per_theta};
      const double found[4] = {here.psi, here.tau, here.L_inc, here.psi_theta};
      for (int n = 0; n < 4; ++n) {
        worst[n] = std::fmax(worst[n], std::fabs(found[n] - expected[n]));
        most[n] = std::fmax(most[n], std::fabs(expected[n]));
      }
    }
  }
  double all = 0;
  for (int n = 0; n < 4; ++n) all = std::fmax(all, worst[n] / most[n]);
  return all;
}

/// An inductance in addition is there in the flux linkage, and makes no torque.
double inductance_error() {
  const auto map = lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468);
  const WithInductance<LeHuy<double>> more{map, 4, 2e-3};
  const auto a = map.at(30, 1.2), b = more.at(30, 1.2);
  return std::fmax(coenergy_error(more, 200),
                   std::fmax(std::fabs(b.psi - a.psi - 0.06), std::fabs(b.tau - a.tau)));
}

/// One piece in current and one cell in angle, any coefficients: a polynomial everywhere.
template <class Error>
double worst_of_a_map(const Error& error) {
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
  return error(map, 3.0);
}

/// The polynomial of a pair against its tables, at currents and angles in all of their pieces.
/// Writes how often the answer has other bits where it was asked elsewhere before.
double worst_of_pairs(int& other_bits) {
  const AnyPairs any;
  const Coupling<double>& pairs = any.pairs;
  const double h = 1e-5, per_theta = pairs.N_r / (2 * h), per_i = 1 / (2 * h);
  double worst = 0;
  const auto compare = [&](std::initializer_list<double> found,
                           std::initializer_list<double> expected, double scale) {
    for (auto [a, b] = std::pair(found.begin(), expected.begin()); a != found.end(); ++a, ++b) {
      worst = std::max(worst, std::fabs(*a - *b) / scale);
    }
  };
  for (int n = 0; n < 2; ++n) {
    PairPiece used;
    for (double a = 0.21; a < 14; a += 2.3) {
      for (double b = 0.33; b < 14; b += 2.3) {
        for (double theta = 0.05; theta < 6.25; theta += 0.2137) {
          const auto at = [&](double da, double db, double dtheta) {
            return pairs.at(n, a + da, b + db, theta + dtheta);
          };
          const auto m = at(0, 0, 0), on = at(0, 0, h), back = at(0, 0, -h), up = at(h, 0, 0),
                     down = at(-h, 0, 0), more = at(0, h, 0), less = at(0, -h, 0);
          const PairJet jet = used.jet(pairs, n, a, b, theta);
          const double scale = std::max({std::fabs(m.tau_theta), std::fabs(m.W_c), 1.0});
          compare(
              {jet.first.psi, jet.first.tau, jet.first.L_inc, jet.first.psi_theta,
               jet.first.tau_theta, jet.second.psi, jet.second.tau, jet.second.L_inc,
               jet.second.psi_theta, jet.second.tau_theta, jet.link.L},
              {m.psi_first, m.tau / 2, m.L_first, m.psi_theta_first, m.tau_theta / 2, m.psi_second,
               m.tau / 2, m.L_second, m.psi_theta_second, m.tau_theta / 2, m.L_mutual},
              scale * 1e-4);  // to 1e-11
          compare(
              {jet.first.L_i, jet.first.L_theta, jet.first.psi_theta_2, jet.second.L_i,
               jet.second.L_theta, jet.second.psi_theta_2, jet.link.L_theta, jet.link.L_first,
               jet.link.L_second},
              {(up.L_first - down.L_first) * per_i, (on.L_first - back.L_first) * per_theta,
               (on.psi_theta_first - back.psi_theta_first) * per_theta,
               (more.L_second - less.L_second) * per_i, (on.L_second - back.L_second) * per_theta,
               (on.psi_theta_second - back.psi_theta_second) * per_theta,
               (on.L_mutual - back.L_mutual) * per_theta, (up.L_mutual - down.L_mutual) * per_i,
               (more.L_mutual - less.L_mutual) * per_i},
              scale);
          const auto of_second = pairs.at(n, a, 0, theta), of_first = pairs.at(n, 0, b, theta);
          compare({used.induced(pairs, n, a, 0, 7, theta, 30),
                   used.induced(pairs, n, 0, b, 7, theta, 30)},
                  {7 * of_second.L_mutual + 30 * of_second.psi_theta_second,
                   7 * of_first.L_mutual + 30 * of_first.psi_theta_first},
                  scale * 1e-2);
          const PairJet fresh = PairPiece().jet(pairs, n, a, b, theta);
          other_bits += std::memcmp(&fresh, &jet, sizeof jet) != 0;
        }
      }
    }
  }
  return worst;
}

/// Within a cell and two pieces the tables are read once: whoever empties them sees it in the next
/// cell only. Counts the answers that are wrong.
int reads_of_tables() {
  AnyPairs any;
  PairPiece piece;
  const double cell = pi<double> / 5, begin = any.behind[0] + cell;
  std::vector<double> full;
  for (int j = 0; j < 40; ++j) {
    full.push_back(piece.jet(any.pairs, 0, 3.6 - j / 12.0, j / 12.0, begin + j * cell / 40).link.L);
  }
  std::fill(any.C.begin(), any.C.end(), 0.0);
  int wrong = 0;
  for (int j = 39; j >= 0; --j) {
    const double L =
        piece.jet(any.pairs, 0, 3.6 - j / 12.0, j / 12.0, begin + j * cell / 40).link.L;
    wrong += L != full[j];
  }
  for (const double a : {3.6, 3.8}) {  // on in the angle, then in the first current
    piece.jet(any.pairs, 0, 3.6, 1, begin);
    wrong += piece.jet(any.pairs, 0, a, 1, begin + (a < 3.7 ? cell : 0)).link.L != 0;
  }
  return wrong;
}

}  // namespace

int main() {
  check("analytic machine",
        worst_error(lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468), 200));
  check("flux map", worst_of_a_map([](const auto& map, double i) { return worst_error(map, i); }));
  check("analytic machine, co-energy",
        coenergy_error(lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468), 200));
  check("flux map, co-energy",
        worst_of_a_map([](const auto& map, double i) { return coenergy_error(map, i); }));
  check("an inductance in addition", inductance_error());
  int other_bits = 0;
  check("pair of phases", worst_of_pairs(other_bits));
  check("pair of phases, asked in any order", other_bits);
  check("pair of phases, tables read once a cell", reads_of_tables());
  return failures == 0 ? 0 : 1;
}
