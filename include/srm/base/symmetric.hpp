// Small symmetric positive definite systems over some of the phases.
#pragma once

#include <array>

#include "srm/base/real.hpp"

namespace srm {

template <Real T, int N>
using Square = std::array<std::array<T, N>, N>;

/// Factors M over the rows and columns that are taken, for `solve`: on the diagonal and above it is
/// what elimination leaves, below it the multiples. M is symmetric and positive definite there.
template <Real T, int N>
constexpr void factor(const std::array<bool, N>& taken, Square<T, N>& M) {
  for (int p = 0; p < N; ++p) {
    if (!taken[p]) continue;
    for (int k = p + 1; k < N; ++k) {
      if (!taken[k]) continue;
      const T part = M[k][p] / M[p][p];
      M[k][p] = part;
      for (int l = p + 1; l < N; ++l) {
        if (taken[l]) M[k][l] = M[k][l] - part * M[p][l];
      }
    }
  }
}

/// x becomes the solution of M y = x, where M is factored; it is zero for what is not taken.
template <Real T, int N>
constexpr void solve(const std::array<bool, N>& taken, const Square<T, N>& M, std::array<T, N>& x) {
  for (int p = 0; p < N; ++p) {
    if (!taken[p]) {
      x[p] = T(0);
      continue;
    }
    for (int k = p + 1; k < N; ++k) {
      if (taken[k]) x[k] = x[k] - M[k][p] * x[p];
    }
  }
  for (int p = N - 1; p >= 0; --p) {
    if (!taken[p]) continue;
    for (int l = p + 1; l < N; ++l) {
      if (taken[l]) x[p] = x[p] - M[p][l] * x[l];
    }
    x[p] = x[p] / M[p][p];
  }
}

/// Solves M y = x over the rows and columns that are taken; y is zero elsewhere. M is symmetric and
/// positive definite there.
template <Real T, int N>
[[gnu::noinline]] constexpr std::array<T, N> solved(const std::array<bool, N>& taken,
                                                    Square<T, N> M, std::array<T, N> x) {
  factor<T, N>(taken, M);
  solve<T, N>(taken, M, x);
  return x;
}

}  // namespace srm
