// Phases that share iron: what two currents at once add to the co-energy of each alone.
//
// With currents a and b of the first and the second phase, the first at the electrical angle
// phi + delta/2 and the second at phi - delta/2, delta apart as they follow each other,
//
//   W_c(phi, a, b) = sum over p, q of C_pq(phi) f_p(a) f_q(b),    W_c(phi, a, b) = W_c(-phi, b, a).
//
// f are cubics on pieces of the current, with two continuous derivatives; the last piece has no
// end. Past the currents of the tables they end in constants: what goes on for ever would make the
// inductance negative (python/reluctance/machine/maps/pairs.py). C are cubic B-splines on equal
// cells of half a period (C2), as in flux_map.hpp. All outputs are exact derivatives of the one
// function, so a pair keeps the energy.
//
// A winding has pairs of one or two kinds, poles of like and of opposite polarity, with a table
// each. All tables have the same cells, pieces and number of functions. A default Coupling has no
// pairs: the phases do not couple.
#pragma once

#include <array>
#include <cstdint>

#include "srm/base/fields.hpp"
#include "srm/base/view.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

/// What a pair adds to its two phases. Angle derivatives are per mechanical radian.
template <Real T>
struct PairMagnetics {
  T W_c{};                                  // co-energy [J]
  T tau{};                                  // torque [N m]
  T psi_first{}, psi_second{};              // flux linkages [Wb]
  T L_first{}, L_second{}, L_mutual{};      // incremental inductances [H]
  T psi_theta_first{}, psi_theta_second{};  // [Wb/rad]
  T tau_theta{};                            // [N m/rad]
};

/// The part of it that an estimate of the angle needs.
template <Real T>
struct PairFlux {
  T tau{};                                  // torque [N m]
  T psi_first{}, psi_second{};              // flux linkages [Wb]
  T psi_theta_first{}, psi_theta_second{};  // [Wb/rad]
};

/// A view of tables that live elsewhere.
template <Real T>
struct Coupling {
  using Scalar = T;
  static constexpr int most_functions = 8;
  static constexpr int n_power = 4;  // powers 0..3 of the current

  int N_r{};                               // rotor poles
  int n_i{};                               // current pieces, the open last one included
  int n_phi{};                             // angle cells of half a period
  int rank{};                              // functions of one current
  T factor = T(1);                         // on all of it [1]
  T cells_per_rad{};                       // n_phi / pi
  View<std::uint8_t> first, second, kind;  // (n_pairs) phases, and the table of each pair
  View<T> behind;  // (n_pairs) electrical angle of phase 0 less phi, in [0, 2 pi) [rad]
  View<T> knot;    // (n_i) current at the start of each piece; 0 first [A]
  View<T> f;       // (n_kinds, n_i, rank, n_power), powers of the current above the knot
  View<T> C;       // (n_kinds, n_phi + 3, rank, rank) [J]
  SRM_FIELDS(N_r, n_i, n_phi, rank, factor, cells_per_rad, first, second, kind, behind, knot, f, C)

  constexpr int n_pairs() const { return first.size; }
  /// True where they add something.
  constexpr bool any() const { return n_pairs() > 0 && factor != T(0); }

  /// Torque of all pairs [N m]. i: of N phases >= 0 [A]; theta_e: of phase 0 in [0, 2 pi).
  template <class Currents>
  constexpr T torque(const Currents& i, T theta_e) const {
    T tau = T(0);
    for (int n = 0; n < n_pairs(); ++n) {
      const T a = i[first[n]], b = i[second[n]];
      if (a > T(0) && b > T(0)) tau = tau + torque(n, a, b, theta_e);
    }
    return tau;
  }

  /// What the phases alone have to give of a torque that is asked for [N m]: it keeps its sign, and
  /// zero stays zero.
  template <class Currents>
  constexpr T left_for_phases(T asked, const Currents& i, T theta_e) const {
    if (asked == T(0)) return asked;
    const T left = asked - torque(i, theta_e);
    return asked > T(0) ? max(left, T(0)) : min(left, T(0));
  }

  /// Torque of pair n at currents of its phases [N m].
  constexpr T torque(int n, T a, T b, T theta_e) const {
    const Cell at = cell(n, theta_e);
    const T x = at.mirrored ? b : a, y = at.mirrored ? a : b;
    const T v = at.v, v2 = v * v, rest = T(1) - v;
    const T d0 = rest * rest * T(-0.5), d1 = v2 * T(1.5) - T(2) * v, d3 = v2 * T(0.5);
    const T d2 = -(d0 + d1 + d3);
    T fx[most_functions], fy[most_functions];
    values(n, x, fx);
    values(n, y, fy);
    const int next = rank * rank;
    const T* c = splines(n, at);
    T tau = T(0);
    for (int p = 0; p < rank; ++p) {
      T row = T(0);
      for (int q = 0; q < rank; ++q, ++c) {
        row = row + (c[0] * d0 + c[next] * d1 + c[2 * next] * d2 + c[3 * next] * d3) * fy[q];
      }
      tau = tau + row * fx[p];
    }
    return slope_of(at) * tau;
  }

