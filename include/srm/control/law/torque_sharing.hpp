// Torque sharing with hysteresis: share, phase torque, phase current, comparator.
//
// Each phase's share of the torque goes through the machine's own torque map to a current reference
// for this sample, which the comparator follows. Sources: sharing.hpp.
//
// Flux is built up ahead of the share where the voltage is short (flux_lead.hpp), and removed past
// it, so the reference is at least the current of that flux. The torque that it makes outside of a
// share is left out of what is shared, and the phase of the greatest share gives what is then still
// missing. The mean is held by feedback (mean_hold.hpp). Braking, the comparator chops hard, for
// the EMF raises the current of a phase that freewheels.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/flux_lead.hpp"
#include "srm/control/part/mean_hold.hpp"
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
  struct State {
    MeanHold<T> mean;
  };

  M machine;
  T R;  // phase resistance [ohm]
  Sharing<T> sharing;
  FluxLead<T> lead;
  T i_max;                    // limit of a phase current [A]
  T i_band;                   // half width of the current band [A]
  T T_s;                      // control period [s]
  T t_ahead = T(0);           // from the sample to the instant that the reference is for [s]
  Leg chop = Leg::freewheel;  // freewheel: soft; demagnetize: hard
  SRM_FIELDS(machine, R, sharing, lead, i_max, i_band, T_s, t_ahead, chop)

  Command<T, N> step(State& x, const Measurement<T, N>& y, T tau_ref) const {
    const bool braking = brakes(y.omega_m, tau_ref);
    const T omega_e = static_cast<T>(machine.N_r) * y.omega_m;
    const T theta_e = wrap(y.theta_e + omega_e * t_ahead);
    std::array<T, N> theta, share, i_ref{};
    T given = T(0);
    int first = 0;
    for (int k = 0; k < N; ++k) {
      theta[k] = drive_angle<N>(theta_e, k, tau_ref);
      share[k] = sharing.template share<N>(theta[k]);
      if (share[k] > share[first]) first = k;
      if (!(y.i[k] > T(0))) continue;
      given = given + machine.at(y.i[k], drive_angle<N>(y.theta_e, k, tau_ref)).tau;
    }
    const T asked = x.mean.asked(abs(tau_ref), given, omega_e * T_s, braking);
    T left = asked;
    const auto order = [&](int k, T tau) {
      const T i_share = current_for_torque(machine, tau, theta[k], i_max);
      i_ref[k] = max(i_share, ahead(y, k, theta[k], asked, braking));
      // In its band a current is as good as at its reference; outside, the voltage is short.
      const T i = abs(y.i[k] - i_ref[k]) > T(2) * i_band ? y.i[k] : i_ref[k];
      if (i > T(0)) left = left - machine.at(i, theta[k]).tau;
    };
    for (int k = 0; k < N; ++k) {
      if (!(share[k] > T(0))) order(k, T(0));
    }
    const T shared =
        clamp(left, T(0), most_shared<T> * asked);  // what phases without a share leave
    left = shared;
    for (int k = 0; k < N; ++k) {
      if (k != first && share[k] > T(0)) order(k, share[k] * shared);
    }
    order(first, min(left, most_shared<T> * asked));
    const Leg above = braking ? Leg::demagnetize : chop;
    return per_phase<T, N>([&](int k) { return regulate(i_ref[k], i_band, above); });
  }

 private:
  /// The current of the flux that is to be there ahead of the share; 0 where none is.
  [[gnu::noinline]] T ahead(const Measurement<T, N>& y, int k, T theta, T asked,
                            bool braking) const {
    const T omega_e = static_cast<T>(machine.N_r) * abs(y.omega_m);
    const T slope = lead.slope(y.u_dc, asked, omega_e);
    const T psi = lead.flux(theta, asked, slope, braking);
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
