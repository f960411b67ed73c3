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
// The first known one takes the best step at each sample.
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
    Node root;
    root.level = last;
    for (int k = 0; k < N; ++k) root.psi[k] = phases[k].psi;
    if (pruning == Pruning::on && horizon > 1) found.cost = greedy(root, found);
    descend(root, 0, pruning, found);
    return found;
  }

 private:
  static constexpr T beyond_limit = T(1e12);

  struct Node {
    std::array<T, N> psi{};
    Levels level{}, first{};
    T cost{};
  };

  T weight(int j) const { return j + 1 == horizon ? t_end : T_s; }

  /// A phase at the end of sample j with each of its levels, and what that costs by itself.
  struct Branch {
    std::array<T, 3> psi, tau, cost;
  };

  Branch branch(const Node& node, int k, int j) const {
    const PhaseOutlook<T>& x = phases[k];
    const T t = T_s * static_cast<T>(j + 1);
    Branch b;
    for (int level = lowest[k]; level <= highest[k]; ++level) {
      const bool blocked = level <= 0 && !(node.psi[k] > T(0));
      const T rise = blocked ? T(0) : T_s * (static_cast<T>(level) * u_dc - R * x.i + x.bias);
      const T psi = max(node.psi[k] + rise, T(0));
      const bool conducting = psi > T(0);
      const T moved = psi - x.psi;
      const T i = conducting ? max(x.i + x.i_drift * t + x.i_gain * moved, T(0)) : T(0);
      const T away = psi - x.goal - x.goal_rate * t;
      int levels = level > node.level[k] ? level - node.level[k] : node.level[k] - level;
      if (!(node.psi[k] > T(0))) levels = 0;  // without current a switch turns at no cost
      T cost =
          weight(j) * (w_psi * away * away + w_i * i * i) + w_sw / T(2) * static_cast<T>(levels);
      if (i > i_max && level > -1) cost = cost + beyond_limit;
      b.psi[level + 1] = psi;
      b.tau[level + 1] = conducting ? x.tau + x.drift * t + x.gain * moved : T(0);
      b.cost[level + 1] = cost;
    }
    return b;
  }

  /// Calls visit(child) for every combination of sample j that can still be better than `bound`.
  template <class Visit>
  void expand(const Node& node, int j, const T& bound, Best& found, const Visit& visit) const {
    std::array<Branch, N> branches;
    for (int k = 0; k < N; ++k) branches[k] = branch(node, k, j);
    Node child = node;
    child.level = lowest;
    for (bool more = true; more;) {
      T e = -tau_ref;
      T cost = node.cost;
      for (int k = 0; k < N; ++k) {
        e = e + branches[k].tau[child.level[k] + 1];
        cost = cost + branches[k].cost[child.level[k] + 1];
      }
      child.cost = cost + weight(j) * e * e;
      ++found.visited;
      if (child.cost < bound) {
        for (int k = 0; k < N; ++k) child.psi[k] = branches[k].psi[child.level[k] + 1];
        if (j == 0) child.first = child.level;
        visit(child);
      }
      more = false;
      for (int k = 0; k < N && !more; ++k) {  // count up, phase by phase
        more = child.level[k] < highest[k];
        child.level[k] = more ? child.level[k] + 1 : lowest[k];
      }
    }
  }

  void descend(const Node& node, int j, Pruning pruning, Best& found) const {
    const T unbounded = T(1e30);
    const bool last = j + 1 == horizon;
    const T& bound = pruning == Pruning::on || last ? found.cost : unbounded;
    expand(node, j, bound, found, [&](const Node& child) {
      if (!last) return descend(child, j + 1, pruning, found);
      found.cost = child.cost;
      found.level = child.first;
    });
  }

  /// Cost of the sequence that takes the best step at each sample.
  T greedy(Node node, Best& found) const {
    for (int j = 0; j < horizon; ++j) {
      Node step;
      step.cost = T(1e30);
      expand(node, j, step.cost, found, [&](const Node& child) { step = child; });
      node = step;
    }
    found.level = node.first;
    return node.cost;
  }
};

}  // namespace srm
