// Mean torque to phase current: the reference of every law with fixed conduction angles.
//
// The tables, one for motoring and one for braking, are made offline, from the mean torque over an
// electrical period at constant current for the law's angles; each is the inverse of that curve.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/base/interpolate.hpp"

namespace srm {

template <Real T>
struct MeanTorque {
  T tau_max;                  // torque of the last entry [N m]
  std::array<T, 17> i_ref;    // motoring: currents for 0, tau_max/16, ... tau_max [A]
  std::array<T, 17> i_brake;  // braking [A]
  SRM_FIELDS(tau_max, i_ref, i_brake)

  /// Current for either sign of torque; none for none. Above tau_max the last entry holds.
  constexpr T current(T tau, bool braking) const {
    if (!(abs(tau) > T(0))) return T(0);
    return interpolate(braking ? i_brake : i_ref, abs(tau) / tau_max);
  }
};

/// The same current for every torque. A current that is never reached makes it single-pulse
/// operation.
template <Real T>
constexpr MeanTorque<T> constant_current(T i_ref) {
  MeanTorque<T> table{.tau_max = T(1), .i_ref = {}, .i_brake = {}};
  table.i_ref.fill(i_ref);
  table.i_brake = table.i_ref;
  return table;
}

}  // namespace srm
