// A centrifugal pump that lifts water through a pipe: torque over speed from a table, static head
// over time.
//
// Below omega_0 = sqrt(omega2_per_m H) the shut-off head does not reach the static head H, the
// check valve is closed and the torque is k_shut omega^2. Above it the flow starts with a vertical
// tangent over speed, but is nearly straight over s = sqrt(omega^2 - omega_0^2): torque is
// tabulated over s, as cubic Hermite pieces, and linear between the rows of static heads.
#pragma once

#include <cmath>
#include <vector>

#include "srm/base/fields.hpp"
#include "srm/plant/course.hpp"

namespace srm {

struct Pump {
  Course H_static = constant(0);  // from the water level to the outlet [m]
  double H_dry{};                 // from here on the level is below the intake [m]
  double k_dry{};                 // torque k_dry omega^2 then [N m s^2]
  double k_shut{};                // with water and without flow [N m s^2]
  double omega2_per_m{};          // [rad^2/s^2/m]
  double H_first{}, H_step = 1;   // rows [m]
  double s_step = 1;              // columns [rad/s]
  std::vector<double> tau{};      // (rows, columns) [N m]; empty: no pump
  std::vector<double> rise{};     // slope over a column, as many [N m]
  int columns{};
  SRM_FIELDS(H_static, H_dry, k_dry, k_shut, omega2_per_m, H_first, H_step, s_step, tau, rise,
             columns)

  /// Torque against the rotation at speed omega_m [N m].
  double torque(double omega_m, Moment m) const {
    if (tau.empty()) return 0;
    const double square = omega_m * std::fabs(omega_m);
    const double H = H_static.at(m);
    if (H_static.at(m.start) >= H_dry) return k_dry * square;
    const double s2 = square - omega2_per_m * H;
    if (s2 <= 0) return k_shut * square;
    const double x = std::sqrt(s2) / s_step;
    const int rows = static_cast<int>(tau.size()) / columns;
    if (rows == 1) return in_row(0, x);
    const double y = (H - H_first) / H_step;
    const int row = y <= 0 ? 0 : y >= rows - 1 ? rows - 2 : static_cast<int>(y);
    const double low = in_row(row, x);
    return low + (y - row) * (in_row(row + 1, x) - low);
  }

 private:
  /// Straight on past the last column.
  double in_row(int row, double x) const {
    const int j = x < columns - 2 ? static_cast<int>(x) : columns - 2;
    const auto cell = static_cast<std::size_t>(row * columns + j);
    const double s = x - j, d = tau[cell + 1] - tau[cell], a = rise[cell], b = rise[cell + 1];
    if (s > 1) return tau[cell + 1] + (s - 1) * b;
    return tau[cell] + s * (a + s * (3 * d - 2 * a - b + s * (a + b - 2 * d)));
  }
};

}  // namespace srm
