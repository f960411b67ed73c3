// The hysteresis comparator's rule: of the gate drive in simulation, of a fast software loop on
// boards without analog comparators, and of a controller that compares in its own samples.
#pragma once

#include "srm/control/frame/interface.hpp"

namespace srm {

/// The comparator's thresholds [A]. Above `upper` the leg chops; with soft chopping a current that
/// still runs away past `runaway` (the reference fell faster than freewheeling can follow) is
/// driven down by the full voltage until it is back at the reference.
template <Real T>
struct Thresholds {
  T lower, centre, upper, runaway;
};

template <Real T>
constexpr Thresholds<T> thresholds(const PhaseCommand<T>& order) {
  const T band = min(order.i_band, order.i_ref / T(2));  // a reference in its band must start too
  return {order.i_ref - band, order.i_ref, order.i_ref + band, order.i_ref + T(2) * band};
}

/// The leg for a current inside or outside the band; inside, the leg stays. NaN demagnetizes.
template <Real T>
constexpr Leg compared(const PhaseCommand<T>& order, Leg leg, T i) {
  if (!(order.i_ref > T(0))) return Leg::demagnetize;
  const Thresholds<T> at = thresholds(order);
  if (i < at.lower) return Leg::magnetize;
  if (!(i <= at.runaway)) return Leg::demagnetize;
  if (leg == Leg::demagnetize) return i > at.centre ? leg : order.chop;
  return i > at.upper ? order.chop : leg;
}

/// The same for an order of Gate::comparator or Gate::window in phase k of N, at the electrical
/// angle theta_e of phase 0.
template <int N, Real T>
constexpr Leg compared(const PhaseCommand<T>& order, Leg leg, T i, T theta_e, int k) {
  if (order.gate == Gate::timer) return Leg::demagnetize;
  if (order.gate == Gate::window &&
      !conducts(phase_angle<N>(theta_e, k), order.theta_on, order.theta_off)) {
    return Leg::demagnetize;
  }
  return compared(order, leg, i);
}

/// The legs of a controller that has ordered nothing yet.
template <int N>
constexpr std::array<Leg, N> all_demagnetized() {
  std::array<Leg, N> legs;
  legs.fill(Leg::demagnetize);
  return legs;
}

/// Turns orders that need a comparator into ones that do not: the leg that it would choose for the
/// currents of this sample, held until the next. The reference stays, for the record. leg: ordered
/// before, and now.
template <Real T, int N>
void compare_now(Command<T, N>& orders, const Measurement<T, N>& y, std::array<Leg, N>& leg) {
  for (int k = 0; k < N; ++k) {
    if (orders[k].gate != Gate::timer) {
      const T i_ref = orders[k].i_ref;
      orders[k] = hold<T>(compared<N>(orders[k], leg[k], y.i[k], y.theta_e, k));
      orders[k].i_ref = i_ref;
    }
    leg[k] = orders[k].leg.back();
  }
}

}  // namespace srm
