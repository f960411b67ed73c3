// One integration step of the plant, with the integrals that the key figures need.
//
// Flux linkages, speed, angle and dc-link voltage at the end of a step of length h follow from
// their rates f and the rates of those, at both ends (Hermite's rule, of order 4):
//
//   y_1 = y_0 + h/2 (f_0 + f_1) + h^2/12 (f_0' - f_1')
//
// For a flux linkage f = u - R i, of which R i is the only part that is not exact. A Taylor
// polynomial predicts the currents at the end to order 3, the machine is evaluated there once, and
// Newton's method corrects the currents to the flux linkages. The next step starts from the same
// evaluation. Where a correction is not small, the machine is evaluated again.
// E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, ch. V.3 (Obreshkov).
#pragma once

#include "srm/plant/drive.hpp"

namespace srm {

/// Running integrals over time, by the same rule as the state.
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
  double i_cap{};                     // into the capacitor of the dc link [A s]
  double i_cap_squared{};             // [A^2 s]
  double three_on{};                  // time with three phases on or more, where they couple [s]
  SRM_FIELDS(E_source, E_loss, E_dc, E_winding, E_mech, tau, tau_squared, tau_ref, error_squared,
             i_squared, i_cap, i_cap_squared, three_on)
};

/// Adds what the torque does in a step of length h; returns its integral.
template <int N>
double add_torque(Integrals<N>& q, const Moving& tau0, const Moving& tau1, double tau_ref,
                  double h) {
  const double tau = integral(tau0, tau1, h);
  const double tau_squared = integral_of_square(tau0, tau1, h);
  q.tau += tau;
  q.tau_squared += tau_squared;
  q.tau_ref += h * tau_ref;
  q.error_squared += tau_squared - tau_ref * (2 * tau - h * tau_ref);
  return tau;
}

/// Adds what the capacitor of the dc link takes in a step of length h.
template <int N>
void add_capacitor(Integrals<N>& q, const Moving& i0, const Moving& i1, double h) {
  q.i_cap += integral(i0, i1, h);
  q.i_cap_squared += integral_of_square(i0, i1, h);
}

/// Adds a step of length h from rates r0 to r1; R: of a phase.
template <int N>
void add(Integrals<N>& q, const Rates<N>& r0, const Rates<N>& r1, double R, double tau_ref,
         double h) {
  q.E_source += integral(r0.source.p, r1.source.p, h);
  q.E_loss += integral(r0.source.p_loss, r1.source.p_loss, h);
  q.E_dc += integral(r0.u_dc * r0.i_dc, r1.u_dc * r1.i_dc, h);
  q.E_mech += integral(r0.tau * r0.omega_m, r1.tau * r1.omega_m, h);
  add_torque(q, r0.tau, r1.tau, tau_ref, h);
  add_capacitor(q, r0.source.i_cap, r1.source.i_cap, h);
  for (int k = 0; k < N; ++k) {
    const Moving &i0 = r0.i[k], &i1 = r1.i[k];
    if (i1.now == 0 && i0.now == 0) continue;
    const double i_squared = integral(i0 * i0, i1 * i1, h);
    q.i_squared[k] += i_squared;
    q.E_winding += integral(r0.v[k] * i0, r1.v[k] * i1, h) + R * i_squared;
  }
}

/// The size of currents and voltages that matter: a small part of it is resolved.
struct Scale {
  double i;     // [A]
  double u_dc;  // [V]
  SRM_FIELDS(i, u_dc)
};

/// State, with the magnetics of the phases that carry current, and the rates of all.
template <int N>
struct Instant {
  State<N> x;
  Jets<N> jets;
  Links<N> links;
  Rates<N> rates;
};

/// What does not change within a step.
template <int N>
struct StepStart {
  const Circuit<N>& circuit;
  PairPieces& pieces;
  double t;                   // start of the step [s]
  std::array<double, N> d2i;  // second derivatives of the currents at the start [A/s^2]
};

/// Second derivative of a current, from the rate of L di/dt = v - omega dpsi/dtheta.
[[gnu::always_inline]] inline double bend(const Jet<double>& m, const Moving& i, const Moving& v,
                                          const Moving& omega) {
  const double psi_theta_rate = 2 * m.L_theta * i.rate + m.psi_theta_2 * omega.now;
  return (v.rate - m.L_i * i.rate * i.rate - omega.rate * m.psi_theta -
          omega.now * psi_theta_rate) /
         m.L_inc;
}

/// The magnetics at a current and an angle that are a little farther on.
[[gnu::always_inline]] inline void move(Jet<double>& m, double di, double dtheta) {
  m.tau += di * (m.psi_theta + di / 2 * m.L_theta) + dtheta * m.tau_theta;
  m.L_inc += di * m.L_i + dtheta * m.L_theta;
  m.psi_theta += di * m.L_theta + dtheta * m.psi_theta_2;
  m.tau_theta += di * m.psi_theta_2;
}

