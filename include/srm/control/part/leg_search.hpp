// The best sequence of leg combinations over a horizon: branch and bound.
//
//   cost = sum over samples of [ t (e^2 + w_psi |psi - goal|^2 + w_i |i|^2) + w_sw/2 leg levels ]
//
// over the legs of phases that carry current, with e the torque error at the sample's end and t =
// T_s; for the last sample t = t_end, the time for which its state will matter: an error that a
// turn-on removes would have lasted. Each term is positive, so a sequence whose first part costs
// more than a known whole one is out (J. Rodriguez, P. Cortes, Predictive Control of Power
// Converters and Electrical Drives, Wiley 2012; T. Geyer, D. E. Quevedo, "Multistep finite control
// set model predictive control for power electronics", IEEE Trans. Power Electron. 29(12), 2014).
// The first known one takes the best step at each sample. The costs of the phases add up apart from
// the torque error, so that they are summed phase by phase, and a sum that is too high ends there.
#pragma once

#include "srm/control/part/outlook.hpp"

namespace srm {

enum class Pruning : std::int8_t { off, on };

template <Real T, int N>
struct LegSearch {
  using Levels = std::array<int, N>;

  std::array<PhaseOutlook<T>, N> phases;
  T tau_ref;  // at least 0; at 0 all phases demagnetize [N m]
  T u_dc, R, i_max;
  T T_s, t_end;  // [s]
  T w_psi;       // [N^2 m^2/Wb^2]
  T w_i;         // [N^2 m^2/A^2]
  T w_sw;        // cost of a turn-on [N^2 m^2 s]
  int horizon;

  struct Best {
    Levels level;  // for the first sample
    T cost;
    int visited;  // combinations whose cost was computed
  };

  template <Pruning pruning = Pruning::on>
  Best best(const Levels& last) const {
    Found found;
    int n_free = 0, n_off = 0;
    for (int k = 0; k < N; ++k) found.phase[off(k) ? N - ++n_off : n_free++] = k;
    std::array<Branch, N> start;
    Node root;
    for (int n = 0; n < N; ++n) {
      const int k = found.phase[n];
      branch(start[n], k, phases[k].psi, last[k], 0);
      root.phase[n] = &start[n];
    }
    descend<pruning>(root, 0, found);
    Best best{{}, found.cost, found.visited};
    for (int n = 0; n < N; ++n) best.level[found.phase[n]] = level_of(found.legs, n);
    return best;
  }

 private:
  static constexpr T beyond_limit = T(1e12);
  static constexpr T unbounded = T(1e30);

  /// A leg combination: level + 1 in two bits a place.
  using Packed = unsigned;
  static constexpr int level_of(Packed legs, int n) {
    return static_cast<int>(legs >> (2 * n) & 3u) - 1;
  }

  struct Found {
    Levels phase;  // at each place; those without a choice come last
    Packed legs = 0;
    T cost = unbounded;
    int visited = 0;
  };

  bool off(int k) const { return phases[k].idle || !(tau_ref > T(0)); }
  T weight(int j) const { return j + 1 == horizon ? t_end : T_s; }

  /// A phase at the end of a sample with each of its levels, and what that costs by itself. It
  /// depends on what the phase itself did before, not on the others.
  struct Branch {
    struct End {
      T cost, tau, psi;
    };
    std::array<End, 3> end;
    int n_ends;
    T least;              // cost
    T tau_low, tau_high;  // torques
  };

  struct Node {
    std::array<const Branch*, N> phase;
    Packed first = 0;
    T cost{};
  };

  /// Phase k in sample j, from a flux linkage and a level on.
  [[gnu::noinline]] void branch(Branch& b, int k, T psi_from, int level_from, int j) const {
    const PhaseOutlook<T>& x = phases[k];
    const T t = T_s * static_cast<T>(j + 1);
    const T w = weight(j);
    const bool carries = psi_from > T(0);
    const T goal = x.goal + x.goal_rate * t;
    const T still = T_s * (x.bias - R * x.i);  // volt-seconds without the dc link
    const T swing = T_s * u_dc;
    const T i_0 = x.i + x.i_drift * t;
    const T tau_0 = x.tau + x.drift * t;
    const T w_edge = carries ? w_sw / T(2) : T(0);  // without current a switch turns at no cost
    const auto end = [&](int level) {
      const T rise = carries || level > 0 ? still + static_cast<T>(level) * swing : T(0);
      const T psi = max(psi_from + rise, T(0));
      const T away = psi - goal;
      T cost = w * w_psi * away * away;
      T tau = T(0);
      if (psi > T(0)) {
        const T moved = psi - x.psi;
        const T i = max(i_0 + x.i_gain * moved, T(0));
        tau = tau_0 + x.gain * moved;
        cost = cost + w * w_i * i * i;
        if (i > i_max && level > -1) cost = cost + beyond_limit;
      }
      cost = cost + w_edge * abs(static_cast<T>(level) - static_cast<T>(level_from));
      b.end[level + 1] = {cost, tau, psi};
      b.least = level < 0 ? cost : min(b.least, cost);
      b.tau_low = level < 0 ? tau : min(b.tau_low, tau);
      b.tau_high = level < 0 ? tau : max(b.tau_high, tau);
    };
    end(-1);
    b.n_ends = 1;
    b.end[1] = b.end[2] = {unbounded, T(0), T(0)};
    if (off(k)) return;
    b.n_ends = 3;
    end(0);
    end(1);
  }

