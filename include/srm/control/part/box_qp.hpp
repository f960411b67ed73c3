// Strictly convex quadratic program on a box, for predictive control: primal active set.
//
//   minimise q(x) = 1/2 x'Hx + f'x  subject to  lo <= x <= hi,  H symmetric positive definite.
//
// Free variables F are the ones off the working set. One iteration solves H_FF d = -g_F with
// g = Hx + f (Cholesky). Inside the box: x + d is the minimum of this face, and every variable at a
// bound whose multiplier has the wrong sign is freed; none left means optimal. Outside: x + d is
// clipped to the box if that lowers q, else x moves along d to the first bound; what then sits on
// its bound is fixed. Nocedal & Wright, Numerical Optimization, 2006, 16.5 and 16.7.
//
// Every iterate is in the box and q never rises, so x may be used whenever the iteration stops.
//
// Termination, in exact arithmetic. (1) An iteration that leaves the box shrinks F, so after at
// most |F| of them a face minimum is reached. (2) Leaving a face minimum lowers q strictly: let D
// be the freed variables. g is zero on the rest of F, so g_D'd_D = -d'H_FF d < 0, and some variable
// of D moves inwards. A step of length zero fixes a variable that moves outwards, so it leaves
// another one of D free, and the same holds for the smaller F; a step of positive length lowers q.
// So a degenerate vertex cannot cycle on a box. (3) Each face has one minimum and q falls from one
// to the next: no face comes twice, and there are 3^n faces. Rounding is met by a tolerance on the
// multipliers and by the iteration limit.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "srm/base/real.hpp"

namespace srm {

template <Real T, int capacity>
struct BoxQp {
  using Vector = std::array<T, capacity>;
  int n{};                                            // variables, 1..capacity
  std::array<std::array<T, capacity>, capacity> H{};  // symmetric positive definite
  Vector f{};
  Vector lo{}, hi{};  // lo <= hi; equal fixes a variable, infinite frees it
};

enum class QpStatus : std::int8_t {
  solved,
  iteration_limit,        // x is in the box and no worse than the start
  not_positive_definite,  // a pivot of H is not positive; x as above
  invalid                 // NaN or overflow, lo > hi, n out of range; x as above if lo <= hi
};

template <Real T, int capacity>
struct BoxQpSolution {
  std::array<T, capacity> x{};
  QpStatus status = QpStatus::invalid;
  int iterations = 0;  // factorisations
};

/// Default iteration limit. 3^n faces bound the iterations; what occurs is far less: at most 4, 8,
/// 16, 25, 37 for n = 2, 3, 6, 12, 24 in 140 000 (n = 24: 28 000) problems of the families of
/// tests/core/test_box_qp.py, float and double, from zero, random points and vertices. 10 + 2n
/// leaves a quarter or more above that. A controller with a time budget may give less: x stays
/// usable.
constexpr int box_qp_iteration_limit(int n) { return 10 + 2 * n; }

/// The variables off the working set, in the order of the rows of the Cholesky factor of H_FF.
template <Real T, int capacity>
struct FreeBlock {
  std::array<int, capacity> index;
  int size = 0;
  int factored = 0;                                 // leading rows of L that are still valid
  std::array<std::array<T, capacity>, capacity> L;  // lower; only `factored` rows hold numbers
  std::array<T, capacity> inverse_diagonal;

  void add(int i) { index[size++] = i; }

  /// Takes out row r; only the rows behind it must be computed again.
  void remove(int r) {
    size = size - 1;
    for (int c = r; c < size; ++c) index[c] = index[c + 1];
    factored = r < factored ? r : factored;
  }

  /// False where a pivot is lost in rounding, or is NaN.
  bool factor(const BoxQp<T, capacity>& qp) {
    for (int r = factored; r < size; ++r) {
      const auto& H_r = qp.H[index[r]];
      auto& L_r = L[r];
      T pivot = H_r[index[r]];
      const T floor = std::numeric_limits<T>::epsilon() * pivot;
      for (int c = 0; c < r; ++c) {
        T sum = H_r[index[c]];
        for (int j = 0; j < c; ++j) sum = sum - L_r[j] * L[c][j];
        L_r[c] = sum * inverse_diagonal[c];
        pivot = pivot - L_r[c] * L_r[c];
      }
      if (!(pivot > floor)) return false;
      inverse_diagonal[r] = T(1) / sqrt(pivot);
      factored = r + 1;
    }
    return true;
  }