/// The state at time h after a point, by its Taylor polynomial.
template <int N>
void predict(const Instant<N>& from, const StepStart<N>& s, double h, State<N>& x) {
  const Rates<N>& r = from.rates;
  const Moving& du = r.source.du_dc;
  for (int k = 0; k < N; ++k) {
    x.i[k] = s.circuit.flows[k] ? from.x.i[k] + h * (r.i[k].rate + h / 2 * s.d2i[k]) : 0;
  }
  x.theta_m = from.x.theta_m + h * (from.x.omega_m + h / 2 * (r.alpha.now + h / 3 * r.alpha.rate));
  x.omega_m = from.x.omega_m + h * (r.alpha.now + h / 2 * r.alpha.rate);
  x.u_dc = from.x.u_dc + h * (du.now + h / 2 * du.rate);
}

/// Newton's correction of a current where the flux linkage lacks `left` at the end of a step of
/// length h, with the bend of the magnetisation.
///
/// A prediction of the current is off by a term in h^3, so its rate by three times that over h;
/// with it, a change di lowers the flux linkage of Hermite's rule by h R di/4.
[[gnu::always_inline]] inline double correction(const Jet<double>& m, double left, double h,
                                                double R) {
  const double per_psi = 1 / (m.L_inc + h / 4 * R);
  const double change = left * per_psi;
  return change - change * change / 2 * m.L_i * per_psi;
}

/// What the flux linkages ask the currents to change by, of a trial `end` at time h; so far they
/// have been changed by `off` since their prediction. coupled: the phases are.
template <int N>
std::array<double, N> corrections(const Instant<N>& start, const Instant<N>& end,
                                  const StepStart<N>& s, double h,
                                  const std::type_identity_t<std::array<double, N>>& off,
                                  bool coupled) {
  const Rates<N>& r = start.rates;
  const Paths<N>& paths = s.circuit.paths;
  const Moving du{end.x.u_dc - start.x.u_dc, h * r.source.du_dc.rate};
  Moving shared;
  if (paths.R_shared != 0) {
    shared = paths.R_shared * Moving{sum<N>(end.x.i) - sum<N>(start.x.i), h * sum<N>(s.d2i)};
  }
  std::array<double, N> d{}, more{};
  for (int k = 0; k < N; ++k) {
    if (!s.circuit.flows[k]) continue;
    const double R = paths.phase[k].R;
    const Moving di{end.x.i[k] - start.x.i[k], h * s.d2i[k] + 3 / h * off[k]};
    const Moving v = r.v[k] + paths.phase[k].level * du - R * di - shared;
    const double left = start.jets[k].psi + integral(r.v[k], v, h) - end.jets[k].psi;
    d[k] = coupled ? left : correction(end.jets[k], left, h, R);
    more[k] = h / 4 * R;
  }
  if (coupled) return joint_corrections<N>(s.circuit.flows, end.jets, end.links, more, d);
  return d;
}

/// Takes what Hermite's rule says of a trial at the end of a step of length h; returns what that
/// changes the dc-link voltage by.
template <Machine M, int N>
double close(const Plant<M, N>& p, const Instant<N>& start, Instant<N>& end, const StepStart<N>& s,
             double h) {
  const Rates<N>& r0 = start.rates;
  Rates<N>& r1 = end.rates;
  if (p.shaft.rotation == Rotation::turning) {  // the load at the speed that the torque makes
    const double omega = start.x.omega_m + integral(r0.alpha, r1.alpha, h);
    r1.alpha = acceleration(p.shaft, r1.tau, omega, {s.t + h, s.t});
    r1.omega_m = {omega, r1.alpha.now};
  }
  const double load = load_between(p.shaft, r0.tau, r0.omega_m, r1.tau, r1.omega_m, {s.t, s.t}, h);
  end.x.omega_m = r1.omega_m.now = start.x.omega_m + integral(r0.alpha, r1.alpha, h) + load;
  end.x.theta_m = start.x.theta_m + integral(r0.omega_m, r1.omega_m, h);
  const double u_dc = start.x.u_dc + integral(r0.source.du_dc, r1.source.du_dc, h);
  const double du = u_dc - end.x.u_dc;
  end.x.u_dc = r1.u_dc.now = u_dc;
  for (int k = 0; k < N; ++k) {
    if (!s.circuit.flows[k]) continue;
    r1.v[k].now += s.circuit.paths.phase[k].level * du;
    end.jets[k].psi = start.jets[k].psi + integral(r0.v[k], r1.v[k], h);
  }
  return du;
}

}  // namespace srm
