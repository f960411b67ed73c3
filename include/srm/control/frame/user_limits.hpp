// Limits of torque and current that a person sets below what the control law was built for.
//
// The torque reference is cut. A current reference is cut. In a phase whose current is above the
// limit at the sample, a timer order freewheels instead of magnetizing until the next sample; the
// current passes the limit by what one sample of the full voltage can add, or two with a delay.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/frame/comparator.hpp"

namespace srm {

template <Real T>
struct UserLimits {
  T tau;  // either sign; `never`: none [N m]
  T i;    // of a phase; `never`: none [A]
  SRM_FIELDS(tau, i)

  constexpr T cut(T tau_ref) const {
    if (abs(tau_ref) <= tau) [[likely]]
      return tau_ref;
    return clamp(tau_ref, -tau, tau);
  }

  /// Then sets the thresholds of the comparators.
  template <int N>
  constexpr void apply(Command<T, N>& orders, const Measurement<T, N>& y,
                       Comparators comparators) const {
    for (int k = 0; k < N; ++k) {
      PhaseCommand<T>& order = orders[k];
      if (order.gate != Gate::timer) {
        if (order.i_ref > i) [[unlikely]]
          order.i_ref = i;
        set_thresholds(order, comparators);
      } else if (y.i[k] > i) {
        freewheel(order);
      }
    }
  }

 private:
  [[gnu::noinline, gnu::cold]] static constexpr void freewheel(PhaseCommand<T>& order) {
    for (Leg& leg : order.leg) leg = leg == Leg::magnetize ? Leg::freewheel : leg;
  }
};

}  // namespace srm
