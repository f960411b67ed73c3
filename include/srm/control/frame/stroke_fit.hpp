// Resistance and flux map of the machine that is driven, from the strokes of its phases.
//
// While a phase conducts, from no current to no current, the volt-seconds that were ordered are
// flux linkage and loss in the resistance:
//
//   U = psi(i, theta) + R I,   I: integral of the current since the stroke began.
//
// The flux map is the believed one, psi_map, with three factors that are 1 where it is right:
//
//   psi(i, theta) = (unaligned - aligned) L_u i + saturated psi_map(b i, theta),
//   b = aligned/saturated,  L_u: the unaligned inductance of the map.
//
// `unaligned` scales the inductance there, `aligned` what is unsaturated beyond it, and `saturated`
// the flux linkage that saturates; with all three alike the map is scaled. It is the derivative of
// a co-energy for any map, and torque scales by saturated/b (learning.hpp). Each sample of a stroke
// is a row of a least-squares problem in these four unknowns, linear about the present ones:
//
//   U - psi - R I = dR I + d_unaligned L_u i + d_aligned i (L_inc - L_u)
//                   + d_saturated (psi_map - b i L_inc),   L_inc = dpsi_map/di at b i,
//
// Where the phases couple, psi has besides saturated psi_pairs(b i, theta) of all currents i, which
// scales as the rest does. A phase without current has of it what its neighbours make. So the
// volt-seconds of a stroke count from there, and the part at its start is taken off.
//
// The last rows, where the flux linkage is nearly gone, are what tells the resistance. A stroke
// counts only when it has ended and its flux linkage was worth it. Then the unknowns move towards
// the solution by a bounded step. Where no current returns to zero, at standstill, with currents
// that never end or without any, nothing moves.
//
// Tuned numbers, and what they decide: docs/control/tuned_constants.md.
#pragma once

#include "srm/base/angle.hpp"
#include "srm/control/frame/dead_time_compensation.hpp"
#include "srm/control/frame/edge_limits.hpp"
#include "srm/control/frame/learned.hpp"
#include "srm/control/frame/normal_equations.hpp"
#include "srm/control/part/order_flux.hpp"
#include "srm/machine/coupling.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

template <Real T>
struct StrokeFit {
  static constexpr T keep = T(0.95);    // of the sums, from stroke to stroke
  static constexpr int rows_least = 4;  // of a stroke that counts
  /// Part of the rows that the belief counts as: it decides where they show less than 0.2 %.
  static constexpr T belief = T(3e-6);
  /// Longest step after a stroke, and range, of R and of the factors of the map.
  static constexpr T R_step = T(0.06), R_least = T(0.4), R_most = T(2.5);
  static constexpr T map_step = T(0.02), map_least = T(0.75), map_most = T(1.35);

  Drops<T> drops;
  EdgeLimits<T> edges;  // that the frame puts on the orders
  T L_u;                // unaligned inductance of the map [H]
  T i_least;            // a smaller current is none [A]
  T i_missing;          // true less shown: half a step of the current converter [A]
  T psi_least;          // a stroke that stays below says too little [Wb]
  T T_s;                // control period [s]
  int delay;            // samples from measurement to effect: 0 or 1
  SRM_FIELDS(drops, edges, L_u, i_least, i_missing, psi_least, T_s, delay)

  /// What the neighbours of a phase add to its flux linkage, as believed.
  struct Mutual {
    T psi{};    // [Wb]
    T slope{};  // its derivative by all currents, times these [Wb]
  };

  /// The same of all phases.
  template <int N>
  struct Neighbours {
    std::array<Mutual, N> now, start;  // at the last sample; at the start of the stroke

    /// Since the start.
    constexpr Mutual added(int k) const {
      return {now[k].psi - start[k].psi, now[k].slope - start[k].slope};
    }
  };

