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
//
// The costs of the phases add up apart from the torque error, so that they are summed phase by
// phase, and a sum that is too high ends there. What follows a combination is bounded in the same
// way. As e^2 >= 2 e e_0 - e_0^2 for any e_0, the next sample costs at least
//
//   sum over phases of min over levels (cost + 2 t e_0 tau) - 2 t e_0 tau_ref - t e_0^2,
//
// which is closest where e_0 is the torque error that the sequence will end with; that of the first
// known one serves.
#pragma once

#include "srm/control/part/prediction.hpp"

namespace srm {

enum class Pruning : std::int8_t { off, on };

template <Real T, int N>
struct LegSearch {
  using Levels = std::array<int, N>;

  std::array<PhasePrediction<T>, N> phases;
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
    int nodes;  // whose combinations were compared
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
    Best best{{}, found.cost, found.nodes};
    for (int n = 0; n < N; ++n) best.level[found.phase[n]] = place_of(found.legs, n) - 1;
    return best;
  }

 private:
  static constexpr T beyond_limit = T(1e12);
  static constexpr T unbounded = T(1e30);

  /// A leg combination: level + 1 in two bits a place.
  using Packed = unsigned;
  static constexpr int place_of(Packed legs, int n) {
    return static_cast<int>(legs >> (2 * n) & 3u);
  }

  struct Found {
    Levels phase;  // at each place; those without a choice come last
    Packed legs = 0;
    T cost = unbounded;
    T e{};  // torque error that the first sequence found ends with [N m]
    int nodes = 0;
  };

  bool off(int k) const { return phases[k].idle || !(tau_ref > T(0)); }
  T weight(int j) const { return j + 1 == horizon ? t_end : T_s; }

  /// A phase at the end of a sample with each of its levels, and what that costs by itself. It
  /// depends on what the phase itself did before, not on the others.
  struct Branch {
    struct End {
      T cost, tau, psi;
    };
    std::array<End, 3> end;  // those from n_ends on cost too much to be taken
    int n_ends;
  };

  static constexpr typename Branch::End no_end{unbounded, T(0), T(0)};

  using Next = std::array<std::array<Branch, 3>, N>;  // after each level

  struct Node {
    std::array<const Branch*, N> phase;
    Packed first = 0;
    T cost{};
  };

  /// Phase k in sample j, from a flux linkage and a level on.
  [[gnu::noinline]] void branch(Branch& b, int k, T psi_from, int level_from, int j) const {
    const PhasePrediction<T>& x = phases[k];
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
    };
    end(-1);
    b.n_ends = 1;
    b.end[1] = b.end[2] = no_end;
    if (off(k)) return;
    b.n_ends = 3;
    end(0);
    end(1);
  }

  /// The least of cost + price tau.
  static T least(const Branch& b, T price) {
    T found = b.end[0].cost + price * b.end[0].tau;
    for (int n = 1; n < b.n_ends; ++n) found = min(found, b.end[n].cost + price * b.end[n].tau);
    return found;
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

  [[gnu::noinline]] Cheapest cheapest(const Node& node, T w, T bound) const {
    T cost = bound;
    Packed best = 0;
    combine<N - 1>(node, w, node.cost, -tau_ref, 0, cost, [&](T whole, Packed legs) {
      cost = whole;
      best = legs;
    });
    return {cost, best};
  }

  /// The best of what follows a combination. Its cost is summed as combine() sums it.
  template <Pruning pruning>
  [[gnu::noinline]] void enter(const Node& node, const Next& next, Packed to, int j,
                               Found& found) const {
    Node child;
    T cost = node.cost, e = -tau_ref;
    for (int n = N - 1; n >= 0; --n) {
      const int place = place_of(to, n);
      cost = cost + node.phase[n]->end[place].cost;
      e = e + node.phase[n]->end[place].tau;
      child.phase[n] = &next[n][place];
    }
    child.cost = cost + weight(j) * e * e;
    child.first = j == 0 ? to : node.first;
    descend<pruning>(child, j + 1, found);
  }

  /// What the phase at a place may do after one of its levels.
  void follow(Next& next, const Node& node, int n, int place, int j, const Found& found) const {
    branch(next[n][place], found.phase[n], node.phase[n]->end[place].psi, place - 1, j + 1);
  }

  /// The best continuation first: its cost bounds the others'.
  template <Pruning pruning>
  void descend(const Node& node, int j, Found& found) const {
    const T w = weight(j);
    ++found.nodes;
    if (j + 1 == horizon) {
      finish(node, j, found);
      return;
    }
    Next next;
    if constexpr (pruning == Pruning::off) {
      for (int n = 0; n < N; ++n) {
        for (int place = 0; place < 3; ++place) follow(next, node, n, place, j, found);
      }
      combine<N - 1>(node, w, node.cost, -tau_ref, 0, unbounded,
                     [&](T, Packed to) { enter<pruning>(node, next, to, j, found); });
      return;
    }
    const Packed first = cheapest(node, w, unbounded).legs;
    for (int n = 0; n < N; ++n) follow(next, node, n, place_of(first, n), j, found);
    enter<pruning>(node, next, first, j, found);
    const T price = T(2) * weight(j + 1) * found.e;
    Node bound;  // the same with the least that follows, each phase less its own least
    bound.cost = node.cost - price * (tau_ref + found.e / T(2));
    std::array<Branch, N> ahead;
    for (int n = 0; n < N; ++n) {
      const Branch& b = *node.phase[n];
      T lowest = unbounded;
      for (int place = 0; place < b.n_ends; ++place) {
        if (place != place_of(first, n)) follow(next, node, n, place, j, found);
        const T cost = b.end[place].cost + least(next[n][place], price);
        ahead[n].end[place] = {cost, b.end[place].tau, T(0)};
        lowest = min(lowest, cost);
      }
      ahead[n].n_ends = b.n_ends;
      for (int place = 0; place < b.n_ends; ++place) {
        ahead[n].end[place].cost = ahead[n].end[place].cost - lowest;
      }
      if (b.n_ends == 1) ahead[n].end[1] = ahead[n].end[2] = no_end;
      bound.cost = bound.cost + lowest;
      bound.phase[n] = &ahead[n];
    }
    combine<N - 1>(bound, w, bound.cost, -tau_ref, 0, found.cost, [&](T, Packed to) {
      if (to != first) enter<pruning>(node, next, to, j, found);
    });
  }

  /// The last sample.
  void finish(const Node& node, int j, Found& found) const {
    const Cheapest end = cheapest(node, weight(j), found.cost);
    if (j > 0 && !(found.cost < unbounded)) {
      found.e = -tau_ref;
      for (int n = 0; n < N; ++n) {
        found.e = found.e + node.phase[n]->end[place_of(end.legs, n)].tau;
      }
    }
    if (end.cost < found.cost) {
      found.cost = end.cost;
      found.legs = j == 0 ? end.legs : node.first;
    }
  }
};

}  // namespace srm
