// The analytic machine of Le-Huy and Brunelle: two magnetisation curves and one shape between them.
//
// H. Le-Huy, P. Brunelle, "A versatile nonlinear switched reluctance motor model in Simulink using
// realistic and analytical magnetization characteristics", IECON 2005, pp. 1556-1561.
//
// clang-format off
//   aligned    psi_a(i) = L_sat i + A (1 - e^(-B i)),  A = psi_m - L_sat i_m,  B = (L_a - L_sat)/A
//   unaligned  psi_u(i) = L_u i
//   between    psi = psi_u + (psi_a - psi_u) f,        f(x) = x^2 (3 - 2 x),   x = theta_e/pi
//   co-energy  W_c = L_u i^2/2 + G(i) f,  G = (L_sat - L_u) i^2/2 + A i - (A/B)(1 - e^(-B i))
// clang-format on
//
// f is the only cubic with f(unaligned) = 0, f(aligned) = 1 and no slope at either. The source
// paper prints it with a wrong sign and closes the torque bracket too early: docs/paper.md, errata
// 4, 5.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

template <Real T>
struct LeHuy {
  using Scalar = T;

  int N_r;  // rotor poles
  T L_u;    // unaligned inductance [H]
  T L_sat;  // aligned incremental inductance, fully saturated [H]
  T A;      // flux that saturates [Wb]
  T B;      // saturation rate [1/A]
  T i_sat;  // 1/B, so that no evaluation divides [A]
  SRM_FIELDS(N_r, L_u, L_sat, A, B, i_sat)

  /// i >= 0 [A], theta_e in [0, 2 pi).
  [[gnu::always_inline]] constexpr Magnetics<T> at(T i, T theta_e) const {
    T x = theta_e * (T(1) / pi<T>);
    T slope = T(N_r) * T(6) / pi<T>;  // df/dtheta_m = slope x (1 - x)
    if (x > T(1)) {                   // the half past alignment mirrors the half before it
      x = T(2) - x;
      slope = -slope;
    }
    const T f = x * x * (T(3) - T(2) * x);
    const T df = slope * x * (T(1) - x);
    const T E = exp(-B * i);
    const T rise = (L_sat - L_u) * i + A * (T(1) - E);  // psi_a - psi_u
    const T G = (L_sat - L_u) * i * i * T(0.5) + A * (i - i_sat * (T(1) - E));
    return {.psi = L_u * i + rise * f,
            .W_c = L_u * i * i * T(0.5) + G * f,
            .tau = G * df,
            .L_inc = L_u + (L_sat - L_u + A * B * E) * f,
            .psi_theta = rise * df};
  }

  /// The name of what is wrong; null where nothing is.
  constexpr const char* fault() const {
    if (N_r < 1 || N_r > 1000) return "N_r";
    const bool all = is_positive(L_u) && is_positive(L_sat) && is_positive(A) && is_positive(B) &&
                     is_positive(i_sat);
    return all ? nullptr : "L_u, L_sat, A, B, i_sat of the machine";
  }

  /// i >= 0 [A], theta_e in [0, 2 pi).
  constexpr Jet<T> jet(T i, T theta_e) const {
    const T per_rad = T(N_r) * (T(1) / pi<T>);  // dx/dtheta_m
    T x = theta_e * (T(1) / pi<T>);
    T slope = T(6) * per_rad;
    if (x > T(1)) {
      x = T(2) - x;
      slope = -slope;
    }
    const T f = x * x * (T(3) - T(2) * x);
    const T df = slope * x * (T(1) - x);
    const T d2f = T(6) * per_rad * per_rad * (T(1) - T(2) * x);
    const T E = exp(-B * i);
    const T rise = (L_sat - L_u) * i + A * (T(1) - E);
    const T G = (L_sat - L_u) * i * i * T(0.5) + A * (i - i_sat * (T(1) - E));
    const T ABE = A * B * E;
    const T rise_i = L_sat - L_u + ABE;
    return {.psi = L_u * i + rise * f,
            .tau = G * df,
            .L_inc = L_u + rise_i * f,
            .psi_theta = rise * df,
            .tau_theta = G * d2f,
            .L_i = -B * ABE * f,
            .L_theta = rise_i * df,
            .psi_theta_2 = rise * d2f};
  }
};

/// The model from its datasheet quantities: unaligned and unsaturated aligned inductance, saturated
/// slope [H], and one point (i_m, psi_m) of the aligned curve [A, Wb].
template <Real T>
constexpr LeHuy<T> lehuy(int N_r, T L_u, T L_a, T L_sat, T i_m, T psi_m) {
  const T A = psi_m - L_sat * i_m;
  const T B = (L_a - L_sat) / A;
  return {.N_r = N_r, .L_u = L_u, .L_sat = L_sat, .A = A, .B = B, .i_sat = T(1) / B};
}

}  // namespace srm
