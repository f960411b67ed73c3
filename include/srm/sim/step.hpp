// One integration step of the plant, with the integrals that the key figures need.
#pragma once

#include "srm/plant/drive.hpp"

namespace srm {

/// Running integrals over time. They are advanced by the same Runge-Kutta weights as the state, so
/// the energy balance closes to the integrator's error.
template <int N>
struct Integrals {
  double E_source{};                  // delivered by the source [J]
  double E_loss{};                    // lost between the source and the dc link [J]
  double E_dc{};                      // drawn from the dc link by the bridge [J]
  double E_winding{};                 // into the winding terminals [J]
  double E_mech{};                    // tau omega_m [J]
  double tau{};                       // [N m s]
  double tau_squared{};               // [N^2 m^2 s]
  double tau_ref{};                   // [N m s]
  double error_squared{};             // of (tau - tau_ref) [N^2 m^2 s]
  std::array<double, N> i_squared{};  // [A^2 s]
  SRM_FIELDS(E_source, E_loss, E_dc, E_winding, E_mech, tau, tau_squared, tau_ref, error_squared,
             i_squared)
};

/// State and integrals; their rates have the same form.
template <int N>
struct Point {
  State<N> x;
  Integrals<N> q;
  SRM_FIELDS(x, q)
};

/// What does not change within a step.
template <int N>
struct Settled {
  Circuit<N> circuit;
  double tau_ref;  // [N m]
  double t;        // start of the step [s]
};

/// Rates of a point, `since` the start of the step [s].
// flatten: inlining the plant drops what the rates do not need of it; a fifth of the run.
template <Machine M, int N>
[[gnu::flatten]] Point<N> slope(const Plant<M, N>& p, const State<N>& x, const Settled<N>& s,
                                double since) {
  const Rates<N> r = rates(p, x, s.circuit, {s.t + since, s.t});
  const double error = r.tau - s.tau_ref;
  Point<N> d{.x = r.dx,
             .q = {.E_source = r.p_source,
                   .E_loss = r.p_loss,
                   .E_dc = r.p_dc,
                   .E_winding = r.p_winding,
                   .E_mech = r.tau * x.omega_m,
                   .tau = r.tau,
                   .tau_squared = r.tau * r.tau,
                   .tau_ref = s.tau_ref,
                   .error_squared = error * error}};
  for (int k = 0; k < N; ++k) d.q.i_squared[k] = x.i[k] * x.i[k];
  return d;
}

/// The size of currents and voltages that matter: a small part of it is resolved.
struct Scale {
  double i;     // [A]
  double u_dc;  // [V]
  SRM_FIELDS(i, u_dc)
};

/// How far the two midpoints of a step are apart, in parts of the scale. They agree to order 3, so
/// this tells where a step is too long for what it crosses.
template <int N>
double spread(const State<N>& k2, const State<N>& k3, double h, const Scale& scale) {
  double most = abs(k3.u_dc - k2.u_dc) / scale.u_dc;
  for (int k = 0; k < N; ++k) most = max(most, abs(k3.i[k] - k2.i[k]) / scale.i);
  return h / 2 * most;
}

/// The end of a step, and the spread of its midpoints [1].
template <int N>
struct Trial {
  Point<N> end;
  double spread;
};

/// The classic fourth-order Runge-Kutta step of length h; `k1` is the slope at the start, which
/// several trial steps from one point share.
template <Machine M, int N>
Trial<N> runge_kutta(const Plant<M, N>& p, const Point<N>& start, const Point<N>& k1,
                     const Settled<N>& s, const Scale& scale, double h) {
  const State<N>& x = start.x;
  const Point<N> k2 = slope(p, moved(x, k1.x, h / 2), s, h / 2);
  const Point<N> k3 = slope(p, moved(x, k2.x, h / 2), s, h / 2);
  const Point<N> k4 = slope(p, moved(x, k3.x, h), s, h);
  Point<N> end;
  each([h](double a, double r1, double r2, double r3,
           double r4) { return a + h / 6 * (r1 + 2 * (r2 + r3) + r4); },
       end, start, k1, k2, k3, k4);
  return {end, spread(k2.x, k3.x, h, scale)};
}

}  // namespace srm
