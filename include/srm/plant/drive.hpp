// The continuous plant: machine, converter and shaft as one set of differential equations.
#pragma once

#include <array>

#include "srm/machine/magnetics.hpp"
#include "srm/plant/converter.hpp"
#include "srm/plant/mechanics.hpp"

namespace srm {

/// What the plant remembers (eq. 2.4 of the paper).
template <int N>
struct State {
  std::array<double, N> i{};  // phase currents [A], never negative
  double omega_m{};           // rotor speed [rad/s]
  double theta_m{};           // rotor angle [rad], grows without wrapping
};

/// The circuit of a step: legs, and which phases carry current. Both are settled before the step,
/// so that a stage which tries a current past zero sees the same equations.
template <int N>
struct Circuit {
  std::array<Leg, N> leg{};
  std::array<bool, N> flows{};
};

template <Machine M, int N>
struct Plant {
  M machine;
  double R;  // phase resistance [ohm]
  Converter converter;
  Mechanics mechanics;
};

/// Rates of the state, and the powers whose integrals make the energy balance.
template <int N>
struct Rates {
  std::array<double, N> di{};  // [A/s]
  double domega_m{};           // [rad/s^2]
  double tau{};                // machine torque [N m]
  double p_dc{};               // drawn from the dc link [W]
  double p_winding{};          // into the winding terminals: p_dc less the device losses [W]
};

template <Machine M, int N>
double electrical_angle(const Plant<M, N>& p, double theta_m, int k) {
  return phase_angle<N>(wrap(p.machine.N_r * theta_m), k);
}

/// Per phase di/dt = (u - R i - omega dpsi/dtheta)/(dpsi/di); a blocked phase stays at zero.
// flatten: inlining the machine model drops what the rates do not need of it; a fifth of the run.
template <Machine M, int N>
[[gnu::flatten]] Rates<N> rates(const Plant<M, N>& p, const State<N>& x,
                                const Circuit<N>& circuit) {
  Rates<N> dx;
  const double theta_e = wrap(p.machine.N_r * x.theta_m);
  for (int k = 0; k < N; ++k) {
    if (!circuit.flows[k]) continue;
    const Magnetics<double> m = p.machine.at(x.i[k], phase_angle<N>(theta_e, k));
    const double u = winding_voltage(p.converter, circuit.leg[k], x.i[k]);
    dx.di[k] = (u - p.R * x.i[k] - x.omega_m * m.psi_theta) / m.L_inc;
    dx.tau += m.tau;
    dx.p_dc += static_cast<int>(circuit.leg[k]) * p.converter.u_dc * x.i[k];
    dx.p_winding += u * x.i[k];
  }
  dx.domega_m = acceleration(p.mechanics, dx.tau, x.omega_m);
  return dx;
}

/// Energy stored in the magnetic field of all phases [J].
template <Machine M, int N>
double field_energy(const Plant<M, N>& p, const State<N>& x) {
  double W_f = 0;
  for (int k = 0; k < N; ++k) {
    const Magnetics<double> m = p.machine.at(x.i[k], electrical_angle(p, x.theta_m, k));
    W_f += m.psi * x.i[k] - m.W_c;
  }
  return W_f;
}

}  // namespace srm
