// Deadbeat flux control: the duty cycle that brings each phase to its reference in one sample.
//
// psi(t + T_s) = psi(t) + T_s (duty u_dc - R i), so duty = ((psi_ref - psi)/T_s + R i)/u_dc, with
// psi_ref the machine's flux at the shared torque and at the angle that the sample ends at. With
// one sample of delay psi is first carried through the sample that is under way, whose duty is
// known.
//
// Flux is built up ahead of the share where the voltage is short (flux_lead.hpp), and removed past
// it. The torque that this makes outside of a share is left out of what is shared, and the phase of
// the greatest share gives what is then still missing. The mean is held by feedback
// (mean_hold.hpp).
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
    const T turn = static_cast<T>(machine.N_r) * y.omega_m * T_s;  // electrical angle a sample
    const T theta_end = wrap(y.theta_e + turn * static_cast<T>(1 + delay));
    std::array<T, N> psi;  // when the orders of this sample begin to act
    T given = T(0);
    for (int k = 0; k < N; ++k) {
      const T i = max(y.i[k], T(0));
      const Magnetics<T> now = machine.at(i, drive_angle<N>(y.theta_e, k, tau_ref));
      given = given + now.tau;
      psi[k] = delay > 0 ? max(now.psi + T_s * (x.duty[k] * y.u_dc - R * i), T(0)) : now.psi;
    }
    const T asked = x.mean.asked(abs(tau_ref), given, turn, braking);

    std::array<T, N> theta, share;
    int first = 0;
    T left = asked;
    const auto order = [&](int k, T tau) {
      const Goal goal = towards(y, k, psi[k], max(tau, T(0)), theta[k], asked, braking);
      x.duty[k] = goal.duty;
      left = left - goal.tau;
    };
    for (int k = 0; k < N; ++k) {
      theta[k] = drive_angle<N>(theta_end, k, tau_ref);
      share[k] = sharing.template share<N>(theta[k]);
      if (share[k] > share[first]) first = k;
      if (!(share[k] > T(0))) order(k, T(0));
    }
    left = min(left, most_shared<T> * asked);
    const T shared = left;  // what the phases without a share leave
    for (int k = 0; k < N; ++k) {
      if (k != first && share[k] > T(0)) order(k, share[k] * shared);
    }
    order(first, min(left, most_shared<T> * asked));
    return per_phase<T, N>(
        [&](int k) { return modulate(x.duty[k], T_s, pulse_centre<N, T>(carriers, k)); });
  }

 private:
  struct Goal {
    T duty;
    T tau;  // that the phase then has at the end of the sample [N m]
  };

  /// The duty cycle of phase k for a torque at theta, or for the flux that more of it will need,
  /// in the frame of positive torque.
  [[gnu::noinline]] Goal towards(const Measurement<T, N>& y, int k, T psi, T tau, T theta, T asked,
                                 bool braking) const {
    const T i = max(y.i[k], T(0));
    const T i_ref = current_for_torque(machine, tau, theta, i_max);
    const T psi_share = i_ref > T(0) ? machine.at(i_ref, theta).psi : T(0);
    const T omega_e = static_cast<T>(machine.N_r) * abs(y.omega_m);
    const T slope = lead.slope(y.u_dc, asked, omega_e);
    const T psi_ref = max(psi_share, lead.flux(theta, asked, slope, braking));
    const T i_mean = psi_ref > psi_share ? i : (i + i_ref) / T(2);
    const T u = (psi_ref - psi) / T_s + R * i_mean;
    const T duty = psi_ref > T(0) ? clamp(u / y.u_dc, T(-1), T(1)) : T(-1);
    const T psi_end = psi + T_s * (duty * y.u_dc - R * i);
    if (!(psi_end > T(0))) return {duty, T(0)};
    T i_end = i;
    for (int steps = 0; steps < 2; ++steps) {
      const Magnetics<T> there = machine.at(i_end, theta);
      i_end = clamp(i_end + (psi_end - there.psi) / there.L_inc, T(0), T(2) * i_max);
    }
    return {duty, machine.at(i_end, theta).tau};
  }
};

}  // namespace srm
