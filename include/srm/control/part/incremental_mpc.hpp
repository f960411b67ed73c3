// Model predictive control in increments of the input: free response, forced response, law.
//
// L. Wang, Model Predictive Control System Design and Implementation Using MATLAB, Springer 2009,
// ch. 1. The augmented state is x = [dx_m; y] (increments of the plant's state, and the output):
//
//   dx_m(n+1) = A_m dx_m(n) + B_m du(n),   y(n+1) = y(n) + C_m dx_m(n+1)
//   Y = F x + Phi dU                       over N_p samples, with N_c moves and none after them
//   dU minimises |Y_ref - Y|^2 + r_w |dU|^2
//
// Here the plant is N equal first-order channels, A_m = a, B_m = b, that add up to one output, and
// C_m may change from sample to sample along the prediction: c[j][k] = dy/dx_k at sample j + 1.
#pragma once

#include <array>

#include "srm/control/part/box_qp.hpp"

namespace srm {

template <Real T, int N, int Np_max, int Nc_max>
struct IncrementalMpc {
  static constexpr int n_max = N * Nc_max;
  using Gains = std::array<std::array<T, N>, Np_max>;
  using Outputs = std::array<T, Np_max>;

  int N_p;  // prediction horizon, 1..Np_max
  int N_c;  // control horizon, 1..min(N_p, Nc_max)
  T r_w;    // weight of the increments
  T a, b;   // one channel: dx(n+1) = a dx(n) + b du(n)

  /// Displacement of a channel after 1, 2, .. N_p samples when no input moves, per unit of the last
  /// increment dx: a, a + a^2, ... The free response is y + c displacement dx.
  Outputs free_displacement() const { return accumulated(a); }

  /// Displacement after 1, 2, .. N_p samples per unit step of the input: b, b + a b, ...
  Outputs step_response() const { return accumulated(b); }

  /// first, first (1 + a), first (1 + a + a^2), ...
  Outputs accumulated(T first) const {
    Outputs sum{};
    T term = first, total = T(0);
    for (int j = 0; j < N_p; ++j) {
      total = total + term;
      term = term * a;
      sum[j] = total;
    }
    return sum;
  }

  /// The law as a quadratic program in the levels v_m = du_0 + ... + du_m of the channels at move
  /// 0, then at move 1, ... (variable m N + k): a limit on an input is then a bound on a variable.
  /// With dU = E v it is v'E'(Phi'Phi + r_w I)E v/2 - v'E'Phi'(Y_ref - F x). Bounds are left to the
  /// caller.
  BoxQp<T, n_max> problem(const Gains& c, const Outputs& error_free) const {
    const Outputs response = step_response();
    BoxQp<T, n_max> qp;
    qp.n = N * N_c;
    for (int j = 0; j < N_p; ++j) {
      const int moves = j + 1 < N_c ? j + 1 : N_c;  // a later move cannot act on this sample
      // Column of Phi E: a level acts by its step, less the next level's, which takes over.
      std::array<T, n_max> phi;
      for (int m = 0; m < moves; ++m) {
        const T taken_over = m + 1 < moves ? response[j - m - 1] : T(0);
        for (int k = 0; k < N; ++k) phi[m * N + k] = c[j][k] * (response[j - m] - taken_over);
      }
      for (int v = 0; v < moves * N; ++v) {
        if (phi[v] == T(0)) continue;
        qp.f[v] = qp.f[v] - phi[v] * error_free[j];
        for (int w = 0; w <= v; ++w) qp.H[v][w] = qp.H[v][w] + phi[v] * phi[w];
      }
    }
    for (int v = 0; v < qp.n; ++v) {
      const bool last = v + N >= qp.n;
      qp.H[v][v] = qp.H[v][v] + (last ? r_w : T(2) * r_w);
      if (!last) qp.H[v + N][v] = qp.H[v + N][v] - r_w;
      for (int w = 0; w < v; ++w) qp.H[w][v] = qp.H[v][w];
    }
    return qp;
  }
};

}  // namespace srm
