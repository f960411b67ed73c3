// One integration step of the plant, with the integrals that the key figures need.
#pragma once

#include "srm/plant/drive.hpp"

namespace srm {

/// Running integrals over time. They are advanced by the same Runge-Kutta weights as the state, so
/// the energy balance closes to the integrator's error.
template <int N>
struct Integrals {
  double E_dc{};                      // drawn from the dc link [J]
  double E_winding{};                 // into the winding terminals [J]
  double E_mech{};                    // tau omega_m [J]
  double tau{};                       // [N m s]
  double tau_squared{};               // [N^2 m^2 s]
  double error_squared{};             // of (tau - tau_ref) [N^2 m^2 s]
  std::array<double, N> i_squared{};  // [A^2 s]
  double tau_ref{};                   // [N m s]
};

template <int N>
struct Point {
  State<N> x;
  Integrals<N> q;
  double spread{};  // how far the two midpoints of the step that led here were apart [A]
};

template <int N>
State<N> moved(const State<N>& x, const Rates<N>& dx, double omega_m, double h) {
  State<N> y;
  for (int k = 0; k < N; ++k) y.i[k] = x.i[k] + h * dx.di[k];
  y.omega_m = x.omega_m + h * dx.domega_m;
  y.theta_m = x.theta_m + h * omega_m;
  return y;
}

/// Adds one stage of weight w [s] to the integrals.
template <int N>
void accumulate(Integrals<N>& q, const State<N>& x, const Rates<N>& dx, double tau_ref, double w) {
  q.E_dc += w * dx.p_dc;
  q.E_winding += w * dx.p_winding;
  q.E_mech += w * dx.tau * x.omega_m;
  q.tau_ref += w * tau_ref;
  q.tau += w * dx.tau;
  q.tau_squared += w * dx.tau * dx.tau;
  q.error_squared += w * (dx.tau - tau_ref) * (dx.tau - tau_ref);
  for (int k = 0; k < N; ++k) q.i_squared[k] += w * x.i[k] * x.i[k];
}

/// The classic fourth-order Runge-Kutta step of length h; `k1` are the rates at the start, which
/// several trial steps from one point share. The circuit does not change within a step. The two
/// midpoints agree to order 3, so their spread tells where a step is too long for what it crosses.
template <Machine M, int N>
Point<N> runge_kutta(const Plant<M, N>& p, const Point<N>& start, const Rates<N>& k1,
                     const Circuit<N>& circuit, double tau_ref, double h) {
  const State<N>& x1 = start.x;
  const State<N> x2 = moved(x1, k1, x1.omega_m, h / 2);
  const Rates<N> k2 = rates(p, x2, circuit);
  const State<N> x3 = moved(x1, k2, x2.omega_m, h / 2);
  const Rates<N> k3 = rates(p, x3, circuit);
  const State<N> x4 = moved(x1, k3, x3.omega_m, h);
  const Rates<N> k4 = rates(p, x4, circuit);

  Point<N> end = start;
  for (int k = 0; k < N; ++k) {
    end.x.i[k] += h / 6 * (k1.di[k] + 2 * (k2.di[k] + k3.di[k]) + k4.di[k]);
  }
  end.x.omega_m += h / 6 * (k1.domega_m + 2 * (k2.domega_m + k3.domega_m) + k4.domega_m);
  end.x.theta_m += h / 6 * (x1.omega_m + 2 * (x2.omega_m + x3.omega_m) + x4.omega_m);
  end.spread = 0;
  for (int k = 0; k < N; ++k) {
    end.spread = max(end.spread, h / 2 * abs(k3.di[k] - k2.di[k]));
  }
  accumulate(end.q, x1, k1, tau_ref, h / 6);
  accumulate(end.q, x2, k2, tau_ref, h / 3);
  accumulate(end.q, x3, k3, tau_ref, h / 3);
  accumulate(end.q, x4, k4, tau_ref, h / 6);
  return end;
}

}  // namespace srm
