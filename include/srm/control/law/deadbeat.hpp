// Deadbeat flux control: the duty cycle that brings each phase to its reference in one sample.
//
// psi(t + T_s) = psi(t) + T_s (duty u_dc - R i), so duty = ((psi_ref - psi)/T_s + R i)/u_dc, with
// psi_ref the machine's flux at the shared torque and at the angle that the sample ends at. With
// one sample of delay psi is first carried through the sample that is under way, whose duty is
// known. R. Mikail, I. Husain, Y. Sozer, M. S. Islam, T. Sebastian, "A fixed switching frequency
// predictive current control method for switched reluctance machines", IEEE Trans. Ind. Appl.
// 50(6), 2014; sharing: sharing.hpp.
#pragma once

#include "srm/base/fields.hpp"
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
  T i_max;        // [A]
  T T_s;          // control and carrier period [s]
  int delay = 0;  // samples from measurement to effect: 0 or 1
  Carriers carriers = Carriers::in_phase;
  SRM_FIELDS(machine, R, sharing, i_max, T_s, delay, carriers)

  Command<T, N> step(State& x, const Measurement<T, N>& y, T tau_ref) const {
    const T turn = static_cast<T>(machine.N_r) * y.omega_m * T_s;  // electrical angle a sample
    const T theta_end = wrap(y.theta_e + turn * static_cast<T>(1 + delay));
    return per_phase<T, N>([&](int k) {
      const T theta = drive_angle<N>(theta_end, k, tau_ref);
      const T tau_ph = sharing.template share<N>(theta) * abs(tau_ref);
      const T i_ref = current_for_torque(machine, tau_ph, theta, i_max);
      x.duty[k] = i_ref > T(0) ? duty(x.duty[k], y, k, i_ref, theta) : T(-1);
      return modulate(x.duty[k], T_s, pulse_centre<N, T>(carriers, k));
    });
  }

 private:
  T duty(T last, const Measurement<T, N>& y, int k, T i_ref, T theta_end) const {
    const T i = max(y.i[k], T(0));
    T psi = machine.at(i, phase_angle<N>(y.theta_e, k)).psi;
    if (delay > 0) psi = max(psi + T_s * (last * y.u_dc - R * i), T(0));
    const T u = (machine.at(i_ref, theta_end).psi - psi) / T_s + R * (i + i_ref) / T(2);
    return clamp(u / y.u_dc, T(-1), T(1));
  }
};

}  // namespace srm
