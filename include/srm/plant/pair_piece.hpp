// A pair of phases where its tables are one polynomial: in a cell of the angle and in a piece of
// each current.
//
// From step to step a pair mostly stays in its cell and pieces. There its co-energy is
//
//   W_c = sum over r, m, n of c_rnm z^r a^m b^n,    r, m, n = 0..3,
//
// with z the rotor angle past the begin of the cell and a, b the currents above those of their
// pieces. The polynomial is the function of the tables (coupling.hpp), so it takes the place of
// their evaluation and has all derivatives that the plant needs.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "srm/machine/coupling.hpp"

namespace srm {

/// What two phases that flow have beyond the derivatives of each.
struct Link {
  int first{}, second{};         // the phases
  double L{};                    // dpsi_first/di_second [H]
  double L_theta{};              // its derivative in theta_m [H/rad]
  double L_first{}, L_second{};  // its derivatives in the two currents [H/A]
};

/// What a pair adds to its phases. Half of its torque counts to each.
struct PairJet {
  Jet<double> first, second;
  Link link;
};

/// The polynomial where a pair was evaluated last. It follows from the tables: no answer depends on
/// what was asked before.
class PairPiece {
 public:
  /// Pair n at currents of its phases [A] and the electrical angle of phase 0 in [0, 2 pi).
  PairJet jet(const Coupling<double>& pairs, int n, double a, double b, double theta_e) {
    const double z = enter(pairs, n, a, b, theta_e);
    a -= first_.begin;
    b -= second_.begin;
    // Polynomials of both currents, the n-th their n-th Taylor coefficient in the angle.
    double of_both[3][16];
    for (int j = 0; j < 16; ++j) {
      const Taylor y(c_[j], c_[16 + j], c_[32 + j], c_[48 + j], z);
      of_both[0][j] = y.c0;
      of_both[1][j] = y.c1;
      of_both[2][j] = y.c2;
    }
    // Of the first current, the n-th their n-th Taylor coefficient in the second.
    double w[4][4], s[3][4], t[2][4];
    for (int m = 0; m < 4; ++m) {
      const auto along = [&](const double(&c)[16]) {
        return Taylor(c[m], c[4 + m], c[8 + m], c[12 + m], b);
      };
      const Taylor value = along(of_both[0]), slope = along(of_both[1]), bend = along(of_both[2]);
      w[0][m] = value.c0;
      w[1][m] = value.c1;
      w[2][m] = value.c2;
      w[3][m] = value.c3;
      s[0][m] = slope.c0;
      s[1][m] = slope.c1;
      s[2][m] = slope.c2;
      t[0][m] = bend.c0;
      t[1][m] = bend.c1;
    }
    const auto along = [&](const double(&c)[4]) { return Taylor(c[0], c[1], c[2], c[3], a); };
    const Taylor w0 = along(w[0]), w1 = along(w[1]), w2 = along(w[2]), w3 = along(w[3]);
    const Taylor s0 = along(s[0]), s1 = along(s[1]), s2 = along(s[2]);
    const Taylor t0 = along(t[0]), t1 = along(t[1]);
    const double tau = s0.c0 / 2, tau_theta = t0.c0;
    return {.first = {.psi = w0.c1,
                      .tau = tau,
                      .L_inc = 2 * w0.c2,
                      .psi_theta = s0.c1,
                      .tau_theta = tau_theta,
                      .L_i = 6 * w0.c3,
                      .L_theta = 2 * s0.c2,
                      .psi_theta_2 = 2 * t0.c1},
            .second = {.psi = w1.c0,
                       .tau = tau,
                       .L_inc = 2 * w2.c0,
                       .psi_theta = s1.c0,
                       .tau_theta = tau_theta,
                       .L_i = 6 * w3.c0,
                       .L_theta = 2 * s2.c0,
                       .psi_theta_2 = 2 * t1.c0},
            .link = {pairs.first[n], pairs.second[n], w1.c1, s1.c1, 2 * w1.c2, 2 * w2.c1}};
  }

  /// What `induced` is at most, while the other current is within the table [V].
  double most_induced(double rate, double omega_m) const {
    return most_L_ * std::abs(rate) + most_psi_theta_ * std::abs(omega_m);
  }

  /// The rate of the flux linkage of the one phase of pair n that has no current [V]. a, b: as in
  /// `jet`; rate: of the current of the other.
  double induced(const Coupling<double>& pairs, int n, double a, double b, double rate,
                 double theta_e, double omega_m) {
    const double z = enter(pairs, n, a, b, theta_e);
    const bool second = !(b > 0);  // has none
    const double i = second ? a - first_.begin : b - second_.begin;
    double value[4], slope[4];  // over the angle: polynomials of the other current
    for (int m = 0; m < 4; ++m) {
      const double* c = c_ + (second ? 4 + m : 4 * m + 1);
      const Taylor y(c[0], c[16], c[32], c[48], z);
      value[m] = y.c0;
      slope[m] = y.c1;
    }
    return Taylor(value[0], value[1], value[2], value[3], i).c1 * rate +
           omega_m * Taylor(slope[0], slope[1], slope[2], slope[3], i).c0;
  }

 private:
  using Cell = Coupling<double>::Cell;

  /// Where the polynomial holds.
  struct Range {
    double begin = 0, end = 0;
    bool has(double x) const { return x >= begin && x < end; }
  };

  /// A cubic around x: the coefficients of its powers there (by synthetic division).
  struct Taylor {
    double c0, c1, c2, c3;

    Taylor(double a0, double a1, double a2, double a3, double x) : c3(a3) {
      const double last = a3 * x, b2 = a2 + last, b1 = a1 + b2 * x, d2 = b2 + last;
      c0 = a0 + b1 * x;
      c1 = b1 + d2 * x;
      c2 = d2 + last;
    }
  };

