// A table of equally spaced values, read by straight lines between them.
#pragma once

#include <array>
#include <cstddef>

#include "srm/base/real.hpp"

namespace srm {

/// value[0] at x = 0, the last value at x = 1; held outside, and at value[0] where x is NaN.
template <Real T, std::size_t n>
requires(n >= 2) constexpr T interpolate(const std::array<T, n>& value, T x) {
  constexpr int cells = static_cast<int>(n) - 1;
  const T s = clamp(x, T(0), T(1)) * T(cells);
  const int j = s < T(cells) ? static_cast<int>(s) : cells - 1;
  return value[j] + (s - static_cast<T>(j)) * (value[j + 1] - value[j]);
}

}  // namespace srm
