// The continuous plant: machine, source, bridge and shaft as one set of differential equations.
#pragma once

#include <array>
#include <type_traits>

#include "srm/machine/magnetics.hpp"
#include "srm/plant/bridge.hpp"
#include "srm/plant/coupled.hpp"
#include "srm/plant/shaft.hpp"
#include "srm/plant/source.hpp"
#include "srm/plant/state.hpp"

namespace srm {

/// What flows past a winding in a fault (faults.hpp): by G from its terminals, by G_link from the
/// dc link, of which its current channel sees G_ground [S]. level: of the leg.
struct Leak {
  double G{}, level{}, G_link{}, G_ground{};
};

/// The circuit of a step: what the legs connect, which phases carry current, and whether the diodes
/// of the bridge hold the dc link at zero. All are settled before the step, so that a trial which
/// takes a current or the voltage past zero sees the same equations.
template <int N>
struct Circuit {
  Paths<N> paths;  // to the flux linkages
  std::array<bool, N> flows{};
  bool shorted{};
  std::array<Leak, N> leak{};
  bool leaks{};  // there is one
};

template <Machine M, int N>
struct Plant {
  M machine;
  double R;  // phase resistance [ohm]
  Source source;
  Bridge bridge;
  Shaft shaft;
  Coupling<double> coupling{};  // by default none
  SRM_FIELDS(machine, R, source, bridge, shaft, coupling)
};

/// How the state changes. A phase that does not flow has neither current nor voltage.
template <int N>
struct Rates {
  std::array<Moving, N> i{};  // phase currents [A]
  std::array<Moving, N> v{};  // rates of the flux linkages, u - R i [V]
  Moving tau;                 // machine torque [N m]
  Moving omega_m;             // speed [rad/s]
  Moving alpha;               // its rate [rad/s^2]
  Moving i_dc;                // drawn from the dc link by the bridge [A]
  Moving u_dc;                // dc-link voltage [V]
  Feed source;
};

template <Machine M, int N>
double electrical_angle(const Plant<M, N>& p, double theta_m, int k) {
  return phase_angle<N>(wrap(p.machine.N_r * theta_m), k);
}

/// Sum of the currents that a shared device carries.
template <int N>
double sum(const std::array<double, N>& i) {
  double all = 0;
  for (const double i_k : i) all += i_k;
  return all;
}

/// Voltage of winding k at its current.
template <Machine M, int N>
Moving terminal_voltage(const Plant<M, N>& p, const Circuit<N>& circuit, const Moving& u_dc,
                        const Moving& i, int k) {
  const Path& path = circuit.paths.phase[k];
  return path.level * u_dc - path.v - (path.R - p.R) * i;
}

/// What the dc link gives past the windings [A].
template <Machine M, int N>
Moving leaked(const Plant<M, N>& p, const Circuit<N>& circuit, const Moving& u_dc,
              const std::type_identity_t<std::array<Moving, N>>& i) {
  Moving all;
  for (int k = 0; k < N; ++k) {
    const Leak& leak = circuit.leak[k];
    all += leak.level * leak.G * terminal_voltage(p, circuit, u_dc, i[k], k);
    all += (leak.level - circuit.paths.phase[k].level) * i[k];  // of which G leaves a part
    all += leak.G_link * u_dc;
  }
  return all;
}

/// The magnetics of the phases that flow.
template <Machine M, int N>
void evaluate(const Plant<M, N>& p, const State<N>& x,
              const std::type_identity_t<std::array<bool, N>>& flows, PairPieces& pieces,
              std::type_identity_t<Jets<N>>& jets, Links<N>& links) {
  const double theta_e = wrap(p.machine.N_r * x.theta_m);
  for (int k = 0; k < N; ++k) {
    if (flows[k]) jets[k] = p.machine.jet(x.i[k], phase_angle<N>(theta_e, k));
  }
  if (p.coupling.any()) add_pairs<N>(p.coupling, pieces, flows, x.i, theta_e, jets, links);
}

/// Per phase di/dt = (u - R i - omega dpsi/dtheta)/(dpsi/di), of phases that couple with the matrix
/// of their inductances; a blocked phase stays at zero. m, links: of the phases that flow; links
/// are factored.
template <Machine M, int N>
void rates(const Plant<M, N>& p, const State<N>& x, const std::type_identity_t<Jets<N>>& m,
           std::type_identity_t<Links<N>>& links, const Circuit<N>& circuit, Moment now,
           Rates<N>& r) {
  const double R_shared = circuit.paths.R_shared;
  const double v_shared = R_shared == 0 ? 0 : R_shared * sum<N>(x.i);
  double i_sum_rate = 0;
  r.tau = r.i_dc = {};
  std::array<double, N> i_rates{};
  for (int k = 0; k < N; ++k) {
    if (!circuit.flows[k]) {
      r.i[k] = r.v[k] = {};
      continue;
    }
    const Path& path = circuit.paths.phase[k];
    const double v = path.level * x.u_dc - path.v - v_shared - path.R * x.i[k];
    r.v[k].now = v;
    i_rates[k] = v - x.omega_m * m[k].psi_theta;
  }
  const bool coupled = p.coupling.any();
  if (coupled) {
    factor<N>(circuit.flows, m, links, {}, links.factored);
    solve<double, N>(circuit.flows, links.factored, i_rates);
  }
  for (int k = 0; k < N; ++k) {
    if (!circuit.flows[k]) continue;
    const Path& path = circuit.paths.phase[k];
    const double i_rate = coupled ? i_rates[k] : i_rates[k] / m[k].L_inc;
    i_sum_rate += i_rate;
    r.i[k] = {x.i[k], i_rate};
    r.i_dc += path.level * r.i[k];
    r.tau += {m[k].tau, m[k].psi_theta * i_rate + m[k].tau_theta * x.omega_m};
  }
  if (circuit.leaks) {  // its rate follows from that of the voltage
    const Moving i_dc = r.i_dc + leaked(p, circuit, x.u_dc, r.i);
    r.i_dc += leaked(p, circuit, {x.u_dc, feed(p.source, x.u_dc, i_dc, now).du_dc.now}, r.i);
  }
  r.source = feed(p.source, x.u_dc, r.i_dc, now);
  if (circuit.shorted) r.source.du_dc = r.source.i_cap = {};
  r.u_dc = {x.u_dc, r.source.du_dc.now};
  for (int k = 0; k < N; ++k) {
    if (!circuit.flows[k]) continue;
    const Path& path = circuit.paths.phase[k];
    r.v[k].rate = path.level * r.u_dc.rate - path.R * r.i[k].rate - R_shared * i_sum_rate;
  }
  r.alpha = acceleration(p.shaft, r.tau, x.omega_m, now);
  r.omega_m = {x.omega_m, r.alpha.now};
}

/// What the source does at time t, before a step.
template <Machine M, int N>
Feed source_now(const Plant<M, N>& p, const Circuit<N>& circuit, const State<N>& x, double t) {
  double i_dc = 0;
  for (int k = 0; k < N; ++k) i_dc += circuit.paths.phase[k].level * x.i[k];
  if (circuit.leaks) {
    std::array<Moving, N> i;
    for (int k = 0; k < N; ++k) i[k] = x.i[k];
    i_dc += leaked(p, circuit, x.u_dc, i).now;
  }
  return feed(p.source, x.u_dc, i_dc, {t, t});
}

/// Paths that go on through windings of resistance R [ohm], to the flux linkages.
template <std::size_t N>
Paths<N> with_windings(Paths<N> found, double R) {
  for (Path& path : found.phase) path.R += R;
  return found;
}

/// The paths of these legs to the flux linkages.
template <Machine M, int N>
Paths<N> paths(const Plant<M, N>& p, const std::type_identity_t<AllLegs<N>>& legs) {
  return with_windings(std::visit([&](const auto& b) { return b.paths(legs); }, p.bridge), p.R);
}

/// What winding k sees [V].
template <Machine M, int N>
double winding_voltage(const Plant<M, N>& p, const Circuit<N>& circuit, const State<N>& x, int k) {
  const Path& path = circuit.paths.phase[k];
  const double shared = circuit.paths.R_shared * sum<N>(x.i);
  return path.level * x.u_dc - path.v - (path.R - p.R) * x.i[k] - shared;
}

/// Energy stored in the magnetic field of all phases [J].
template <Machine M, int N>
double field_energy(const Plant<M, N>& p, const State<N>& x) {
  double W_f = 0;
  for (int k = 0; k < N; ++k) {
    const Magnetics<double> m = p.machine.at(x.i[k], electrical_angle(p, x.theta_m, k));
    W_f += m.psi * x.i[k] - m.W_c;
  }
  for (int n = 0; n < p.coupling.n_pairs(); ++n) {
    const double a = x.i[p.coupling.first[n]], b = x.i[p.coupling.second[n]];
    const auto m = p.coupling.at(n, a, b, electrical_angle(p, x.theta_m, 0));
    W_f += m.psi_first * a + m.psi_second * b - m.W_c;
  }
  return W_f;
}

}  // namespace srm
