// The resistance routine of commissioning: from which samples it takes its means, and when a
// current is not what was asked for.
#include <cmath>

#include "errors.hpp"
#include "srm/control/commission/resistance.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr int N = 3;
constexpr double T_s = 1e-3;
constexpr Resistance<double> routine{.hold = {.pi = {.K_p = 2, .K_iT = 0.5}, .duty_max = 0.5},
                                     .i_1 = 4,
                                     .i_2 = 8,
                                     .n_settle = 5,
                                     .n_mean = 4};

/// Readings that wander about part of the reference, and the voltages ordered at them.
struct Bench {
  std::array<double, 2> part{1, 1};  // of each level
  Resistance<double>::State<N> x{};
  std::array<double, N> R{};
  int samples = 0, wrong = 0;

  Finding run() {
    double u[2]{}, i[2]{};
    while (x.finding == Finding::running && samples < 200) {
      const int in_level = samples % 9, level = samples / 9 % 2, k = samples / 18;
      wrong += x.k != k || x.level != level || x.progress() != (2 * k + level) / 6.0;
      Measurement<double, N> y{.u_dc = 100};
      y.i = {20, 20, 20};  // of the others
      y.i[k] = part[level] * (level == 0 ? 4 : 8) + 0.1 * std::sin(3 * samples + k);
      if (in_level < 2) y.i[k] -= 3;  // it rises
      const double before = x.current.integral;
      const Command<double, N> orders = routine.step(x, y, T_s);
      for (int j = 0; j < N; ++j) {
        wrong += j != k && orders[j].leg[0] != Leg::demagnetize;
      }
      const double error = (level == 0 ? 4 : 8) - y.i[k];
      const double ordered = std::fmin(std::fmax(before + 2 * error, 0), 50);
      if (in_level > 4) {  // the first five settle
        u[level] += ordered / 4;
        i[level] += y.i[k] / 4;
      }
      ++samples;
      if (samples % 18 == 0) {
        R[k] = (u[1] - u[0]) / (i[1] - i[0]);
        u[0] = u[1] = i[0] = i[1] = 0;
      }
    }
    return x.finding;
  }
};

/// Of each phase by two levels of nine samples, of which the last four count.
double means() {
  Bench b;
  double worst = unless(b.run() == Finding::done && b.samples == 54 && b.wrong == 0);
  for (int k = 0; k < N; ++k) {
    worst = worst_of({worst, off(b.x.R[k], b.R[k]), unless(b.R[k] > 0.5)});
  }
  return worst;
}

/// A mean that is off its reference by more than a quarter of it.
double no_current() {
  double worst = 0;
  for (int level : {0, 1}) {
    for (double part : {0.73, 0.77, 1.23, 1.27}) {
      Bench b;
      b.part[level] = part;
      const bool far = std::fabs(part - 1) > 0.25;
      worst += unless(b.run() == (far ? Finding::no_current : Finding::done));
      worst += unless(b.samples == (far ? 9 * (level + 1) : 54));
    }
  }
  return worst;
}

}  // namespace

int main() {
  check("means of two levels", means(), 1e-9);
  check("a current far from its reference", no_current(), 0);
  return failures == 0 ? 0 : 1;
}
