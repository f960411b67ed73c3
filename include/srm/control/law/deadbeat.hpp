// Deadbeat flux control: the duty cycle that brings each phase to its reference in one sample.
//
// psi(t + T_s) = psi(t) + T_s (duty u_dc - R i), so duty = ((psi_ref - psi)/T_s + R i)/u_dc, with
// psi_ref the machine's flux at the shared torque and at the angle that the sample ends at. With
// one sample of delay psi is first carried through the sample that is under way, whose duty is
// known.
//
// Braking, and where the voltage is short, flux is built up ahead of the share (flux_lead.hpp) and
// removed past it. The torque that this makes outside of a share is left out of what is shared, and
// the phase of the greatest share gives what is then still missing. Where the voltage is short the
// mean is held by feedback (mean_hold.hpp).
//
// R. Mikail, I. Husain, Y. Sozer, M. S. Islam, T. Sebastian, "A fixed switching frequency
// predictive current control method for switched reluctance machines", IEEE Trans. Ind. Appl.
// 50(6), 2014; sharing: sharing.hpp.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/flux_lead.hpp"
#include "srm/control/part/mean_hold.hpp"
#include "srm/control/part/mirror.hpp"
#include "srm/control/part/modulator.hpp"
#include "srm/control/part/per_phase.hpp"
#include "srm/control/part/sharing.hpp"
#include "srm/machine/torque_inverse.hpp"

namespace srm {

template <Machine M, int N>
struct Deadbeat {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  static constexpr int n_phases = N;
  struct State {
    std::array<T, N> duty{};  // ordered in the sample before
    MeanHold<T> mean;
  };

  M machine;
  T R;  // phase resistance [ohm]
  Sharing<T> sharing;
  FluxLead<T> lead;
  T i_max;        // [A]
  T T_s;          // control and carrier period [s]
  int delay = 0;  // samples from measurement to effect: 0 or 1
  Carriers carriers = Carriers::in_phase;
  SRM_FIELDS(machine, R, sharing, lead, i_max, T_s, delay, carriers)

  Command<T, N> step(State& x, const Measurement<T, N>& y, T tau_ref) const {
    const bool braking = brakes(y.omega_m, tau_ref);
    const T omega_e = static_cast<T>(machine.N_r) * y.omega_m;
    const T theta_end = wrap(y.theta_e + omega_e * T_s * static_cast<T>(1 + delay));
    const bool is_short = lead.is_short(y.u_dc, abs(tau_ref), abs(omega_e), braking);
    if (braking || is_short) {
      const T asked = is_short ? held(x, y, tau_ref) : abs(tau_ref);
      order_ahead(x, y, theta_end, tau_ref, asked);
    } else {
      for (int k = 0; k < N; ++k) {
        const T theta = drive_angle<N>(theta_end, k, tau_ref);
        const T tau = sharing.template share<N>(theta) * abs(tau_ref);
        const T i_ref = current_for_torque(machine, tau, theta, i_max);
        const T i = max(y.i[k], T(0));
        x.duty[k] = i_ref > T(0)
                        ? duty(x.duty[k], y, k, machine.at(i_ref, theta).psi, (i + i_ref) / T(2))
                        : T(-1);
      }
    }
    return per_phase<T, N>(
        [&](int k) { return modulate(x.duty[k], T_s, pulse_centre<N, T>(carriers, k)); });
  }

 private:
  /// Flux of phase k when the orders of this sample begin to act; last: the duty before them.
  [[gnu::noinline]] T flux(T last, const Measurement<T, N>& y, int k) const {
    const T i = max(y.i[k], T(0));
    const T psi = machine.at(i, phase_angle<N>(y.theta_e, k)).psi;
    return delay > 0 ? max(psi + T_s * (last * y.u_dc - R * i), T(0)) : psi;
  }

  T duty(T last, const Measurement<T, N>& y, int k, T psi_ref, T i_mean) const {
    const T u = (psi_ref - flux(last, y, k)) / T_s + R * i_mean;
    return clamp(u / y.u_dc, T(-1), T(1));
  }

  /// The torque to ask for, so that what the currents give has the mean of the reference.
  T held(State& x, const Measurement<T, N>& y, T tau_ref) const {
    const T given = torque_of_currents(machine, y, tau_ref);
    const T turn = static_cast<T>(machine.N_r) * y.omega_m * T_s;
    return x.mean.asked(abs(tau_ref), given, turn, brakes(y.omega_m, tau_ref));
  }

  /// Duty cycles with flux ahead of the shares of a torque.
  [[gnu::noinline, gnu::cold]] void order_ahead(State& x, const Measurement<T, N>& y, T theta_end,
                                                T tau_ref, T asked) const {
    std::array<T, N> theta, share;
    for (int k = 0; k < N; ++k) {
      theta[k] = drive_angle<N>(theta_end, k, tau_ref);
      share[k] = sharing.template share<N>(theta[k]);
    }
    const T omega_e = static_cast<T>(machine.N_r) * abs(y.omega_m);
    const LeadLine<T> line = lead.line(y.u_dc, asked, omega_e, brakes(y.omega_m, tau_ref));
    share_out<N>(share, asked,
                 [&](int k, T tau) { return towards(x.duty[k], y, k, tau, theta[k], line); });
  }

  /// Orders the duty cycle for a torque, or for the flux that more of it will need, and returns the
  /// torque that the phase will then have at theta, in the frame of positive torque.
  [[gnu::noinline, gnu::cold]] T towards(T& duty, const Measurement<T, N>& y, int k, T tau, T theta,
                                         const LeadLine<T>& line) const {
    const T psi_least = line.flux(theta);
    const T i = max(y.i[k], T(0)), psi = flux(duty, y, k);
    const T i_ref = current_for_torque(machine, tau, theta, i_max);
    T psi_ref = i_ref > T(0) ? machine.at(i_ref, theta).psi : T(0);
    const bool leads = psi_least > psi_ref;
    if (leads) psi_ref = psi_least;
    const T u = (psi_ref - psi) / T_s + R * (leads ? i : (i + i_ref) / T(2));
    duty = psi_ref > T(0) ? clamp(u / y.u_dc, T(-1), T(1)) : T(-1);
    const T psi_end = psi + T_s * (duty * y.u_dc - R * i);
    if (!(psi_end > T(0))) return T(0);
    T i_end = i;
    for (int steps = 0;; ++steps) {
      const Magnetics<T> there = machine.at(i_end, theta);
      if (steps == 2) return there.tau;
      i_end = clamp(i_end + (psi_end - there.psi) / there.L_inc, T(0), T(2) * i_max);
    }
  }
};

}  // namespace srm
