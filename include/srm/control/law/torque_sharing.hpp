// Torque sharing with hysteresis: share, phase torque, phase current, comparator.
//
// Each phase's share of the torque goes through the machine's own torque map to a current reference
// for this sample, which the comparator follows. Sources: sharing.hpp.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/mirror.hpp"
#include "srm/control/part/per_phase.hpp"
#include "srm/control/part/sharing.hpp"
#include "srm/machine/torque_inverse.hpp"

namespace srm {

template <Machine M, int N>
struct TorqueSharing {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  static constexpr int n_phases = N;
  struct State {};

  M machine;
  Sharing<T> sharing;
  T i_max;                    // limit of a phase current [A]
  T i_band;                   // half width of the current band [A]
  T t_ahead = T(0);           // from the sample to the instant that the reference is for [s]
  Leg chop = Leg::freewheel;  // freewheel: soft; demagnetize: hard
  SRM_FIELDS(machine, sharing, i_max, i_band, t_ahead, chop)

  Command<T, N> step(State&, const Measurement<T, N>& y, T tau_ref) const {
    const T theta_e = wrap(y.theta_e + static_cast<T>(machine.N_r) * y.omega_m * t_ahead);
    return per_phase<T, N>([&](int k) {
      const T theta = drive_angle<N>(theta_e, k, tau_ref);
      const T tau_ph = sharing.template share<N>(theta) * abs(tau_ref);
      return regulate(current_for_torque(machine, tau_ph, theta, i_max), i_band, chop);
    });
  }
};

}  // namespace srm
