// Turn-on angle, turn-off angle and current of motoring pulses over speed and torque.
//
// The values stand at the nodes of a grid and are bilinear between them; outside, those of the
// nearest edge hold. Rows and columns need not be equally spaced: the nodes lie where the pulses
// were tuned, and between small torques, where the current grows as their square root, closer.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/base/real.hpp"
#include "srm/base/view.hpp"
#include "srm/control/part/conduction.hpp"

namespace srm {

/// When a phase conducts, and the current that it then has [A].
template <Real T>
struct Pulse {
  Window<T> window;
  T i_ref;
};

/// Where a value lies on an axis: in a cell, at a part of it in 0..1.
template <Real T>
struct Place {
  int cell;
  T weight;
};

/// The place of x on an axis of at least two increasing values; its ends outside and for NaN.
template <Real T>
constexpr Place<T> place(const View<T>& axis, T x) {
  int j = 0;
  while (j < axis.size - 2 && x >= axis[j + 1]) ++j;
  return {j, clamp((x - axis[j]) / (axis[j + 1] - axis[j]), T(0), T(1))};
}

template <Real T>
struct PulseTable {
  View<T> omega;      // speeds, increasing [rad/s]; none: no table
  View<T> tau;        // torques, increasing from 0 [N m]
  View<T> theta_on;   // at speed j and torque k: [j * tau.size + k] [rad]
  View<T> theta_off;  // [rad]
  View<T> i_ref;      // [A]
  SRM_FIELDS(omega, tau, theta_on, theta_off, i_ref)

  constexpr bool is_there() const { return omega.size > 0; }

  /// The pulse at a speed >= 0 and a torque >= 0.
  constexpr Pulse<T> at(T omega_m, T torque) const {
    const Place<T> row = place(omega, omega_m), column = place(tau, torque);
    const auto value = [&](const View<T>& table) {
      const T* const low = table.data + row.cell * tau.size + column.cell;
      const T* const high = low + tau.size;
      const T slow = low[0] + column.weight * (low[1] - low[0]);
      const T fast = high[0] + column.weight * (high[1] - high[0]);
      return slow + row.weight * (fast - slow);
    };
    return {{value(theta_on), value(theta_off)}, value(i_ref)};
  }

  /// Whether the axes and the values fit together.
  constexpr bool is_consistent() const {
    const int size = omega.size * tau.size;
    return theta_on.size == size && theta_off.size == size && i_ref.size == size &&
           (size == 0 || (rises(omega) && rises(tau)));
  }

 private:
  static constexpr bool rises(const View<T>& axis) {
    for (int j = 1; j < axis.size; ++j)
      if (!(axis[j] > axis[j - 1])) return false;
    return axis.size >= 2;
  }
};

}  // namespace srm
