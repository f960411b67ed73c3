// The solution w of w + ln w = q, by which the equation of a diode with a series resistance is
// solved for the current: one table, whatever the diode.
//
// Cubic Hermite pieces with the exact slope w/(1 + w): continuous with its first derivative. The
// error of a piece is h^4/384 w'''', |w''''| < 0.13: below 1e-7.
// R. M. Corless, D. J. Jeffrey, "The Wright omega function", LNCS 2385, Springer 2002.
#pragma once

#include <array>
#include <cmath>

namespace srm {

struct WrightOmega {
  static constexpr double q_first = -24, q_last = 40;  // w(-24) = 4e-11
  static constexpr int cells_per_unit = 8;
  static constexpr int n = static_cast<int>(q_last - q_first) * cells_per_unit;

  struct Node {
    double w, slope;  // the slope over a cell
  };
  std::array<Node, n + 1> node;

  WrightOmega() : node() {
    for (int j = 0; j <= n; ++j) {
      const double w = solved(q_first + static_cast<double>(j) / cells_per_unit);
      node[static_cast<std::size_t>(j)] = {w, w / (1 + w) / cells_per_unit};
    }
  }

  /// w(q); below the table 0, above it the last value.
  double at(double q) const {
    const double x = (q - q_first) * cells_per_unit;
    if (!(x > 0)) return 0;
    if (x >= n) return node.back().w;
    const auto j = static_cast<std::size_t>(x);
    const double s = x - static_cast<double>(j);
    const Node &a = node[j], &b = node[j + 1];
    const double d = b.w - a.w;
    return a.w +
           s * (a.slope + s * (3 * d - 2 * a.slope - b.slope + s * (a.slope + b.slope - 2 * d)));
  }

 private:
  /// Newton's method on a convex function, in the variable that keeps w positive.
  static double solved(double q) {
    double w = q > 1 ? q - std::log(q) : std::exp(q < 0 ? q : q / 2 - 0.5);
    for (int trial = 0; trial < 50; ++trial) {
      const double change = w / (1 + w) * (q - w - std::log(w));
      w += change > -w / 2 ? change : -w / 2;
      if (std::fabs(change) <= 1e-15 * w) break;
    }
    return w;
  }
};

inline const WrightOmega wright_omega{};

}  // namespace srm
