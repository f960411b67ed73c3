// Least squares in four unknowns, recursively: sums of products that old rows fade from.
//
// A row says that a small change d of the unknowns should make phi . d = r. The sums are those of
// phi phi' and phi r; when the unknowns have moved by d, phi r becomes phi (r - phi . d). So the
// right side stays a sum of small residuals, and single precision loses no digits in it.
//
// A direction that the rows do not show stays where it is: the sums are made larger by a very small
// part of their trace before they are solved (Tikhonov's regularisation).
#pragma once

#include <array>

#include "srm/base/real.hpp"

namespace srm {

template <Real T>
struct NormalEquations {
  static constexpr int n = 4;
  using Vector = std::array<T, n>;
  static constexpr T weak = T(3e-7);  // this part of the trace: some roundings of single precision

  std::array<T, n*(n + 1) / 2> A{};  // sum of phi phi', the lower triangle by rows
  Vector g{};                        // sum of phi r

  constexpr void add(const Vector& phi, T r) {
    for (int row = 0, place = 0; row < n; ++row) {
      g[row] = g[row] + phi[row] * r;
      for (int column = 0; column <= row; ++column, ++place) {
        A[place] = A[place] + phi[row] * phi[column];
      }
    }
  }

  /// `keep` of these rows, and those of other sums.
  constexpr void take(const NormalEquations& more, T keep) {
    for (std::size_t j = 0; j < A.size(); ++j) A[j] = keep * A[j] + more.A[j];
    for (int row = 0; row < n; ++row) g[row] = keep * g[row] + more.g[row];
  }

  /// The unknowns have moved by d.
  constexpr void moved(const Vector& d) {
    for (int row = 0; row < n; ++row) {
      for (int column = 0; column < n; ++column) g[row] = g[row] - at(row, column) * d[column];
    }
  }

  constexpr T trace() const { return A[0] + A[2] + A[5] + A[9]; }

  /// The change of the unknowns that the rows ask for; none without rows.
  constexpr Vector solve() const {
    Vector d{};
    if (!(trace() > T(0))) return d;
    std::array<Vector, n> M;
    for (int row = 0; row < n; ++row) {
      for (int column = 0; column < n; ++column) M[row][column] = at(row, column);
      M[row][row] = M[row][row] + weak * trace();
      d[row] = g[row];
    }
    for (int p = 0; p < n; ++p) {
      const T inverse = T(1) / M[p][p];
      for (int row = p + 1; row < n; ++row) {
        const T factor = M[row][p] * inverse;
        for (int column = p; column < n; ++column) {
          M[row][column] = M[row][column] - factor * M[p][column];
        }
        d[row] = d[row] - factor * d[p];
      }
    }
    for (int row = n - 1; row >= 0; --row) {
      for (int column = row + 1; column < n; ++column) d[row] = d[row] - M[row][column] * d[column];
      d[row] = d[row] / M[row][row];
    }
    return d;
  }

 private:
  constexpr T at(int row, int column) const {
    const int low = row > column ? row : column, left = row > column ? column : row;
    return A[low * (low + 1) / 2 + left];
  }
};

}  // namespace srm
