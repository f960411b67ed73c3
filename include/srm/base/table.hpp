// A table over a quantity and an electrical angle, linear between its points.
#pragma once

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"
#include "srm/base/view.hpp"

namespace srm {

/// The table at one level: between two rows.
template <Real T>
struct AngleRow {
  const T* values;  // of the lower row; the upper one lies behind it
  int columns;
  T weight;  // of the upper row [1]

  /// theta_e in [0, 2 pi).
  T at(T theta_e) const {
    const T x = theta_e * (static_cast<T>(columns) / two_pi<T>);
    int left = static_cast<int>(x);
    if (left >= columns) left = columns - 1;  // rounding may reach the edge
    const int right = left + 1 < columns ? left + 1 : 0;
    const T wx = x - static_cast<T>(left);
    const T* upper = values + columns;
    const T below = values[left] + wx * (values[right] - values[left]);
    const T above = upper[left] + wx * (upper[right] - upper[left]);
    return below + weight * (above - below);
  }
};

/// values[row * columns + column]: row j of n holds the level level_max (j/(n - 1))^2, columns are
/// angles 0..2 pi in equal steps without the last, which is the first again. Squared levels suit
/// currents over torque, which grows as i^2 before saturation. The table does not own its
/// memory: constants in flash on the target, a buffer of the caller on the desk.
template <Real T>
struct AngleTable {
  View<T> values;
  int rows = 0;  // at least 2
  int columns = 0;
  T level_max{};
  SRM_FIELDS(values, rows, columns, level_max)

  /// Levels outside 0..level_max give the nearest row.
  AngleRow<T> at(T level) const {
    const T y = sqrt(clamp(level / level_max, T(0), T(1))) * static_cast<T>(rows - 1);
    const int row = y < static_cast<T>(rows - 2) ? static_cast<int>(y) : rows - 2;
    return {values.data + row * columns, columns, y - static_cast<T>(row)};
  }
};

}  // namespace srm
