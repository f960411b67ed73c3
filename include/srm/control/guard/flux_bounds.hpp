// Between which bounds the flux linkage of a phase must be, from the voltage that was ordered, and
// whether the current reading agrees: an interval observer of a phase.
//
// Over a sample the flux linkage changes by (u - R i) T_s. A timer order fixes the mean voltage; an
// order for a comparator fixes it where the reading stays below the lower threshold (the leg
// magnetizes throughout) or above the run-away one (it demagnetizes). Otherwise it is between
// -u_dc and u_dc. `u_margin` of the dc link covers devices, dead time, and the error of its sensor.
//
// A reading i, wrong by i_error at most, means a flux linkage between psi(i) (1 - e) and psi(i) (1
// + e) with e = model_error + i_error/i: psi is concave in i and zero at zero, so that psi(i -
// i_error) >= psi(i) (1 - i_error/i), and the same above. Both intervals hold for a healthy phase;
// where they have no common point, sensor and voltage contradict each other.
#pragma once

#include "srm/control/frame/comparator.hpp"
#include "srm/control/frame/drawn_current.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

/// The mean leg level over a sample is at least `least` while the reading is below `below` at both
/// its ends, and at most `most` while it is above `above`.
template <Real T>
struct Expected {
  T least{-1}, most{1}, below{}, above{};
};

/// What an order makes of a phase that is at theta_e, give or take angle_error, and travels `ahead`
/// until it ends [rad]. An edge that may come within this time leaves the level open.
template <Real T>
constexpr Expected<T> expected(const PhaseCommand<T>& c, T theta_e, T ahead, T angle_error,
                               T i_error, T T_s) {
  constexpr T always = T(1e30);
  if (c.gate == Gate::timer) {
    const T level = mean_level(c, T_s);
    return {level, level, always, -always};
  }
  if (c.gate == Gate::off || !(c.i_ref > T(0))) return {T(-1), T(-1), always, -always};
  const Expected<T> held{T(1), T(-1), c.i_lower - i_error, c.i_runaway + i_error};
  if (c.gate == Gate::comparator) return held;
  const auto one_turn = [](T theta) { return theta < T(0) ? theta + two_pi<T> : theta; };
  const T past = one_turn(theta_e - c.theta_on), dwell = one_turn(c.theta_off - c.theta_on);
  const T first = past + min(ahead, T(0)) - angle_error;
  const T last = past + max(ahead, T(0)) + angle_error;
  if (first >= T(0) && last < dwell) return held;
  if (first >= dwell && last < two_pi<T>) {
    return {T(-1), T(-1), always, -always};
  }
  return {T(-1), T(1), -always, always};
}

template <Real T>
struct FluxBounds {
  T R;            // phase resistance [ohm]
  T T_s;          // control period [s]
  T i_error;      // greatest error of a reading [A]
  T model_error;  // of the flux linkage at a current and an angle [1]
  T u_margin;     // of the mean voltage, over u_dc [1]
  SRM_FIELDS(R, T_s, i_error, model_error, u_margin)

  struct State {
    T least{}, most{never<T>};  // flux linkage at the last sample [Wb]
  };

  /// Moves the bounds over a sample with currents i0 at its start and i1 at its end.
  constexpr void advance(State& x, const Expected<T>& order, T i0, T i1, T u_dc) const {
    const T least = max(i0, i1) < order.below ? order.least : T(-1);
    const T most = min(i0, i1) > order.above ? order.most : T(1);
    const T volt_seconds = T_s * u_dc;
    const T drop = T_s * R * max(max(i0, i1), T(0));
    x.least = max(x.least + (least - u_margin) * volt_seconds - drop, T(0));
    // Past zero current the voltage can only build up again.
    const T again = most > T(-1) ? (T(1) + u_margin) * volt_seconds : T(0);
    x.most = max(x.most + (most + u_margin) * volt_seconds, again);
  }

  /// Narrows the bounds by what a reading above zero means: 0 if they agree, -1 where the reading
  /// is too low, 1 where it is too high. psi: of the model at the reading [Wb].
  constexpr int narrow(State& x, T i, T psi) const {
    const T part = model_error + i_error / i;
    const T low = psi * (T(1) - part), high = psi * (T(1) + part);
    if (x.least > high) return -1;
    if (x.most < low) return 1;
    x.least = max(x.least, low);
    x.most = min(x.most, high);
    return 0;
  }
};

}  // namespace srm
