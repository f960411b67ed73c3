// What the tables of a machine say of themselves: what is wrong with pairs of phases, and the least
// incremental inductance of a flux map.
#include <cmath>
#include <string_view>
#include <vector>

#include "any_pairs.hpp"
#include "errors.hpp"
#include "srm/machine/flux_map.hpp"
#include "within.hpp"

using namespace srm;

namespace {

/// Each by one number of it, at the edge of what is right.
double faults_of_pairs() {
  double worst = 0;
  const auto has = [&](auto change, std::string_view fault) {
    AnyPairs any;
    change(any);
    const char* told = any.pairs.fault(3);
    worst += unless(std::string_view(told == nullptr ? "" : told) == fault);
  };
  has([](AnyPairs&) {}, "");
  has([](AnyPairs& a) { a.pairs.N_r = 0; }, "sizes of the pairs");
  has([](AnyPairs& a) { a.pairs.N_r = 1; }, "");
  for (auto size : {&Coupling<double>::n_i, &Coupling<double>::n_phi, &Coupling<double>::rank}) {
    for (int n : {0, 999999}) has([=](AnyPairs& a) { a.pairs.*size = n; }, "sizes of the pairs");
  }
  has([](AnyPairs& a) { a.pairs.second.size = 1; }, "sizes of the pairs");
  has([](AnyPairs& a) { a.pairs.kind.size = 1; }, "sizes of the pairs");
  has([](AnyPairs& a) { a.pairs.behind.size = 3; }, "sizes of the pairs");
  has([](AnyPairs& a) { a.pairs.knot.size = 2; }, "sizes of the pairs");
  has([](AnyPairs& a) { a.pairs.first.size = 0; }, "");
  for (int n : {0, 1}) {
    has([=](AnyPairs& a) { a.first[n] = 3; }, "phases of the pairs");
    has([=](AnyPairs& a) { a.second[n] = 3; }, "phases of the pairs");
    has([=](AnyPairs& a) { a.second[n] = a.first[n]; }, "phases of the pairs");
    has([=](AnyPairs& a) { a.behind[n] = -1e-9; }, "angles of the pairs");
    has([=](AnyPairs& a) { a.behind[n] = turn; }, "angles of the pairs");
    has([=](AnyPairs& a) { a.behind[n] = std::nextafter(turn, 0.0); }, "");
    has([=](AnyPairs& a) { a.behind[n] = 0; }, "");
    has([=](AnyPairs& a) { a.kind[n] = 2; }, "functions of the pairs");
    has([=](AnyPairs& a) { a.knot[n + 1] = a.knot[n]; }, "currents of the pairs");
  }
  has([](AnyPairs& a) { a.pairs.f.size -= 1; }, "functions of the pairs");
  has([](AnyPairs& a) { a.pairs.C.size += 1; }, "tables of the pairs");
  has([](AnyPairs& a) { a.pairs.cells_per_rad = 0; }, "cells of the pairs");
  return worst;
}

/// Of one coefficient curve after the other, the least at any current of its pieces: the others
/// have 2 c_2 = 10 mH throughout.
double least_inductance() {
  constexpr int n_i = 3, n_theta = 4, n_curves = n_theta + 3, n_power = 5;
  const std::vector<double> knot{0, 2, 5};
  double worst = 0;
  for (int j = 0; j < n_i; ++j) {
    for (int m = 0; m < n_curves; ++m) {
      for (double bend : {-1e-4, 1e-4, 5e-4}) {
        std::vector<double> c(n_i * n_curves * n_power, 0.0);
        for (int n = 0; n < n_i * n_curves; ++n) c[n * n_power + 2] = 5e-3;
        double* curve = &c[(j * n_curves + m) * n_power];
        curve[2] = 1e-3;
        curve[3] = -2e-4;
        curve[4] = bend;
        const FluxMap<double> map{.N_r = 4,
                                  .n_i = n_i,
                                  .n_theta = n_theta,
                                  .n_slot = 1,
                                  .theta_span = turn / 2,
                                  .cells_per_rad = 2 * n_theta / turn,
                                  .slots_per_A = 1,
                                  .knot = {knot.data(), n_i},
                                  .piece = {},
                                  .coefficient = {c.data(), int(c.size())}};
        // The open last piece is a point. W_c'' = 2 c_2 + 6 c_3 u + 12 c_4 u^2.
        const double h = j == 0 ? 2 : j == 1 ? 3 : 0;
        const double end = 2e-3 + h * (6 * -2e-4 + 12 * bend * h);
        const double bound = std::fmin(std::fmin(2e-3, 2e-3 + h / 2 * 6 * -2e-4), end);
        worst = worst_of({worst, off(inductance_bound(map), bound)});
      }
    }
  }
  return worst;
}

}  // namespace

int main() {
  check("pairs of phases: what is wrong with them", faults_of_pairs(), 0);
  check("flux map: least incremental inductance", least_inductance(), 1e-15);
  return failures == 0 ? 0 : 1;
}
