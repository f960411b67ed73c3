// The continuous plant: machine, source, bridge and shaft as one set of differential equations.
#pragma once

#include <array>
#include <type_traits>

#include "srm/machine/magnetics.hpp"
#include "srm/plant/bridge.hpp"
#include "srm/plant/shaft.hpp"
#include "srm/plant/source.hpp"
#include "srm/plant/state.hpp"

namespace srm {

/// The circuit of a step: legs, which phases carry current, and whether the diodes of the bridge
/// hold the dc link at zero. All are settled before the step, so that a stage which tries a current
/// or the voltage past zero sees the same equations.
template <int N>
struct Circuit {
  AllLegs<N> leg{};
  std::array<bool, N> flows{};
  bool shorted{};
};

template <Machine M, int N>
struct Plant {
  M machine;
  double R;  // phase resistance [ohm]
  Source source;
  Bridge bridge;
  Shaft shaft;
  SRM_FIELDS(machine, R, source, bridge, shaft)
};

/// Rates of the state, and the powers whose integrals make the energy balance.
template <int N>
struct Rates {
  State<N> dx;         // per second
  double tau{};        // machine torque [N m]
  double p_source{};   // delivered by the source [W]
  double p_loss{};     // lost between the source and the dc link [W]
  double p_dc{};       // drawn from the dc link by the bridge [W]
  double p_winding{};  // into the winding terminals: p_dc less the device losses [W]
};

template <Machine M, int N>
double electrical_angle(const Plant<M, N>& p, double theta_m, int k) {
  return phase_angle<N>(wrap(p.machine.N_r * theta_m), k);
}

/// Per phase di/dt = (u - R i - omega dpsi/dtheta)/(dpsi/di); a blocked phase stays at zero.
template <Machine M, int N>
Rates<N> rates(const Plant<M, N>& p, const State<N>& x, const Circuit<N>& circuit, Moment now) {
  Rates<N> r;
  const double theta_e = wrap(p.machine.N_r * x.theta_m);
  double i_dc = 0;
  std::visit(
      [&](const auto& bridge) {
        const auto shared = bridge.shared(circuit.leg, x.i);
        for (int k = 0; k < N; ++k) {
          if (!circuit.flows[k]) continue;
          const Magnetics<double> m = p.machine.at(x.i[k], phase_angle<N>(theta_e, k));
          const double u = bridge.voltage(shared, circuit.leg[k], x.i[k], x.u_dc);
          r.dx.i[k] = (u - p.R * x.i[k] - x.omega_m * m.psi_theta) / m.L_inc;
          r.tau += m.tau;
          i_dc += static_cast<int>(circuit.leg[k]) * x.i[k];
          r.p_dc += static_cast<int>(circuit.leg[k]) * x.u_dc * x.i[k];
          r.p_winding += u * x.i[k];
        }
      },
      p.bridge);
  const Feed source = feed(p.source, x.u_dc, i_dc, now);
  r.dx.omega_m = acceleration(p.shaft, r.tau, x.omega_m, now);
  r.dx.theta_m = x.omega_m;
  r.dx.u_dc = circuit.shorted ? 0 : source.du_dc;
  r.p_source = source.p;
  r.p_loss = source.p_loss;
  return r;
}

/// What the source does at time t, before a step.
template <Machine M, int N>
Feed source_now(const Plant<M, N>& p, const std::type_identity_t<AllLegs<N>>& leg,
                const State<N>& x, double t) {
  double i_dc = 0;
  for (int k = 0; k < N; ++k) i_dc += static_cast<int>(leg[k]) * x.i[k];
  return feed(p.source, x.u_dc, i_dc, {t, t});
}

/// What winding k sees [V].
template <Machine M, int N>
double winding_voltage(const Plant<M, N>& p, const std::type_identity_t<AllLegs<N>>& leg,
                       const State<N>& x, int k) {
  return std::visit(
      [&](const auto& bridge) {
        return bridge.voltage(bridge.shared(leg, x.i), leg[k], x.i[k], x.u_dc);
      },
      p.bridge);
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
