// The hysteresis comparator's rule: of the gate drive in simulation, of a fast software loop on
// boards without analog comparators, and of a controller that compares in its own samples.
#pragma once

#include "srm/control/interface/interface.hpp"

namespace srm {

/// Who compares currents with their bands: analog comparators at any instant, or the controller at
/// its samples. two_level: one comparator with hysteresis a phase, which knows no more than its
/// lower and its upper threshold.
enum class Comparators : std::int8_t { analog, sampled, two_level };

/// Computes the thresholds of an order for a comparator:
///
///   i_lower    below it the leg magnetizes
///   i_upper    above it the leg chops: freewheels, or demagnetizes where the order says so
///   i_runaway  above it the leg demagnetizes, for a reference that fell faster than freewheeling
///              can follow, ...
///   i_centre   ... and freewheels again below this
///
/// Between the thresholds the leg stays. Two-level comparators do not have the last two: the
/// run-away threshold is out of reach, and a leg that demagnetizes chops at once.
template <Real T>
constexpr void set_thresholds(PhaseCommand<T>& order, Comparators comparators) {
  const T band = min(order.i_band, order.i_ref / T(2));  // a reference in its band must start too
  const bool two_level = comparators == Comparators::two_level;
  order.i_lower = order.i_ref - band;
  order.i_centre = two_level ? never<T> : order.i_ref;
  order.i_upper = order.i_ref + band;
  order.i_runaway = two_level ? never<T> : order.i_ref + T(2) * band;
}

/// The leg for a current inside or outside the band; inside, the leg stays. NaN demagnetizes.
template <Real T>
constexpr Leg compared(const PhaseCommand<T>& order, Leg leg, T i) {
  if (!(order.i_ref > T(0))) return Leg::demagnetize;
  if (i < order.i_lower) return Leg::magnetize;
  if (!(i <= order.i_runaway)) return Leg::demagnetize;
  if (leg == Leg::demagnetize) return i > order.i_centre ? leg : order.chop;
  return i > order.i_upper ? order.chop : leg;
}

/// The same for an order of Gate::comparator or Gate::window in phase k of N, at the electrical
/// angle theta_e of phase 0.
template <int N, Real T>
constexpr Leg compared(const PhaseCommand<T>& order, Leg leg, T i, T theta_e, int k) {
  if (order.gate == Gate::off || order.gate == Gate::timer) return Leg::demagnetize;
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