  /// Makes sure of the polynomial; returns z.
  double enter(const Coupling<double>& pairs, int n, double a, double b, double theta_e) {
    const Cell here = pairs.cell(n, theta_e);
    const bool same = here.m == cell_.m && here.mirrored == cell_.mirrored;
    if (!(same && first_.has(a) && second_.has(b))) fill(pairs, n, a, b, here);
    return width_ * (here.mirrored ? 1 - here.v : here.v);
  }

  [[gnu::noinline]] void fill(const Coupling<double>& pairs, int n, double a, double b,
                              const Cell& cell) {
    if (cell_.m < 0) bound(pairs, n);
    cell_ = cell;
    width_ = 1 / (pairs.N_r * pairs.cells_per_rad);
    const double* f_first = enter(pairs, n, a, first_);
    const double* f_second = enter(pairs, n, b, second_);
    // Rows of the table belong to the first current, in the mirrored half to the second; there the
    // B-splines come in reverse.
    const int next = pairs.rank * pairs.rank, turn = cell.mirrored ? -next : next;
    const int first_step = cell.mirrored ? 1 : pairs.rank,
              second_step = pairs.rank + 1 - first_step;
    const double* begin_C = pairs.splines(n, cell) + (cell.mirrored ? 3 * next : 0);
    double sum[Coupling<double>::most_functions][4][4];  // of z and of the second current, for p
    for (int p = 0; p < pairs.rank; ++p) {
      double along[4][4]{};
      for (int q = 0; q < pairs.rank; ++q) {
        const double* C = begin_C + p * first_step + q * second_step;
        const double* f = f_second + 4 * q;
        const double C0 = C[0], C1 = C[turn], C2 = C[2 * turn], C3 = C[3 * turn];
        const double power[] = {(C0 + 4 * C1 + C2) / 6, (C2 - C0) / 2, (C0 - 2 * C1 + C2) / 2,
                                (C3 - C0 + 3 * (C1 - C2)) / 6};
        for (int r = 0; r < 4; ++r) {
          for (int l = 0; l < 4; ++l) along[r][l] += power[r] * f[l];
        }
      }
      std::memcpy(sum[p], along, sizeof along);
    }
    double scale = pairs.factor;
    for (int r = 0; r < 4; ++r, scale /= width_) {
      for (int l = 0; l < 4; ++l) {
        double c[4]{};
        for (int p = 0; p < pairs.rank; ++p) {
          for (int m = 0; m < 4; ++m) c[m] += sum[p][r][l] * f_first[4 * p + m];
        }
        for (int m = 0; m < 4; ++m) c_[16 * r + 4 * l + m] = scale * c[m];
      }
    }
  }

  /// The greatest mutual inductance and flux linkage over the angle where one current is zero. A
  /// B-spline is no greater than its coefficients, a function no greater than its powers.
  void bound(const Coupling<double>& pairs, int n) {
    constexpr int most = Coupling<double>::most_functions;
    double value[most]{}, slope[most]{};  // of each function, at most
    for (int j = 0; j + 1 < pairs.n_i; ++j) {
      const double d = pairs.knot[j + 1] - pairs.knot[j];
      const double* f = pairs.functions_of(n, j);
      for (int p = 0; p < pairs.rank; ++p, f += 4) {
        const double c[] = {std::abs(f[0]), std::abs(f[1]), std::abs(f[2]), std::abs(f[3])};
        value[p] = std::max(value[p], c[0] + d * (c[1] + d * (c[2] + d * c[3])));
        slope[p] = std::max(slope[p], c[1] + d * (2 * c[2] + d * 3 * c[3]));
      }
    }
    const int next = pairs.rank * pairs.rank;
    const double* at_zero = pairs.functions_of(n, 0);
    const double factor = std::abs(pairs.factor);
    most_L_ = most_psi_theta_ = 0;
    for (int m = 0; m < pairs.n_phi + 3; ++m) {
      const double* C = pairs.splines(n, {false, m, 0});
      for (const int along : {1, pairs.rank}) {
        const int across = pairs.rank + 1 - along;
        double L = 0, psi_theta = 0;
        for (int q = 0; q < pairs.rank; ++q) {
          double c = 0, rise = 0;
          for (int p = 0; p < pairs.rank; ++p) {
            const double* C_pq = C + p * across + q * along;
            c += at_zero[4 * p + 1] * *C_pq;
            if (m > 0) rise += at_zero[4 * p + 1] * (C_pq[0] - C_pq[-next]);
          }
          L += std::abs(c) * slope[q];
          psi_theta += std::abs(rise) * value[q];
        }
        most_L_ = std::max(most_L_, factor * L);
        most_psi_theta_ =
            std::max(most_psi_theta_, factor * psi_theta * pairs.N_r * pairs.cells_per_rad);
      }
    }
  }

  /// The functions of the piece that holds a current, and its ends.
  static const double* enter(const Coupling<double>& pairs, int n, double i, Range& range) {
    const int j = pairs.piece_of(i);
    constexpr double far = std::numeric_limits<double>::infinity();
    range = {pairs.knot[j], j + 1 < pairs.n_i ? pairs.knot[j + 1] : far};
    return pairs.functions_of(n, j);
  }

  Cell cell_{false, -1, 0};
  double width_ = 0;      // of the cell [rad]
  Range first_, second_;  // pieces [A]
  double c_[64]{};        // powers of z; of the second current; of the first
  double most_L_ = std::numeric_limits<double>::max();          // until it is filled; 0 of it is 0
  double most_psi_theta_ = std::numeric_limits<double>::max();  // [Wb/rad]
};

/// Of each pair.
using PairPieces = std::vector<PairPiece>;

}  // namespace srm
