// Mean torque to phase current: the reference of every law with fixed conduction angles.
//
// The table is made offline, from the mean torque over an electrical period at constant
// current for the law's angles; it is then the inverse of that curve.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/base/interpolate.hpp"

namespace srm {

template <Real T>
struct MeanTorque {
  T tau_max;                // torque of the last entry [N m]
  std::array<T, 17> i_ref;  // currents for 0, tau_max/16, ... tau_max [A]
  SRM_FIELDS(tau_max, i_ref)

  /// Current for either sign of torque; none for none. Above tau_max the last entry holds.
  constexpr T current(T tau) const {
    if (!(abs(tau) > T(0))) return T(0);
    return interpolate(i_ref, abs(tau) / tau_max);
  }
};

/// The same current for every torque. A current that is never reached makes it single-pulse
/// operation.
template <Real T>
constexpr MeanTorque<T> constant_current(T i_ref) {
  MeanTorque<T> table{.tau_max = T(1), .i_ref = {}};
  for (T& i : table.i_ref) i = i_ref;
  return table;
}

}  // namespace srm
