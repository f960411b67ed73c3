// Holds the current of one phase at a reference by a PI controller and centre-aligned PWM; all
// other legs are off. One pulse a period at any current: a dead time is the same error at all.
#pragma once

#include "srm/control/frame/drawn_current.hpp"
#include "srm/control/frame/limited_pi.hpp"
#include "srm/control/part/modulator.hpp"

namespace srm {

/// All legs off but that of phase k, whose mean winding voltage is duty u_dc.
template <Real T, int N>
constexpr Command<T, N> drive_one(int k, T duty, T T_s) {
  Command<T, N> orders;
  for (PhaseCommand<T>& order : orders) order = hold<T>(Leg::demagnetize);
  orders[k] = modulate(duty, T_s);
  return orders;
}

template <Real T>
struct CurrentHold {
  LimitedPi<T> pi;  // [V/A]
  T duty_max;       // of the voltage [1]
  SRM_FIELDS(pi, duty_max)

  struct State {
    T integral{};  // [V]
    T u{};         // ordered, mean over the period [V]
  };

  /// The duty cycle for the next period, at least `least`: 0 freewheels at most.
  constexpr T step(State& x, T i_ref, T i, T u_dc, T least) const {
    x.u = pi.step(x.integral, i_ref - i, least * u_dc, duty_max * u_dc);
    return x.u / u_dc;
  }
};

}  // namespace srm
