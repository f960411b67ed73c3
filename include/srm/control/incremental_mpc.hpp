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

#include "srm/control/box_qp.hpp"

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

  /// Displacement of a channel after 1, 2, .. N_p samples when no input moves, per unit of the
  /// last increment dx: a, a + a^2, ... The free response is y + c displacement dx.
  Outputs free_displacement() const {
    Outputs sum{};
    T power = a, total = T(0);
    for (int j = 0; j < N_p; ++j) {
      total = total + power;
      power = power * a;
      sum[j] = total;
    }
    return sum;
  }

  /// Displacement after 1, 2, .. N_p samples per unit step of the input: b, b + a b, ...
  Outputs step_response() const {
    Outputs sum{};
    T power = b, total = T(0);
    for (int j = 0; j < N_p; ++j) {
      total = total + power;
      power = power * a;
      sum[j] = total;
    }
    return sum;
  }

  /// The law as a quadratic program in dU = (du of all channels at move 0, then at move 1, ...):
  /// H = Phi'Phi + r_w I, f = -Phi'(Y_ref - F x). Bounds are left to the caller.
  BoxQp<T, n_max> problem(const Gains& c, const Outputs& error_free) const {
    const Outputs response = step_response();
    BoxQp<T, n_max> qp;
    qp.n = N * N_c;
    for (int j = 0; j < N_p; ++j) {
      const int moves = j + 1 < N_c ? j + 1 : N_c;  // a later move cannot act on this sample
      for (int v = 0; v < N * moves; ++v) {
        const T phi_v = c[j][v % N] * response[j - v / N];
        qp.f[v] = qp.f[v] - phi_v * error_free[j];
        for (int w = 0; w <= v; ++w) {
          qp.H[v][w] = qp.H[v][w] + phi_v * c[j][w % N] * response[j - w / N];
        }
      }
    }
    for (int v = 0; v < qp.n; ++v) {
      qp.H[v][v] = qp.H[v][v] + r_w;
      for (int w = 0; w < v; ++w) qp.H[w][v] = qp.H[v][w];
    }
    return qp;
  }

  /// The same problem in the inputs themselves, v_m = du_0 + ... + du_m (from the input before the
  /// first move), so that limits on an input become bounds on a variable.
  void in_levels(BoxQp<T, n_max>& qp) const {
    for (int v = 0; v + N < qp.n; ++v) {
      qp.f[v] = qp.f[v] - qp.f[v + N];
      for (int w = 0; w < qp.n; ++w) qp.H[v][w] = qp.H[v][w] - qp.H[v + N][w];
    }
    for (int w = 0; w < qp.n; ++w) {
      for (int v = 0; v + N < qp.n; ++v) qp.H[w][v] = qp.H[w][v] - qp.H[w][v + N];
    }
  }
};

}  // namespace srm
