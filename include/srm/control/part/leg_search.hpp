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

  std::array<PhaseOutlook<T>, N> phases{};
  Levels lowest{}, highest{};  // levels that a phase may take
  T tau_ref{};                 // [N m]
  T u_dc{}, R{}, i_max{};
  T T_s{}, t_end{};  // [s]
  T w_psi{};         // [N^2 m^2/Wb^2]
  T w_i{};           // [N^2 m^2/A^2]
  T w_sw{};          // cost of a turn-on [N^2 m^2 s]
  int horizon = 1;

  struct Best {
    Levels level{};  // for the first sample
    T cost = T(1e30);
    int visited = 0;  // combinations whose cost was computed
  };

  Best best(const Levels& last, Pruning pruning = Pruning::on) const {
    Best found;
    std::array<Branch, N> start;
    Node root;
    for (int k = 0; k < N; ++k) {
      branch(start[k], k, phases[k].psi, last[k], 0);
      root.phase[k] = &start[k];
    }
    descend(root, 0, pruning, found);
    return found;
  }

 private:
  static constexpr T beyond_limit = T(1e12);
  static constexpr T unbounded = T(1e30);

  T weight(int j) const { return j + 1 == horizon ? t_end : T_s; }

  /// A phase at the end of a sample with each of its levels, and what that costs by itself. It
  /// depends on what the phase itself did before, not on the others.
  struct Branch {
    std::array<T, 3> psi, tau, cost;
    T least;              // cost
    T tau_low, tau_high;  // torques
  };

  struct Node {
    std::array<const Branch*, N> phase;
    Levels first;
    T cost{};
  };

  /// Phase k in sample j, from a flux linkage and a level on.
  void branch(Branch& b, int k, T psi_from, int level_from, int j) const {
    const PhaseOutlook<T>& x = phases[k];
    const T t = T_s * static_cast<T>(j + 1);
    const T w = weight(j);
    const bool carries = psi_from > T(0);
    const T goal = x.goal + x.goal_rate * t;
    const T still = T_s * (x.bias - R * x.i);  // volt-seconds without the dc link
    b.least = b.tau_low = unbounded;
    b.tau_high = -unbounded;
    for (int level = lowest[k]; level <= highest[k]; ++level) {
      const T rise = carries || level > 0 ? still + T_s * static_cast<T>(level) * u_dc : T(0);
      const T psi = max(psi_from + rise, T(0));
      const T away = psi - goal;
      T cost = w * w_psi * away * away;
      T tau = T(0);
      if (psi > T(0)) {
        const T moved = psi - x.psi;
        const T i = max(x.i + x.i_drift * t + x.i_gain * moved, T(0));
        tau = x.tau + x.drift * t + x.gain * moved;
        cost = cost + w * w_i * i * i;
        if (i > i_max && level > -1) cost = cost + beyond_limit;
      }
      if (carries) {  // without current a switch turns at no cost
        const int levels = level > level_from ? level - level_from : level_from - level;
        cost = cost + w_sw / T(2) * static_cast<T>(levels);
      }
      b.psi[level + 1] = psi;
      b.tau[level + 1] = tau;
      b.cost[level + 1] = cost;
      b.least = min(b.least, cost);
      b.tau_low = min(b.tau_low, tau);
      b.tau_high = max(b.tau_high, tau);
    }
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

  /// Calls visit(cost) for every combination of levels of phases k, k-1, .. 0 that costs less than
  /// `bound`, which may fall meanwhile. cost, e: of the phases above k.
  template <int k, class Visit>
  void combine(const Node& node, T w, T cost, T e, Levels& level, const T& bound, Best& found,
               const Visit& visit) const {
    const Branch& b = *node.phase[k];
    for (int l = lowest[k]; l <= highest[k]; ++l) {
      const T sum = cost + b.cost[l + 1];
      const T error = e + b.tau[l + 1];
      level[k] = l;
      if constexpr (k > 0) {
        if (sum < bound) combine<k - 1>(node, w, sum, error, level, bound, found, visit);
      } else {
        ++found.visited;
        const T whole = sum + w * error * error;
        if (whole < bound) visit(whole);
      }
    }
  }

  /// The best continuation first: its cost bounds the others'.
  void descend(const Node& node, int j, Pruning pruning, Best& found) const {
    const bool prune = pruning == Pruning::on;
    const T w = weight(j);
    const T none = unbounded;
    const T& bound = prune ? found.cost : none;
    Levels level;
    if (j + 1 == horizon) {
      combine<N - 1>(node, w, node.cost, -tau_ref, level, bound, found, [&](T cost) {
        if (!(cost < found.cost)) return;
        found.cost = cost;
        found.level = j == 0 ? level : node.first;
      });
      return;
    }
    std::array<std::array<Branch, 3>, N> next;  // of a phase after each of its levels
    std::array<std::array<bool, 3>, N> made{};
    const auto enter = [&](const Levels& to, T cost) {
      Node child;
      for (int k = 0; k < N; ++k) {
        const int place = to[k] + 1;
        if (!made[k][place]) branch(next[k][place], k, node.phase[k]->psi[place], to[k], j + 1);
        made[k][place] = true;
        child.phase[k] = &next[k][place];
      }
      child.first = j == 0 ? to : node.first;
      child.cost = cost;
      if (!prune || least(child, weight(j + 1)) < found.cost) descend(child, j + 1, pruning, found);
    };
    Levels best = lowest;
    if (prune) {
      T least_cost = unbounded;
      combine<N - 1>(node, w, node.cost, -tau_ref, level, least_cost, found, [&](T cost) {
        least_cost = cost;
        best = level;
      });
      enter(best, least_cost);
    }
    combine<N - 1>(node, w, node.cost, -tau_ref, level, bound, found, [&](T cost) {
      if (!prune || level != best) enter(level, cost);
    });
  }
};

}  // namespace srm
