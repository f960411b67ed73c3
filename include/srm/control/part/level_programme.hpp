// The quadratic program of channels that take a level at once and forget it, in as few unknowns as
// it has: the errors of the samples.
//
//   minimise  sum_j lambda_j^2 + sum_k v_k'W v_k - 2 w_i near_k'v_k    within bounds on every v
//   lambda_j = error_j - sum_k c_kj v_k,m(j)       m(j): the move in force at sample j
//
// v_k: the levels of channel k at moves 0, 1, ..; W = w_i I + r_w times the matrix of squared
// increments (tridiagonal, the same for all channels). It is the program of incremental_mpc.hpp for
// a = 0, b = 1, where a sample sees one level alone. A channel without bounds that act answers the
// errors by v_k = P (w_i near_k + sum_j c_kj lambda_j), P = W^-1; so the errors solve
// (I + sum_k c_k P c_k') lambda = error - sum_k c_k P w_i near_k, as many equations as samples,
// however many channels there are (the identity of Sherman, Morrison and Woodbury).
//
// Bounds by guesses: first none, or what acted before; then those that the minimum violates are
// held, and a level that its bound holds back from the inside is let go. A confirmed guess is the
// optimum, and two to four nearly always are enough, but nothing says that they end (M.
// Hintermueller, K. Ito, K. Kunisch, "The primal-dual active set strategy as a semismooth Newton
// method", SIAM J. Optim. 13(3), 2002): box_qp.hpp does the rest.
#pragma once

#include "srm/control/part/incremental_mpc.hpp"

namespace srm {

/// Samples, Moves: int, or a constant, with which the compiler writes all loops out.
template <Real T, int N, int Np_max, int Nc_max, class Samples, class Moves>
struct LevelProgramme {
  using Mpc = IncrementalMpc<T, N, Np_max, Nc_max>;
  using Levels = std::array<T, Nc_max>;
  using Sides = std::array<std::int8_t, Nc_max>;  // -1, 1: at the lower or upper bound; 0: off
  using Block = std::array<Levels, Nc_max>;

  struct Channel {
    std::array<T, Np_max> c;  // output per level at each sample
    Levels near, lo, hi;      // levels: the preferred ones, and their bounds
    Sides side;               // the guess
    Levels v;                 // the answer
  };

  Samples N_p;
  Moves N_c;
  T r_w, w_i;  // weights of the increments and of the distance to `near`
  int n = 0;   // channels
  std::array<Channel, N> channels;
  std::array<T, Np_max> error;
  std::array<T, Np_max> lambda;  // the errors that are left at the minimum

  /// True once a guess is confirmed, within so many.
  bool guess(int trials) {
    const Block P_free = inverse(Sides{});
    for (int trial = 0; trial < trials; ++trial) {
      meet(P_free);
      bool confirmed = true;
      for (int k = 0; k < n; ++k) {
        const Levels s = asked(channels[k]);
        for (int m = 0; m < N_c; ++m) confirmed = stays(channels[k], s, m) && confirmed;
      }
      if (confirmed) return true;
    }
    return false;
  }

  /// The minimum from the general solver.
  void solve_exactly() {
    const Mpc mpc{N_p, N_c, r_w, T(0), T(1)};
    typename Mpc::Gains c{};
    for (int k = 0; k < n; ++k) {
      for (int j = 0; j < N_p; ++j) c[j][k] = channels[k].c[j];
    }
    auto qp = mpc.problem(c, error);
    std::array<T, Mpc::n_max> start{};
    for (int m = 0; m < N_c; ++m) {
      for (int k = 0; k < n; ++k) {
        const int v = m * N + k;
        start[v] = channels[k].near[m];
        qp.H[v][v] = qp.H[v][v] + w_i;
        qp.f[v] = qp.f[v] - w_i * start[v];
        qp.lo[v] = channels[k].lo[m];
        qp.hi[v] = channels[k].hi[m];
      }
    }
    const auto best = solve(qp, start);
    for (int m = 0; m < N_c; ++m) {
      for (int k = 0; k < n; ++k) channels[k].v[m] = best.x[m * N + k];
    }
  }

 private:
  int move(int j) const { return j < N_c ? j : N_c - 1; }

  /// Diagonal of W.
  T weight(int m) const { return (m + 1 < N_c ? T(2) * r_w : r_w) + w_i; }

