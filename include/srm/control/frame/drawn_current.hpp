// The mean current that the bridge draws from the dc link over a sample, from the phase currents
// and the orders: what replaces a current sensor on the source.
#pragma once

#include <array>

#include "srm/base/fields.hpp"
#include "srm/control/interface/interface.hpp"

namespace srm {

/// Mean level of a leg over a sample, -1 to 1. Orders for a comparator have none.
template <Real T>
constexpr T mean_level(const PhaseCommand<T>& c, T T_s) {
  if (c.gate != Gate::timer) return T(0);
  T since = T(0), sum = T(0);
  for (int n = 0; n <= max_edges; ++n) {
    const T until = n < max_edges ? min(c.t_edge[n], T_s) : T_s;
    sum = sum + static_cast<T>(static_cast<int>(c.leg[n])) * (until - since);
    since = until;
    if (!(since < T_s)) break;
  }
  return sum / T_s;
}

template <Real T, int N>
struct DrawnCurrent {
  std::array<T, N> i{};              // of the last sample [A]
  std::array<T, N> level{}, next{};  // of the last sample, and of the one after it

  /// Mean over the last sample, by the trapezoid of the currents [A].
  constexpr T mean(const Measurement<T, N>& y) const {
    T sum = T(0);
    for (int k = 0; k < N; ++k) sum = sum + level[k] * (i[k] + y.i[k]);
    return sum / T(2);
  }

  /// delay: samples from the orders to their effect, 0 or 1.
  constexpr void remember(const Measurement<T, N>& y, const Command<T, N>& orders, T T_s,
                          int delay) {
    i = y.i;
    for (int k = 0; k < N; ++k) {
      const T ordered = mean_level(orders[k], T_s);
      level[k] = delay > 0 ? next[k] : ordered;
      next[k] = ordered;
    }
  }
};

}  // namespace srm