  /// What the sample after a node costs at least.
  T least(const Node& node, T w) const {
    T cost = node.cost, low = -tau_ref, high = -tau_ref;
    for (const Branch* b : node.phase) {
      cost = cost + b->least;
      low = low + b->tau_low;
      high = high + b->tau_high;
    }
    const T e = max(max(low, -high), T(0));
    return cost + w * e * e;
  }

  /// Calls visit(cost, legs) for every combination of levels at the places n, n-1, .. 0 that costs
  /// less than `bound`, which may fall meanwhile. cost, e, legs: of the places above n.
  template <int n, class Visit>
  static void combine(const Node& node, T w, T cost, T e, Packed legs, const T& bound,
                      const Visit& visit) {
    const Branch& b = *node.phase[n];
    if constexpr (n > 0) {
      const auto* end = b.end.data();
      const auto* const past = end + b.n_ends;
      do {
        const T sum = cost + end->cost;
        if (sum < bound) {
          combine<n - 1>(node, w, sum, e + end->tau, legs, bound, visit);
        }
        legs += 1u << (2 * n);
      } while (++end != past);
    } else {
      for (const auto& end : b.end) {
        const T error = e + end.tau;
        const T whole = cost + end.cost + w * error * error;
        if (whole < bound) visit(whole, legs);
        ++legs;
      }
    }
  }

  /// The cheapest combination of a sample that costs less than `bound`.
  struct Cheapest {
    T cost;
    Packed legs;
  };

  template <Pruning pruning>
  [[gnu::noinline]] Cheapest cheapest(const Node& node, T w, T bound) const {
    T cost = bound;
    Packed best = 0;
    combine<N - 1>(node, w, node.cost, -tau_ref, 0, cost, [&](T whole, Packed legs) {
      cost = whole;
      best = legs;
    });
    return {cost, best};
  }

  /// A node with what its phases may do next, as far as it was needed.
  struct Fork {
    const Node* node;
    int j;
    std::array<std::array<Branch, 3>, N> next;  // after each level
    unsigned made;
  };

  template <Pruning pruning>
  [[gnu::noinline]] void enter(Fork& fork, T cost, Packed to, Found& found) const {
    Node child;
    for (int n = 0; n < N; ++n) {
      const int level = level_of(to, n);
      Branch& b = fork.next[n][level + 1];
      const unsigned mark = 1u << (3 * n + level + 1);
      if (!(fork.made & mark)) {
        branch(b, found.phase[n], fork.node->phase[n]->end[level + 1].psi, level, fork.j + 1);
      }
      fork.made |= mark;
      child.phase[n] = &b;
    }
    child.first = fork.j == 0 ? to : fork.node->first;
    child.cost = cost;
    if (pruning == Pruning::off || least(child, weight(fork.j + 1)) < found.cost) {
      descend<pruning>(child, fork.j + 1, found);
    }
  }

  /// The best continuation first: its cost bounds the others'.
  template <Pruning pruning>
  void descend(const Node& node, int j, Found& found) const {
    constexpr bool prune = pruning == Pruning::on;
    const T w = weight(j);
    const T none = unbounded;
    if (j + 1 == horizon) {
      const Cheapest end = cheapest<pruning>(node, w, found.cost);
      if (end.cost < found.cost) {
        found.cost = end.cost;
        found.legs = j == 0 ? end.legs : node.first;
      }
      return;
    }
    Fork fork;
    fork.node = &node;
    fork.j = j;
    fork.made = 0;
    Cheapest first{};
    if (prune) {
      first = cheapest<pruning>(node, w, unbounded);
      enter<pruning>(fork, first.cost, first.legs, found);
    }
    combine<N - 1>(node, w, node.cost, -tau_ref, 0, prune ? found.cost : none,
                   [&](T cost, Packed legs) {
                     if (!prune || legs != first.legs) enter<pruning>(fork, cost, legs, found);
                   });
  }
};

}  // namespace srm