  /// A phase.
  struct Stroke {
    NormalEquations<T> sums;
    T U{}, I{};              // since it began [V s], [A s]
    T U_most{};              // [V s]
    T i{};                   // at the last sample [A]
    int rows = 0;            // of the sums
    bool runs = false;       // it has begun, and not ended
    OrderFlux<T> now, next;  // of the orders in effect until the next sample, and from then on
    LateLeg<T> leg;
  };

  template <int N>
  struct State {
    Learned<T> learned;
    NormalEquations<T> sums;
    std::array<Stroke, N> strokes;
    T u_dc{};  // at the last sample [V]
  };

  /// A sample. machine, pairs, R: as believed; couples: false where there are never pairs. True
  /// where a stroke has ended and moved what is learned.
  template <bool couples, int N, Machine M>
  constexpr bool observe(State<N>& x, Neighbours<N>& others, const M& machine,
                         const Coupling<T>& pairs, T R, const Measurement<T, N>& y) const {
    if (couples && pairs.any()) follow(x, others, pairs, y);
    const T u_dc = (x.u_dc + y.u_dc) * T(0.5);
    x.u_dc = y.u_dc;
    x.learned.t_since = x.learned.t_since + T_s;
    bool moved = false;
    for (int k = 0; k < N; ++k) {
      Stroke& s = x.strokes[k];
      const T i_before = s.i;
      s.i = current(y.i[k]);
      if (!s.runs) {
        if (i_before > T(0) || !s.now.magnetizes) continue;
        s.runs = true;
        s.rows = 0;
        s.sums = {};
        s.I = s.U_most = T(0);
        s.U = s.now.idle_drop - s.now.idle_level * u_dc;
      }
      if (!(s.i > T(0)) && !s.now.magnetizes) {
        moved = end(x, s) || moved;
        continue;
      }
      s.U = s.U + s.now.level * u_dc - s.now.drop;
      s.U_most = max(s.U_most, s.U);
      s.I = s.I + (i_before + s.i) * (T_s * T(0.5));
      if (s.i > T(0)) {
        add_row<couples>(x.learned, s, others, k, machine, R, phase_angle<N>(y.theta_e, k));
      }
    }
    return moved;
  }

  /// The orders of this sample, as the law gives them.
  template <int N>
  constexpr void remember(State<N>& x, const Command<T, N>& orders) const {
    for (int k = 0; k < N; ++k) {
      Stroke& s = x.strokes[k];
      if (delay > 0) s.now = s.next;
      OrderFlux<T>& last = delay > 0 ? s.next : s.now;
      if (drops.stays(orders[k], s.leg, T_s)) {
        last = drops.held(s.leg.ordered, T_s);
      } else {
        last = drops.of(sent(orders[k]), s.leg, T_s);
      }
    }
  }

  /// The rows, and three that weigh little: the resistance is as believed, and the shape of the
  /// map.
  template <int N>
  static constexpr NormalEquations<T> with_belief(const State<N>& x) {
    const Learned<T>& p = x.learned;
    NormalEquations<T> all = x.sums;
    const T w = sqrt(belief * x.sums.trace());
    all.add({w, T(0), T(0), T(0)}, w * (T(1) - p.R));
    all.add({T(0), w, -w, T(0)}, w * (p.aligned - p.unaligned));
    all.add({T(0), T(0), -w, w}, w * (p.aligned - p.saturated));
    return all;
  }

 private:
  /// What a reading says [A].
  constexpr T current(T shown) const { return shown > i_least ? shown + i_missing : T(0); }

