// Deadbeat flux control: the duty cycle that brings each phase to its reference in one sample.
//
// psi(t + T_s) = psi(t) + T_s (duty u_dc - R i), so duty = ((psi_ref - psi)/T_s + R i)/u_dc, with
// psi_ref the machine's flux at the shared torque and at the angle that the sample ends at. With
// one sample of delay psi is first carried through the sample that is under way, whose duty is
// known.
//
// Braking, flux is built up ahead of the share (flux_lead.hpp), which makes torque of the wrong
// sign first. The phase of the greatest share therefore gives what the torques that the others will
// have leave to be given.
//
// R. Mikail, I. Husain, Y. Sozer, M. S. Islam, T. Sebastian, "A fixed switching frequency
// predictive current control method for switched reluctance machines", IEEE Trans. Ind. Appl.
// 50(6), 2014; sharing: sharing.hpp.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/flux_lead.hpp"
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
    const T turn = static_cast<T>(machine.N_r) * y.omega_m * T_s;  // electrical angle a sample
    const T theta_end = wrap(y.theta_e + turn * static_cast<T>(1 + delay));
    std::array<T, N> theta, tau;
    int first = 0;
    for (int k = 0; k < N; ++k) {
      theta[k] = drive_angle<N>(theta_end, k, tau_ref);
      tau[k] = sharing.template share<N>(theta[k]) * abs(tau_ref);
      if (tau[k] > tau[first]) first = k;
    }
    if (brakes(y.omega_m, tau_ref)) {
      T left = abs(tau_ref);
      for (int k = 0; k < N; ++k) {
        if (k != first) left = left - brake(x.duty[k], y, k, tau[k], theta[k], abs(tau_ref));
      }
      brake(x.duty[first], y, first, max(left, T(0)), theta[first], abs(tau_ref));
    } else {
      for (int k = 0; k < N; ++k) {
        const T i_ref = current_for_torque(machine, tau[k], theta[k], i_max);
        const T i = max(y.i[k], T(0));
        x.duty[k] = i_ref > T(0)
                        ? duty(x.duty[k], y, k, machine.at(i_ref, theta[k]).psi, (i + i_ref) / T(2))
                        : T(-1);
      }
    }
    return per_phase<T, N>(
        [&](int k) { return modulate(x.duty[k], T_s, pulse_centre<N, T>(carriers, k)); });
  }

 private:
  /// Flux of phase k when the orders of this sample begin to act; last: the duty before them.
  T flux(T last, const Measurement<T, N>& y, int k) const {
    const T i = max(y.i[k], T(0));
    const T psi = machine.at(i, phase_angle<N>(y.theta_e, k)).psi;
    return delay > 0 ? max(psi + T_s * (last * y.u_dc - R * i), T(0)) : psi;
  }

  T duty(T last, const Measurement<T, N>& y, int k, T psi_ref, T i_mean) const {
    const T u = (psi_ref - flux(last, y, k)) / T_s + R * i_mean;
    return clamp(u / y.u_dc, T(-1), T(1));
  }

  /// Orders the duty cycle for a torque, or for the flux that more of it will need, and returns the
  /// torque that the phase will then have at theta, in the frame of positive torque.
  [[gnu::noinline]] T brake(T& duty, const Measurement<T, N>& y, int k, T tau, T theta,
                            T tau_all) const {
    const T i = max(y.i[k], T(0));
    const T omega_e = static_cast<T>(machine.N_r) * abs(y.omega_m);
    const T i_ref = current_for_torque(machine, tau, theta, i_max);
    const T psi_share = i_ref > T(0) ? machine.at(i_ref, theta).psi : T(0);
    const T slope = (T(0.97) * y.u_dc - R * i) / omega_e;  // a reserve of 3 %
    const T psi_ref = max(psi_share, lead.flux(theta, tau_all, slope));
    const T psi = flux(duty, y, k);
    const T u = (psi_ref - psi) / T_s + R * i;
    duty = psi_ref > T(0) ? clamp(u / y.u_dc, T(-1), T(1)) : T(-1);
    const T psi_end = psi + T_s * (duty * y.u_dc - R * i);
    if (!(psi_end > T(0))) return T(0);
    T i_end = i;
    for (int steps = 0; steps < 2; ++steps) {
      const Magnetics<T> there = machine.at(i_end, theta);
      i_end = clamp(i_end + (psi_end - there.psi) / there.L_inc, T(0), T(2) * i_max);
    }
    return machine.at(i_end, theta).tau;
  }
};

}  // namespace srm