  /// d with H_FF d = -g_F, by row of the block.
  std::array<T, capacity> newton_step(const std::array<T, capacity>& g) const {
    std::array<T, capacity> d;
    for (int r = 0; r < size; ++r) {
      T sum = -g[index[r]];
      for (int j = 0; j < r; ++j) sum = sum - L[r][j] * d[j];
      d[r] = sum * inverse_diagonal[r];
    }
    for (int r = size - 1; r >= 0; --r) {
      d[r] = d[r] * inverse_diagonal[r];
      for (int j = 0; j < r; ++j) d[j] = d[j] - L[r][j] * d[r];
    }
    return d;
  }
};

/// Row i of the gradient Hx + f.
template <Real T, int capacity>
T slope(const BoxQp<T, capacity>& qp, const typename BoxQp<T, capacity>::Vector& x, int i) {
  T sum = qp.f[i];
  for (int j = 0; j < qp.n; ++j) sum = sum + qp.H[i][j] * x[j];
  return sum;
}

/// Minimum of the problem from the start x, which also gives the first working set: what the
/// clipped start has on a bound. The last solution, shifted or not, is a good start.
/// Rounding errors in x are relative to the longest step: a start far off costs digits.
template <Real T, int capacity>
BoxQpSolution<T, capacity> solve(const BoxQp<T, capacity>& qp,
                                 const typename BoxQp<T, capacity>::Vector& start,
                                 int max_iterations) {
  using Vector = std::array<T, capacity>;
  BoxQpSolution<T, capacity> result;
  const int n = qp.n;
  if (n < 1 || n > capacity) return result;

  Vector& x = result.x;
  Vector scale, g, g_trial;  // scale: sqrt of the diagonal of H
  std::array<bool, capacity> is_free;
  FreeBlock<T, capacity> free;
  bool valid = true;
  for (int i = 0; i < n; ++i) {
    x[i] = clamp(start[i], qp.lo[i], qp.hi[i]);
    valid = valid && qp.lo[i] <= qp.hi[i] && is_finite(x[i]) && is_finite(qp.f[i]) &&
            is_finite(qp.H[i][i]);
    scale[i] = sqrt(qp.H[i][i]);
    is_free[i] = x[i] > qp.lo[i] && x[i] < qp.hi[i];
    if (is_free[i]) free.add(i);
  }
  if (!valid) return result;

  // Frees what a wrong multiplier holds on its bound; true if there was any. Rounding leaves in g_i
  // an error of some eps (|f_i| + sum |H_ij x_j|), and |H_ij| <= sqrt(H_ii H_jj).
  const auto release = [&] {
    if (free.size == n) return false;
    T size = T(0);
    for (int i = 0; i < n; ++i) size = size + scale[i] * abs(x[i]);
    bool any = false;
    for (int i = 0; i < n; ++i) {
      if (is_free[i] || qp.lo[i] == qp.hi[i]) continue;
      const T tolerance =
          T(4) * std::numeric_limits<T>::epsilon() * (abs(qp.f[i]) + scale[i] * size);
      const T inward = x[i] == qp.lo[i] ? -g[i] : g[i];
      if (inward <= tolerance && is_finite(inward)) continue;
      is_free[i] = true;
      free.add(i);
      any = true;
    }
    return any;
  };

  for (int i = 0; i < n; ++i) g[i] = slope(qp, x, i);
  if (!release() && free.size == 0) {
    result.status = QpStatus::solved;
    return result;
  }
  while (result.iterations < max_iterations) {
    result.iterations = result.iterations + 1;
    if (!free.factor(qp)) {
      result.status = QpStatus::not_positive_definite;
      return result;
    }
    const int face = free.size;
    const Vector d = free.newton_step(g);

    // x + d clipped to the box, and the first bound on the way there.
    Vector trial = x;
    T step = T(1);
    int first = -1;
    for (int r = 0; r < free.size; ++r) {
      const int i = free.index[r];
      const T target = x[i] + d[r];
      if (!is_finite(target)) {
        result.status = QpStatus::invalid;
        return result;
      }
      const T bound = d[r] < T(0) ? qp.lo[i] : qp.hi[i];
      trial[i] = target;
      if (d[r] < T(0) ? target >= bound : target <= bound) continue;
      trial[i] = bound;
      const T fraction = (bound - x[i]) / d[r];
      if (first < 0 || fraction < step) {
        step = fraction;
        first = r;
      }
    }

    if (first < 0) {
      x = trial;
      for (int i = 0; i < n; ++i) g[i] = is_free[i] ? T(0) : slope(qp, x, i);
      if (!release()) {
        result.status = QpStatus::solved;
        return result;
      }
      for (int r = 0; r < face; ++r) g[free.index[r]] = slope(qp, x, free.index[r]);  // rounding
      continue;
    }
    for (int i = 0; i < n; ++i) g_trial[i] = slope(qp, trial, i);
    // q(trial) - q(x) = 1/2 (trial - x)'(g_trial + g), without the cancellation of a difference.
    T change = T(0);
    for (int r = 0; r < free.size; ++r) {
      const int i = free.index[r];
      change = change + (trial[i] - x[i]) * (g_trial[i] + g[i]);
    }
    if (change < T(0)) {
      x = trial;
      g = g_trial;
    } else {
      for (int r = 0; r < free.size; ++r) {
        const int i = free.index[r];
        x[i] = r == first ? trial[i] : clamp(x[i] + step * d[r], qp.lo[i], qp.hi[i]);
      }
      for (int i = 0; i < n; ++i) g[i] = slope(qp, x, i);
    }
    for (int r = free.size - 1; r >= 0; --r) {
      const int i = free.index[r];
      if (d[r] < T(0) ? x[i] > qp.lo[i] : x[i] < qp.hi[i]) continue;  // a bound it leaves is open
      is_free[i] = false;
      free.remove(r);
    }
  }
  result.status = QpStatus::iteration_limit;
  return result;
}

template <Real T, int capacity>
BoxQpSolution<T, capacity> solve(const BoxQp<T, capacity>& qp,
                                 const typename BoxQp<T, capacity>::Vector& start) {
  return solve(qp, start, box_qp_iteration_limit(qp.n));
}

}  // namespace srm