  /// Flux linkages and torque of pair n, as `at`.
  constexpr PairFlux<T> flux(int n, T a, T b, T theta_e) const {
    const Cell here = cell(n, theta_e);
    const Weights value = Weights::of_value(here.v), slope = Weights::of_slope(here.v);
    T x[2][most_functions], y[2][most_functions];
    slopes(n, here.mirrored ? b : a, x);
    slopes(n, here.mirrored ? a : b, y);
    PairFlux<T> m;
    const int next = rank * rank;
    const T* c = splines(n, here);
    for (int p = 0; p < rank; ++p) {
      T u0 = T(0), u1 = T(0), s0 = T(0), s1 = T(0);
      for (int q = 0; q < rank; ++q, ++c) {
        const T C_here = value.of(c, next), C_v = slope.of(c, next);
        u0 = u0 + C_here * y[0][q];
        u1 = u1 + C_here * y[1][q];
        s0 = s0 + C_v * y[0][q];
        s1 = s1 + C_v * y[1][q];
      }
      m.tau = m.tau + x[0][p] * s0;
      m.psi_first = m.psi_first + x[1][p] * u0;
      m.psi_second = m.psi_second + x[0][p] * u1;
      m.psi_theta_first = m.psi_theta_first + x[1][p] * s0;
      m.psi_theta_second = m.psi_theta_second + x[0][p] * s1;
    }
    const T turn = slope_of(here);
    m = {turn * m.tau, factor * m.psi_first, factor * m.psi_second, turn * m.psi_theta_first,
         turn * m.psi_theta_second};
    if (here.mirrored) {
      swap(m.psi_first, m.psi_second);
      swap(m.psi_theta_first, m.psi_theta_second);
    }
    return m;
  }

  /// Pair n at currents of its phases >= 0 [A] and the electrical angle of phase 0 in [0, 2 pi).
  constexpr PairMagnetics<T> at(int n, T a, T b, T theta_e) const {
    const Cell here = cell(n, theta_e);
    const Functions x = functions(n, here.mirrored ? b : a);
    const Functions y = functions(n, here.mirrored ? a : b);
    const T v = here.v, rest = T(1) - v;
    const Weights value = Weights::of_value(v), slope = Weights::of_slope(v);
    const Weights curve{{rest, T(3) * v - T(2), T(1) - T(3) * v, v}};
    PairMagnetics<T> m{};
    const int next = rank * rank;
    const T* c = splines(n, here);
    for (int p = 0; p < rank; ++p) {
      T u[3]{}, s[2]{}, t = T(0);
      for (int q = 0; q < rank; ++q, ++c) {
        const T here_C = value.of(c, next), C_v = slope.of(c, next), C_vv = curve.of(c, next);
        for (int d = 0; d < 3; ++d) u[d] = u[d] + here_C * y.f[d][q];
        for (int d = 0; d < 2; ++d) s[d] = s[d] + C_v * y.f[d][q];
        t = t + C_vv * y.f[0][q];
      }
      const T f0 = x.f[0][p], f1 = x.f[1][p], f2 = x.f[2][p];
      m.W_c = m.W_c + f0 * u[0];
      m.psi_first = m.psi_first + f1 * u[0];
      m.psi_second = m.psi_second + f0 * u[1];
      m.L_first = m.L_first + f2 * u[0];
      m.L_second = m.L_second + f0 * u[2];
      m.L_mutual = m.L_mutual + f1 * u[1];
      m.tau = m.tau + f0 * s[0];
      m.psi_theta_first = m.psi_theta_first + f1 * s[0];
      m.psi_theta_second = m.psi_theta_second + f0 * s[1];
      m.tau_theta = m.tau_theta + f0 * t;
    }
    const T turn = slope_of(here);
    for (T* k : {&m.W_c, &m.psi_first, &m.psi_second, &m.L_first, &m.L_second, &m.L_mutual}) {
      *k = factor * *k;
    }
    for (T* k : {&m.tau, &m.psi_theta_first, &m.psi_theta_second}) *k = turn * *k;
    const T per_rad = T(N_r) * cells_per_rad;
    m.tau_theta = factor * per_rad * per_rad * m.tau_theta;
    if (here.mirrored) {
      swap(m.psi_first, m.psi_second);
      swap(m.L_first, m.L_second);
      swap(m.psi_theta_first, m.psi_theta_second);
    }
    return m;
  }

  /// Where an angle is in the table of a pair.
  struct Cell {
    bool mirrored;  // the other half of the period: the two currents change places
    int m;          // its number
    T v;            // the place within it
  };
  constexpr Cell cell(int n, T theta_e) const {
    T phi = theta_e - behind[n];
    if (phi < T(0)) phi = phi + two_pi<T>;
    const bool mirrored = phi > pi<T>;
    if (mirrored) phi = two_pi<T> - phi;
    const T y = phi * cells_per_rad;
    const int m = static_cast<int>(clamp(y, T(0), T(n_phi - 1)));
    return {mirrored, m, y - static_cast<T>(m)};
  }
  /// The first of the four B-splines of a cell, (rank, rank).
  constexpr const T* splines(int n, const Cell& at) const {
    return C.data + (kind[n] * (n_phi + 3) + at.m) * rank * rank;
  }

