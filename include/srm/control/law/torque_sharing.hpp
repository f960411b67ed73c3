// Torque sharing with hysteresis: share, phase torque, phase current, comparator.
//
// Each phase's share of the torque goes through the machine's own torque map to a current reference
// for the middle of the sample, which the comparator follows. Sources: sharing.hpp.
//
// Where the voltage does not suffice for the shares (feasible.hpp), the current references are
// those of the reference profile (guide_currents.hpp), and feedback holds the mean torque. Braking,
// the comparator chops hard, for the EMF raises the current of a phase that freewheels.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/feasible.hpp"
#include "srm/control/part/guide_currents.hpp"
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
  using State = FollowedCurrents<T, N>;

  M machine;
  Sharing<T> sharing;
  Feasible<T> feasible;
  ReferenceProfile<T> guide;  // phase current where the shares are not feasible [A]
  T R;                        // phase resistance [ohm]
  T i_max;                    // limit of a phase current [A]
  T i_band;                   // half width of the current band [A]
  T T_s;                      // control period [s]
  T delay = T(0);             // samples from measurement to effect
  Leg chop = Leg::freewheel;  // freewheel: soft; demagnetize: hard
  SRM_FIELDS(machine, sharing, feasible, guide, R, i_max, i_band, T_s, delay, chop)

  Command<T, N> step(State& x, const Measurement<T, N>& y, T tau_ref) const {
    const T omega_e = static_cast<T>(machine.N_r) * y.omega_m;
    const bool braking = brakes(y.omega_m, tau_ref);
    const Leg above = braking ? Leg::demagnetize : chop;
    if (!feasible.at(abs(tau_ref), abs(omega_e), y.u_dc, braking)) {
      GuideCurrents<M, N>{machine, R, i_max, T_s, delay}.follow(x, guide, y, tau_ref);
      const T least = i_band / T(4);  // a smaller reference is off
      return per_phase<T, N>(
          [&](int k) { return regulate(x.i_ref[k] > least ? x.i_ref[k] : T(0), i_band, above); });
    }
    const T theta_e = wrap(y.theta_e + omega_e * T_s * (delay + T(0.5)));
    T shared = abs(tau_ref);
    if constexpr (has_pairs<M>) shared = max(shared - pair_torque(machine, y, tau_ref), T(0));
    return per_phase<T, N>([&](int k) {
      const T theta = drive_angle<N>(theta_e, k, tau_ref);
      const T tau_ph = sharing.template share<N>(theta) * shared;
      x.i_ref[k] = current_for_torque(machine, tau_ph, theta, i_max);
      x.i_before[k] = max(y.i[k], T(0));
      return regulate(x.i_ref[k], i_band, above);
    });
  }
};

}  // namespace srm
