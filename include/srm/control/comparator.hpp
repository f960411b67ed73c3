// The comparator's rule in software, for boards without analog comparators: called in a fast loop.
#pragma once

#include "srm/control/interface.hpp"

namespace srm {

/// The leg that an order of Gate::comparator or Gate::window asks for in phase k, given the leg as
/// it is. Below the band the leg magnetizes, above it it chops. Past twice the band it demagnetizes
/// until the current is back at the reference: freewheeling cannot follow a fast fall.
template <int N, Real T>
constexpr Leg compared(const PhaseCommand<T>& order, Leg leg, T i, T theta_e, int k) {
  if (order.gate == Gate::timer || !(order.i_ref > T(0))) return Leg::demagnetize;
  if (order.gate == Gate::window &&
      !conducts(phase_angle<N>(theta_e, k), order.theta_on, order.theta_off)) {
    return Leg::demagnetize;
  }
  const T band = min(order.i_band, order.i_ref / T(2));
  if (i < order.i_ref - band) return Leg::magnetize;
  if (!(i <= order.i_ref + T(2) * band)) return Leg::demagnetize;  // NaN too
  if (leg == Leg::demagnetize) return i > order.i_ref ? leg : order.chop;
  return i > order.i_ref + band ? order.chop : leg;
}

}  // namespace srm