  /// Index of the piece that holds a current; NaN and negative ones give the first.
  constexpr int piece_of(T i) const {
    int j = 0;
    while (j + 1 < n_i && i >= knot[j + 1]) ++j;
    return j;
  }
  /// Its functions, powers of the current above its knot.
  constexpr const T* functions_of(int n, int j) const {
    return f.data + (kind[n] * n_i + j) * rank * n_power;
  }

  /// The name of what is wrong, for N phases; null where nothing is.
  constexpr const char* fault(int N) const {
    if (n_pairs() == 0) return nullptr;
    const bool sizes = N_r >= 1 && n_pairs() <= N * (N - 1) && n_i >= 2 && n_i <= 255 &&
                       n_phi >= 2 && n_phi <= 10000 && rank >= 1 && rank <= most_functions &&
                       second.size == n_pairs() && kind.size == n_pairs() &&
                       behind.size == n_pairs() && knot.size == n_i;
    if (!sizes) return "sizes of the pairs";
    int kinds = 0;
    for (int n = 0; n < n_pairs(); ++n) {
      if (first[n] >= N || second[n] >= N || first[n] == second[n]) return "phases of the pairs";
      if (!(behind[n] >= T(0) && behind[n] < two_pi<T>)) return "angles of the pairs";
      if (kind[n] >= kinds) kinds = kind[n] + 1;
    }
    if (f.size != kinds * n_i * rank * n_power) return "functions of the pairs";
    if (C.size != kinds * (n_phi + 3) * rank * rank) return "tables of the pairs";
    for (int j = 1; j < n_i; ++j) {
      if (!(knot[j] > knot[j - 1])) return "currents of the pairs";
    }
    return is_positive(cells_per_rad) ? nullptr : "cells of the pairs";
  }

 private:
  /// d(cell coordinate)/dtheta_m, with the factor on all.
  constexpr T slope_of(const Cell& at) const {
    const T rising = factor * static_cast<T>(N_r) * cells_per_rad;
    return at.mirrored ? -rising : rising;
  }

  /// The polynomials of the piece that holds a current, which becomes the one above its knot.
  constexpr const T* piece(int n, T& i) const {
    const int j = piece_of(i);
    i = i - knot[j];
    return functions_of(n, j);
  }

  constexpr void values(int n, T i, T* to) const {
    const T* c = piece(n, i);
    for (int p = 0; p < rank; ++p, c += n_power) {
      to[p] = c[0] + i * (c[1] + i * (c[2] + i * c[3]));
    }
  }

  /// Functions of a current and their slopes.
  constexpr void slopes(int n, T i, T (&to)[2][most_functions]) const {
    const T* c = piece(n, i);
    for (int p = 0; p < rank; ++p, c += n_power) {
      to[0][p] = c[0] + i * (c[1] + i * (c[2] + i * c[3]));
      to[1][p] = c[1] + i * (T(2) * c[2] + i * (T(3) * c[3]));
    }
  }

  /// Functions of a current and their first two derivatives.
  struct Functions {
    T f[3][most_functions];
  };
  constexpr Functions functions(int n, T i) const {
    Functions g;
    const T* c = piece(n, i);
    for (int p = 0; p < rank; ++p, c += n_power) {
      const T bend = T(2) * c[2], more = T(3) * c[3];
      g.f[0][p] = c[0] + i * (c[1] + i * (c[2] + i * c[3]));
      g.f[1][p] = c[1] + i * (bend + i * more);
      g.f[2][p] = bend + i * (T(2) * more);
    }
    return g;
  }

  /// Weights of the four B-splines on a cell.
  struct Weights {
    T w[4];

    static constexpr Weights of_value(T v) {
      const T v2 = v * v, rest = T(1) - v;
      const T b0 = rest * rest * rest * T(1.0 / 6), b3 = v2 * v * T(1.0 / 6);
      const T b1 = T(2.0 / 3) - v2 + v2 * v * T(0.5);
      return {{b0, b1, T(1) - b0 - b1 - b3, b3}};
    }
    static constexpr Weights of_slope(T v) {
      const T v2 = v * v, rest = T(1) - v;
      const T d0 = rest * rest * T(-0.5), d1 = v2 * T(1.5) - T(2) * v, d3 = v2 * T(0.5);
      return {{d0, d1, -(d0 + d1 + d3), d3}};
    }

    constexpr T of(const T* c, int next) const {
      return c[0] * w[0] + c[next] * w[1] + c[2 * next] * w[2] + c[3 * next] * w[3];
    }
  };

  static constexpr void swap(T& one, T& other) {
    const T kept = one;
    one = other;
    other = kept;
  }
};

/// From which on the last piece holds [A].
template <Real T>
constexpr T i_last(const Coupling<T>& coupling) {
  return coupling.knot[coupling.n_i - 1];
}

}  // namespace srm