  /// Inverse of W over the moves off their bounds, zero for the others; by Gauss and Jordan.
  Block inverse(const Sides& side) const {
    Block A;
    for (int m = 0; m < N_c; ++m) {
      for (int l = 0; l < N_c; ++l) A[m][l] = l == m + 1 || m == l + 1 ? -r_w : T(0);
      A[m][m] = weight(m);
    }
    for (int m = 0; m < N_c; ++m) {
      const T p = side[m] == 0 ? T(1) / A[m][m] : T(0);
      for (int l = 0; l < N_c; ++l) {
        if (l == m) continue;
        const T f = A[l][m] * p;
        for (int b = 0; b < N_c; ++b) {
          if (b != m) A[l][b] = A[l][b] - f * A[m][b];
        }
        A[l][m] = -f;
      }
      for (int b = 0; b < N_c; ++b) A[m][b] = A[m][b] * p;
      A[m][m] = p;
    }
    return A;
  }

  /// The levels at the minimum with the present sides.
  void meet(const Block& P_free) {
    std::array<std::array<T, Np_max>, Np_max> G;
    for (int j = 0; j < N_p; ++j) {
      for (int l = 0; l < j; ++l) G[j][l] = T(0);
      G[j][j] = T(1);
      lambda[j] = error[j];
    }
    std::array<Block, N> P;
    for (int k = 0; k < n; ++k) {
      Channel& x = channels[k];
      bool held = false;
      for (int m = 0; m < N_c; ++m) held = held || x.side[m] != 0;
      P[k] = held ? inverse(x.side) : P_free;
      Levels pull;  // of the wish, and of levels at bounds on those beside them
      for (int m = 0; m < N_c; ++m) {
        pull[m] = w_i * x.near[m];
        if (x.side[m] != 0) x.v[m] = x.side[m] < 0 ? x.lo[m] : x.hi[m];
      }
      if (held) {
        for (int m = 0; m < N_c; ++m) {
          if (m > 0 && x.side[m - 1] != 0) pull[m] = pull[m] + r_w * x.v[m - 1];
          if (m + 1 < N_c && x.side[m + 1] != 0) pull[m] = pull[m] + r_w * x.v[m + 1];
        }
      }
      for (int m = 0; m < N_c; ++m) {
        if (x.side[m] != 0) continue;
        T sum = T(0);
        for (int l = 0; l < N_c; ++l) sum = sum + P[k][m][l] * pull[l];
        x.v[m] = sum;
      }
      for (int j = 0; j < N_p; ++j) {
        const int m = move(j);
        lambda[j] = lambda[j] - x.c[j] * x.v[m];
        for (int l = 0; l <= j; ++l) G[j][l] = G[j][l] + x.c[j] * x.c[l] * P[k][m][move(l)];
      }
    }
    divide(lambda, G);
    for (int k = 0; k < n; ++k) {
      Channel& x = channels[k];
      const Levels s = asked(x);
      for (int m = 0; m < N_c; ++m) {
        for (int l = 0; l < N_c; ++l) x.v[m] = x.v[m] + P[k][m][l] * s[l];
      }
    }
  }

  /// What the errors ask of a channel's levels: sum of c lambda over the samples of each move.
  Levels asked(const Channel& x) const {
    Levels s{};
    for (int j = 0; j < N_p; ++j) s[move(j)] = s[move(j)] + x.c[j] * lambda[j];
    return s;
  }

  /// False where the guess was wrong for a level: then its side changes.
  bool stays(Channel& x, const Levels& s, int m) const {
    if (x.side[m] == 0) {
      if (x.v[m] >= x.lo[m] && x.v[m] <= x.hi[m]) return true;
      x.side[m] = x.v[m] < x.lo[m] ? -1 : 1;
      return false;
    }
    T inward = s[m] + w_i * x.near[m] - weight(m) * x.v[m];
    if (m > 0) inward = inward + r_w * x.v[m - 1];
    if (m + 1 < N_c) inward = inward + r_w * x.v[m + 1];
    if (x.side[m] < 0 ? inward <= T(0) : inward >= T(0)) return true;
    x.side[m] = 0;
    return false;
  }

  /// b becomes G^-1 b, by the factors L D L'. G >= I: no pivot is below one.
  void divide(std::array<T, Np_max>& b, std::array<std::array<T, Np_max>, Np_max>& G) const {
    std::array<T, Np_max> inverse;  // of D
    for (int r = 0; r < N_p; ++r) {
      for (int c = 0; c < r; ++c) {
        for (int j = 0; j < c; ++j) G[r][c] = G[r][c] - G[r][j] * G[c][j];  // L D
      }
      for (int c = 0; c < r; ++c) {
        const T l = G[r][c] * inverse[c];
        G[r][r] = G[r][r] - G[r][c] * l;
        b[r] = b[r] - l * b[c];
        G[r][c] = l;
      }
      inverse[r] = T(1) / G[r][r];
    }
    for (int r = N_p - 1; r >= 0; --r) {
      T sum = b[r] * inverse[r];
      for (int j = r + 1; j < N_p; ++j) sum = sum - G[j][r] * b[j];
      b[r] = sum;
    }
  }
};

}  // namespace srm
