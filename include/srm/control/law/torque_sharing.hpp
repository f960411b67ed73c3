// Torque sharing with hysteresis: share, phase torque, phase current, comparator.
//
// Each phase's share of the torque goes through the machine's own torque map to a current reference
// for this sample, which the comparator follows. Sources: sharing.hpp.
//
// Braking, the reference is at least the current of a flux that is built up ahead of the share
// (flux_lead.hpp), the phase of the greatest share gives what the torques of the others leave, and
// the comparator chops hard, for the EMF raises the current of a phase that freewheels.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/flux_lead.hpp"
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
  T R;  // phase resistance [ohm]
  Sharing<T> sharing;
  FluxLead<T> lead;
  T i_max;                    // limit of a phase current [A]
  T i_band;                   // half width of the current band [A]
  T t_ahead = T(0);           // from the sample to the instant that the reference is for [s]
  Leg chop = Leg::freewheel;  // freewheel: soft; demagnetize: hard
  SRM_FIELDS(machine, R, sharing, lead, i_max, i_band, t_ahead, chop)

  Command<T, N> step(State&, const Measurement<T, N>& y, T tau_ref) const {
    const T theta_e = wrap(y.theta_e + static_cast<T>(machine.N_r) * y.omega_m * t_ahead);
    if (brakes(y.omega_m, tau_ref)) return brake(y, theta_e, tau_ref);
    return per_phase<T, N>([&](int k) {
      const T theta = drive_angle<N>(theta_e, k, tau_ref);
      const T tau_ph = sharing.template share<N>(theta) * abs(tau_ref);
      return regulate(current_for_torque(machine, tau_ph, theta, i_max), i_band, chop);
    });
  }

 private:
  [[gnu::noinline]] Command<T, N> brake(const Measurement<T, N>& y, T theta_e, T tau_ref) const {
    std::array<T, N> theta, tau;
    int first = 0;
    for (int k = 0; k < N; ++k) {
      theta[k] = drive_angle<N>(theta_e, k, tau_ref);
      tau[k] = sharing.template share<N>(theta[k]) * abs(tau_ref);
      if (tau[k] > tau[first]) first = k;
    }
    T left = abs(tau_ref);
    for (int k = 0; k < N; ++k) {
      if (k != first && y.i[k] > T(0)) left = left - machine.at(y.i[k], theta[k]).tau;
    }
    tau[first] = max(left, T(0));
    return per_phase<T, N>([&](int k) {
      const T i_share = current_for_torque(machine, tau[k], theta[k], i_max);
      return regulate(max(i_share, ahead(y, k, theta[k], abs(tau_ref))), i_band, Leg::demagnetize);
    });
  }

  /// The current of the flux that is to be there ahead of the share; 0 where none is.
  [[gnu::noinline]] T ahead(const Measurement<T, N>& y, int k, T theta, T tau_all) const {
    const T omega_e = static_cast<T>(machine.N_r) * abs(y.omega_m);
    const T slope = (T(0.97) * y.u_dc - R * max(y.i[k], T(0))) / omega_e;  // a reserve of 3 %
    const T psi = lead.flux(theta, tau_all, slope);
    if (!(psi > T(0))) return T(0);
    T i = max(y.i[k], T(0));
    for (int steps = 0; steps < 2; ++steps) {
      const Magnetics<T> here = machine.at(i, theta);
      i = clamp(i + (psi - here.psi) / here.L_inc, T(0), i_max);
    }
    return i;
  }
};

}  // namespace srm