  /// What the neighbours add at this sample; before a stroke, at the first turn-on since the last
  /// sample, if there was one.
  template <int N>
  [[gnu::noinline]] constexpr void follow(const State<N>& x, Neighbours<N>& others,
                                          const Coupling<T>& pairs,
                                          const Measurement<T, N>& y) const {
    const T b = x.learned.aligned / x.learned.saturated;
    std::array<T, N> i;
    std::array<Mutual, N> now{};
    for (int k = 0; k < N; ++k) i[k] = b * current(y.i[k]);
    for (int n = 0; n < pairs.n_pairs(); ++n) {
      const int k = pairs.first[n], l = pairs.second[n];
      if (!(i[k] > T(0) || i[l] > T(0))) continue;
      const PairMagnetics<T> m = pairs.at(n, i[k], i[l], y.theta_e);
      now[k].psi = now[k].psi + m.psi_first;
      now[l].psi = now[l].psi + m.psi_second;
      now[k].slope = now[k].slope + (m.L_first * i[k] + m.L_mutual * i[l]);
      now[l].slope = now[l].slope + (m.L_second * i[l] + m.L_mutual * i[k]);
    }
    for (int k = 0; k < N; ++k) {
      const Stroke& s = x.strokes[k];
      const Mutual last = others.now[k];
      if (!s.runs) {
        const T part = -s.now.idle_level / T_s;  // of the sample, demagnetizing without current
        others.start[k] = {last.psi + part * (now[k].psi - last.psi),
                           last.slope + part * (now[k].slope - last.slope)};
      }
      others.now[k] = now[k];
    }
  }

  /// An order as the frame sends it.
  constexpr PhaseCommand<T> sent(const PhaseCommand<T>& order) const {
    Command<T, 1> one{order};
    if (drops.t_dead > T(0)) lead_turn_on<T, 1>(one, drops.t_dead);
    if (edges.any()) edges.apply(one[0]);
    return one[0];
  }

  template <bool couples, int N, Machine M>
  constexpr void add_row(const Learned<T>& p, Stroke& s, const Neighbours<N>& others, int k,
                         const M& machine, T R, T theta) const {
    const T b = p.aligned / p.saturated;
    const Magnetics<T> m = machine.at(b * s.i, theta);
    const T psi = (p.unaligned - p.aligned) * L_u * s.i + p.saturated * m.psi;
    const T loss = R * s.I;
    typename NormalEquations<T>::Vector phi{loss, L_u * s.i, s.i * (m.L_inc - L_u),
                                            m.psi - b * s.i * m.L_inc};
    T rest = s.U - psi - p.R * loss;
    if constexpr (couples) {
      const Mutual added = others.added(k);
      phi[2] = phi[2] + added.slope / b;
      phi[3] = phi[3] + (added.psi - added.slope);
      rest = rest - p.saturated * added.psi;
    }
    s.sums.add(phi, rest);
    ++s.rows;
  }

  /// No current any more.
  template <int N>
  constexpr bool end(State<N>& x, Stroke& s) const {
    s.runs = false;
    if (s.rows < rows_least || s.U_most < psi_least) return false;
    x.sums.take(s.sums, keep);
    move(x);
    return true;
  }

  /// Towards the solution.
  template <int N>
  [[gnu::noinline, gnu::cold]] constexpr void move(State<N>& x) const {
    Learned<T>& p = x.learned;
    auto d = with_belief(x).solve();
    p.asked = T(0);
    for (const T part : d) p.asked = max(p.asked, abs(part));
    d[0] = moved(p.R, d[0], R_step, R_least, R_most);
    d[1] = moved(p.unaligned, d[1], map_step, map_least, map_most);
    d[2] = moved(p.aligned, d[2], map_step, map_least, map_most);
    d[3] = moved(p.saturated, d[3], map_step, map_least, map_most);
    x.sums.moved(d);
    for (Stroke& s : x.strokes) {
      if (s.runs) s.sums.moved(d);
    }
    p.t_since = T(0);
    p.strokes = min(p.strokes + T(1), T(1e6));
  }

  /// Moves a value within its range by d, but by no more than step; returns by how much it did.
  static constexpr T moved(T& value, T d, T step, T least, T most) {
    const T before = value;
    value = clamp(value + clamp(d, -step, step), least, most);
    return value - before;
  }
};

}  // namespace srm
