// Torque sharing with hysteresis: share, phase torque, phase current, comparator.
//
// Each phase's share of the torque goes through the machine's own torque map to a current reference
// for this sample, which the comparator follows. Sources: sharing.hpp.
//
// Braking, and where the voltage is short, flux is built up ahead of the share (flux_lead.hpp) and
// removed past it, so the reference is at least the current of that flux. The torque that it makes
// outside of a share is left out of what is shared, and the phase of the greatest share gives what
// is then still missing. Where the voltage is short the mean is held by feedback (mean_hold.hpp).
// Braking, the comparator chops hard, for the EMF raises the current of a phase that freewheels.
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
  Sharing<T> sharing;
  FluxLead<T> lead;
  T i_max;                    // limit of a phase current [A]
  T i_band;                   // half width of the current band [A]
  T T_s;                      // control period [s]
  T t_ahead = T(0);           // from the sample to the instant that the reference is for [s]
  Leg chop = Leg::freewheel;  // freewheel: soft; demagnetize: hard
  SRM_FIELDS(machine, sharing, lead, i_max, i_band, T_s, t_ahead, chop)

  Command<T, N> step(State& x, const Measurement<T, N>& y, T tau_ref) const {
    const bool braking = brakes(y.omega_m, tau_ref);
    const T omega_e = static_cast<T>(machine.N_r) * y.omega_m;
    const T theta_e = wrap(y.theta_e + omega_e * t_ahead);
    const bool is_short = lead.is_short(y.u_dc, abs(tau_ref), abs(omega_e), braking);
    if (braking || is_short) {
      const T asked = is_short ? held(x, y, tau_ref) : abs(tau_ref);
      return ahead(y, theta_e, tau_ref, asked);
    }
    return per_phase<T, N>([&](int k) {
      const T theta = drive_angle<N>(theta_e, k, tau_ref);
      const T tau_ph = sharing.template share<N>(theta) * abs(tau_ref);
      return regulate(current_for_torque(machine, tau_ph, theta, i_max), i_band, chop);
    });
  }

 private:
  /// The torque to ask for, so that what the currents give has the mean of the reference.
  T held(State& x, const Measurement<T, N>& y, T tau_ref) const {
    const T given = torque_of_currents(machine, y, tau_ref);
    const T turn = static_cast<T>(machine.N_r) * y.omega_m * T_s;
    return x.mean.asked(abs(tau_ref), given, turn, brakes(y.omega_m, tau_ref));
  }

  /// Orders with flux ahead of the shares of a torque.
  [[gnu::noinline, gnu::cold]] Command<T, N> ahead(const Measurement<T, N>& y, T theta_e, T tau_ref,
                                                   T asked) const {
    const bool braking = brakes(y.omega_m, tau_ref);
    std::array<T, N> theta, share, i_ref;
    for (int k = 0; k < N; ++k) {
      theta[k] = drive_angle<N>(theta_e, k, tau_ref);
      share[k] = sharing.template share<N>(theta[k]);
    }
    const T omega_e = static_cast<T>(machine.N_r) * abs(y.omega_m);
    const LeadLine<T> line = lead.line(y.u_dc, asked, omega_e, braking);
    share_out<N>(share, asked,
                 [&](int k, T tau) { return order(i_ref[k], y, k, tau, theta[k], line); });
    const Leg above = braking ? Leg::demagnetize : chop;
    return per_phase<T, N>([&](int k) { return regulate(i_ref[k], i_band, above); });
  }

  /// Orders the current for a torque of a phase, or of the flux that more of it will need, and
  /// returns the torque that the phase then gives, in the frame of positive torque.
  [[gnu::noinline, gnu::cold]] T order(T& i_ref, const Measurement<T, N>& y, int k, T tau, T theta,
                                       const LeadLine<T>& line) const {
    i_ref = current_for_torque(machine, tau, theta, i_max);
    const T psi = line.flux(theta);
    if (psi > T(0)) {
      T i = max(y.i[k], T(0));
      for (int steps = 0; steps < 2; ++steps) {
        const Magnetics<T> here = machine.at(i, theta);
        i = clamp(i + (psi - here.psi) / here.L_inc, T(0), i_max);
      }
      i_ref = max(i_ref, i);
    }
    // In its band a current is as good as at its reference; outside, the voltage is short.
    const T i = abs(y.i[k] - i_ref) > T(2) * i_band ? y.i[k] : i_ref;
    return i > T(0) ? machine.at(i, theta).tau : T(0);
  }
};

}  // namespace srm
