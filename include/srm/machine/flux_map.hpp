// A measured or computed machine: one co-energy spline over current and angle.
//
//   W_c(i, theta_e) = sum_m B_m(theta_e) w_jm(i - i_j)     i_j <= i < i_j+1
//
// B_m are the cubic B-splines on equal angle cells (C2), w_jm polynomials of degree 4 in the
// current above the knot i_j. psi = dW_c/di is then a cubic C2 spline in i, and all five outputs
// are exact derivatives of the same polynomial, so that no interpolation can create energy.
//
// The last piece has no end. Its terms of degree 3 and 4 are zero: past i_max the flux continues
// with its last slope at every angle, and stays the derivative of a co-energy.
//
// The current direction is stored as polynomials, not as B-spline coefficients: L_inc would be a
// second difference of co-energies, which loses 3 of the 7 digits of a float once saturated.
//
// B-splines: C. de Boor, A Practical Guide to Splines, rev. ed. 2001, ch. IX-XI.
#pragma once

#include <cstdint>

#include "srm/base/fields.hpp"
#include "srm/base/view.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

/// A view of tables that live elsewhere: in flash on the target, in a vector on the desk.
template <Real T>
struct FluxMap {
  using Scalar = T;
  static constexpr int n_power = 5;         // powers 0..4 of the current
  static constexpr bool may_couple = true;  // a machine of this model may have pairs of phases

  int N_r;                   // rotor poles
  int n_i;                   // current pieces, the open last one included
  int n_theta;               // angle cells
  int n_slot;                // slots of the piece table
  T theta_span;              // pi: even about 0 and pi; 2 pi: a whole period
  T cells_per_rad;           // n_theta / theta_span
  T slots_per_A;             // a slot is no wider than the narrowest piece
  View<T> knot;              // (n_i) current at the start of each piece; 0 first, i_max last [A]
  View<std::uint8_t> piece;  // (n_slot) piece at the start of each slot
  View<T> coefficient;       // (n_i, n_theta + 3, n_power) of W_c; powers run fastest [J/A^p]
  SRM_FIELDS(N_r, n_i, n_theta, n_slot, theta_span, cells_per_rad, slots_per_A, knot, piece,
             coefficient)

  /// i >= 0 [A], theta_e in [0, 2 pi).
  constexpr Magnetics<T> at(T i, T theta_e) const {
    T theta = theta_e;
    T slope = T(N_r) * cells_per_rad;  // d(cell coordinate)/dtheta_m
    if (theta > theta_span) {          // the half past alignment mirrors the half before it
      theta = two_pi<T> - theta;
      slope = -slope;
    }
    const T y = theta * cells_per_rad;
    const int m = static_cast<int>(clamp(y, T(0), T(n_theta - 1)));
    const T v = y - static_cast<T>(m);
    // The four cubic B-splines on this cell and their slopes. Each set is closed by its sum, 1 and
    // 0, so that torque at an angle of symmetry is zero to the last bit.
    const T v2 = v * v;
    const T rest = T(1) - v;
    const T b0 = rest * rest * rest * T(1.0 / 6);
    const T b3 = v2 * v * T(1.0 / 6);
    const T b1 = T(2.0 / 3) - v2 + v2 * v * T(0.5);
    const T b2 = T(1) - b0 - b1 - b3;
    const T d0 = rest * rest * T(-0.5);
    const T d3 = v2 * T(0.5);
    const T d1 = v2 * T(1.5) - T(2) * v;
    const T d2 = -(d0 + d1 + d3);

    const int j = piece_of(i);
    const T u = i - knot[j];
    const T* c = coefficient.data + (j * (n_theta + 3) + m) * n_power;
    T w[n_power], dw[n_power];  // polynomial in u at this angle, and its slope over the cell
    for (int p = 0; p < n_power; ++p) {
      const T c0 = c[p], c1 = c[p + n_power], c2 = c[p + 2 * n_power], c3 = c[p + 3 * n_power];
      w[p] = c0 * b0 + c1 * b1 + c2 * b2 + c3 * b3;
      dw[p] = c0 * d0 + c1 * d1 + c2 * d2 + c3 * d3;
    }
    return {.psi = w[1] + u * (T(2) * w[2] + u * (T(3) * w[3] + u * (T(4) * w[4]))),
            .W_c = w[0] + u * (w[1] + u * (w[2] + u * (w[3] + u * w[4]))),
            .tau = slope * (dw[0] + u * (dw[1] + u * (dw[2] + u * (dw[3] + u * dw[4])))),
            .L_inc = T(2) * w[2] + u * (T(6) * w[3] + u * (T(12) * w[4])),
            .psi_theta =
                slope * (dw[1] + u * (T(2) * dw[2] + u * (T(3) * dw[3] + u * (T(4) * dw[4]))))};
  }

