// The search of the angle at which a current has a flux linkage, and the arcs that it leaves.
#include <cmath>

#include "coil.hpp"
#include "errors.hpp"
#include "srm/control/guard/angle_search.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr double pi_ = turn / 2;
constexpr Coil coil{.L = 6e-3, .part = 2.0 / 3};  // 2 mH to 10 mH

/// The angle at which a current has a flux linkage, between the ends of the search.
double searches() {
  double worst = 0;
  for (int turn_ = 0; turn_ < 2; ++turn_) {
    for (double angle = 0.02; angle < 3.13; angle += 0.1) {
      AngleSearch<double> s{.turn = turn_};
      const double psi = coil.at(5, angle).psi;
      s.begin(psi, 5, 0);
      worst = worst_of({worst, unless(!s.ends())});
      int steps = 0;
      while (!s.ends() && s.step(coil)) ++steps;
      worst = worst_of({worst, off(steps, 4), unless(s.found && s.low <= angle && s.high >= angle),
                        off(s.high - s.low, pi_ / 128)});
    }
    for (double psi : {0.009, 0.051}) {  // less and more than at any angle
      AngleSearch<double> s{.turn = turn_};
      s.begin(psi, 5, 0);
      while (!s.ends() && s.step(coil)) continue;
      const bool none = s.least() ? psi > 0.05 : psi < 0.01;
      worst = worst_of({worst, unless(s.found == !none)});
    }
  }
  return worst;
}

/// Of whole steps on a circle, those in the arc of a phase around unaligned or aligned.
double arcs() {
  double worst = 0;
  constexpr int n = 24, N = 3;
  int inside = 0;
  for (int turn_ = 0; turn_ < 2 * N; ++turn_) {
    for (double low = 0.1; low < 3; low += 0.37) {
      for (double shown : {0.0, 1.0, 5.0}) {
        AngleSearch<double> s{.theta_e = shown, .low = low, .high = low + 0.01, .turn = turn_};
        std::uint32_t offset = (1U << n) - 1, reversed = offset;
        const double error = 0.05;
        s.narrow<n, N>(offset, reversed, error);
        for (int j = 0; j < n; ++j) {
          const auto has = [&](double theta) {
            const double at = wrap(theta - turn_ / 2 * turn / N);
            const double past = std::fmin(at, turn - at);  // from unaligned
            const double reach = error + turn / n / 2;
            return s.least() ? past >= low - reach : past <= low + 0.01 + reach;
          };
          const bool a = has(shown + j * turn / n), b = has(j * turn / n - shown);
          worst = worst_of({worst, unless(a == ((offset >> j & 1) != 0)),
                            unless(b == ((reversed >> j & 1) != 0))});
          inside += a;
        }
      }
    }
  }
  return worst_of({worst, unless(inside > 100)});
}

}  // namespace

int main() {
  check("search of an angle", searches(), 1e-12);
  check("arcs of whole steps", arcs(), 0);
  return failures == 0 ? 0 : 1;
}