  /// i >= 0 [A], theta_e in [0, 2 pi). The weights are those of `at`.
  constexpr Jet<T> jet(T i, T theta_e) const {
    T theta = theta_e;
    T slope = T(N_r) * cells_per_rad;
    if (theta > theta_span) {
      theta = two_pi<T> - theta;
      slope = -slope;
    }
    const T y = theta * cells_per_rad;
    const int m = static_cast<int>(clamp(y, T(0), T(n_theta - 1)));
    const T v = y - static_cast<T>(m);
    const T v2 = v * v;
    const T rest = T(1) - v;
    const T b[4] = {rest * rest * rest * T(1.0 / 6), T(2.0 / 3) - v2 + v2 * v * T(0.5),
                    T(1.0 / 6) + (v + v2 - v2 * v) * T(0.5), v2 * v * T(1.0 / 6)};
    const T d0 = rest * rest * T(-0.5), d1 = v2 * T(1.5) - T(2) * v, d3 = v2 * T(0.5);
    const T d[4] = {d0, d1, -(d0 + d1 + d3), d3};
    const T s[4] = {rest, T(3) * v - T(2), T(1) - T(3) * v, v};  // second derivatives

    const int j = piece_of(i);
    const T u = i - knot[j];
    const T* c = coefficient.data + (j * (n_theta + 3) + m) * n_power;
    T w[n_power]{}, dw[n_power]{}, sw[n_power]{};
    for (int n = 0; n < 4; ++n) {
      for (int p = 0; p < n_power; ++p) {
        const T c_np = c[n * n_power + p];
        w[p] += c_np * b[n];
        dw[p] += c_np * d[n];
        sw[p] += c_np * s[n];
      }
    }
    const auto value = [u](const T(&a)[n_power]) {
      return a[0] + u * (a[1] + u * (a[2] + u * (a[3] + u * a[4])));
    };
    const auto first = [u](const T(&a)[n_power]) {
      return a[1] + u * (T(2) * a[2] + u * (T(3) * a[3] + u * (T(4) * a[4])));
    };
    const auto second = [u](const T(&a)[n_power]) {
      return T(2) * a[2] + u * (T(6) * a[3] + u * (T(12) * a[4]));
    };
    return {.psi = first(w),
            .tau = slope * value(dw),
            .L_inc = second(w),
            .psi_theta = slope * first(dw),
            .tau_theta = slope * slope * value(sw),
            .L_i = T(6) * w[3] + u * (T(24) * w[4]),
            .L_theta = slope * second(dw),
            .psi_theta_2 = slope * slope * first(sw)};
  }

  /// Index of the piece that holds i. A slot has at most one knot inside, so one comparison settles
  /// it; NaN and negative currents give the first piece.
  constexpr int piece_of(T i) const {
    const int slot = static_cast<int>(clamp(i * slots_per_A, T(0), T(n_slot - 1)));
    const int j = piece[slot];
    return j + 1 < n_i && i >= knot[j + 1] ? j + 1 : j;
  }

 public:
  /// The name of what is wrong; null where nothing is.
  constexpr const char* fault() const {
    if (N_r < 1 || N_r > 1000) return "N_r";
    const bool sizes = n_i >= 2 && n_i <= 255 && n_theta >= 2 && n_theta <= 100000 && n_slot >= 1 &&
                       knot.size == n_i && piece.size == n_slot &&
                       coefficient.size == n_i * (n_theta + 3) * n_power;
    if (!sizes) return "sizes of the flux map";
    for (int j = 1; j < n_i; ++j) {
      if (!(knot[j] > knot[j - 1])) return "knots of the flux map";
    }
    for (const int j : piece) {
      if (j >= n_i) return "slots of the flux map";
    }
    if (!is_positive(theta_span) || !is_positive(cells_per_rad) || !is_positive(slots_per_A)) {
      return "spans of the flux map";
    }
    return inductance_bound(*this) > T(0) ? nullptr : "inductance of the flux map";
  }
};

/// Last current of the table [A].
template <Real T>
constexpr T i_last(const FluxMap<T>& map) {
  return map.knot[map.n_i - 1];
}

/// True where the answer is a continuation of the table, not the table.
template <Real T>
constexpr bool extrapolates(const FluxMap<T>& map, T i) {
  return i > i_last(map);
}

/// A lower bound of the incremental inductance at every current and angle [H]; > 0 proves that flux
/// rises with current everywhere.
///
/// On a piece of width h, w''(u) is a quadratic, and lies above the least of its Bernstein
/// coefficients w''(0), w''(0) + h w'''(0)/2, w''(h); over the angle L_inc is a mean of these with
/// weights B_m >= 0.
template <Real T>
constexpr T inductance_bound(const FluxMap<T>& map) {
  T least = T(2) * map.coefficient[2];
  for (int j = 0; j < map.n_i; ++j) {
    const T h = j + 1 < map.n_i ? map.knot[j + 1] - map.knot[j] : T(0);
    for (int m = 0; m < map.n_theta + 3; ++m) {
      const T* c = map.coefficient.data + (j * (map.n_theta + 3) + m) * FluxMap<T>::n_power;
      const T left = T(2) * c[2];
      const T middle = left + T(3) * h * c[3];
      const T right = left + h * (T(6) * c[3] + h * (T(12) * c[4]));
      least = min(least, min(left, min(middle, right)));
    }
  }
  return least;
}

}  // namespace srm
