// Between which bounds the flux linkage of a winding is by its voltage, and whether a reading
// agrees. In a sound drive the bounds and what the map says of the reading have a value in common.
//
// From the voltage that was ordered the flux linkage follows whatever the angle: it is zero without
// current, and changes by (u - R i) T_s a sample. The map says which flux linkages a reading means
// at an angle. The errors that the drive file states are in both. flux_bounds.hpp has the same for
// a drive without diagnosis, which states no error of the voltage or of the resistance.
#pragma once

#include "srm/control/frame/flux_angle.hpp"
#include "srm/control/guard/protection.hpp"
#include "srm/control/part/order_flux.hpp"

namespace srm {

template <Real T>
struct WindingFlux {
  Drops<T> drops;
  T R_error;    // of the resistance [1]
  T u_error;    // of the voltage over a sample, over u_dc [1]
  T i_gain;     // of a reading [1]
  T map_error;  // of the flux linkage that the map says [1]
  T psi_error;  // the same in addition: flux linkage of the other phases [Wb]
  T psi_zero;   // most flux linkage of a phase that reads no current, at any angle [Wb]
  T psi_max;    // most flux linkage at i_max, at any angle [Wb]
  SRM_FIELDS(drops, R_error, u_error, i_gain, map_error, psi_error, psi_zero, psi_max)

  /// Between which bounds a flux linkage is [Wb].
  using Span = typename FluxBounds<T>::State;

  /// What the resistance takes over a sample, and what the voltage may be wrong by [Wb].
  struct Drop {
    T least{}, most{};
    bool flows{}, ends_at_zero{};
  };

  /// What an order adds to the flux linkage over a sample [Wb].
  struct Push {
    T idle{};           // before it magnetizes: without current nothing of it counts
    T least{}, most{};  // and from then on
    T again{};          // at least so much may have built up
    T drop{};           // of the devices: where no current flows, it does not count
    bool builds{};      // without magnetizing no flux linkage grows
  };

  /// Of a phase.
  struct State {
    OrderFlux<T> now, next;  // of the orders in effect until the next sample, and from then on
    LateLeg<T> leg;
    bool timed = false, timed_next = false;  // they are orders for a timer
    int age = 0;                             // samples since it may have had no flux linkage
    Span any;                                // from the voltage alone: at any angle
    Drop drop;                               // over the last sample
    Span shown;                              // narrowed by what the readings mean at the angle
    T taken{};                               // by the resistance in this time [Wb]
    T left{never<T>};                        // by which the middle of `any` may be wrong then [Wb]

    /// Without flux linkage, and none is built up: its bounds stay zero.
    constexpr bool idle() const { return timed && !now.magnetizes && !(any.most > T(0)); }
  };

  /// Moves the bounds of a phase over a sample with readings i0 and i1 at its ends.
  constexpr void step(State& x, const Expected<T>& expected, const Protection<T>& p, T i0, T i1,
                      T u_dc) const {
    const Push push = push_of(x, expected, p, i0, i1, u_dc);
    const Drop drop = x.drop = drop_of(p, i0, i1, u_dc);
    advance(x.any, push, drop);
    count(x, push, drop);
    advance(x.shown, push, drop);
  }

  /// Keeps what the next sample needs of an order.
  // always_inline: an order takes far fewer instructions where its constants are known.
  [[gnu::always_inline]] constexpr void remember(State& x, const Protection<T>& p,
                                                 const PhaseCommand<T>& order) const {
    const bool late = p.delay > 0;
    if (late) {
      x.now = x.next;
      x.timed = x.timed_next;
    }
    bool& timed = late ? x.timed_next : x.timed;
    timed = order.gate == Gate::timer;
    if (!timed) return;
    OrderFlux<T>& last = late ? x.next : x.now;
    if (Drops<T>::stays(order, x.leg, p.flux.T_s)) {
      last = drops.held(x.leg.ordered, p.flux.T_s);
    } else {
      last = drops.of(order, x.leg, p.flux.T_s);
    }
  }

  /// What the voltage says of a phase, the error of the resistance aside.
  constexpr VoltageFlux<T> by_voltage(const State& x) const {
    const T error = (x.any.most - x.any.least) / T(2) - R_error * x.taken;
    return {.psi = (x.any.least + x.any.most) / T(2),
            .taken = x.taken,
            .left = x.left,
            .error = max(error, T(0)),
            .is = x.age > 0};
  }

  /// With readings i0 and i1, at the ends of the sample, of the winding that is ordered.
  constexpr Push push_of(const State& ordered, const Expected<T>& expected, const Protection<T>& p,
                         T i0, T i1, T u_dc) const {
    if (ordered.timed) {
      const OrderFlux<T>& o = ordered.now;
      const T idle = o.idle_level * u_dc - o.idle_drop;
      const T rest = o.level * u_dc - o.drop - idle;
      return {.idle = idle, .least = rest, .most = rest, .drop = o.drop, .builds = o.magnetizes};
    }
    // A comparator may see the current with another gain than the readings have.
    const T T_s = p.flux.T_s;
    const bool below = max(i0, i1) < expected.below * (T(1) - i_gain);
    const bool above = min(i0, i1) > expected.above * (T(1) + i_gain);
    const T least = below ? expected.least : T(-1), most = above ? expected.most : T(1);
    const T slack = drops.t_dead * u_dc + T(2) * (drops.v_switch + drops.v_diode) * T_s;
    return {.least = least * T_s * u_dc - slack,
            .most = most * T_s * u_dc + slack,
            .again = most > T(-1) ? (T(1) + u_error) * T_s * u_dc : T(0),
            .builds = most > T(-1)};
  }

  /// Moves bounds over a sample.
  constexpr void advance(Span& s, const Push& push, const Drop& drop) const {
    const T before = s.most;
    s.least = max(max(s.least + push.idle, T(0)) + push.least - drop.most, T(0));
    s.most = max(max(s.most + push.idle, T(0)) + push.most - drop.least, push.again);
    if (!drop.flows) s.most = s.most + push.drop;
    if (!push.builds) s.most = min(s.most, before);
    if (drop.ends_at_zero) s.most = min(s.most, psi_zero);
  }

  /// Whether a flux linkage within s agrees with reading i at an angle that may be wrong by error:
  /// 0, or -1 where the reading is too low, 1 where it is too high. meant: what the reading means.
  // noinline: asked in five places.
  template <Machine M>
  [[gnu::noinline]] constexpr int compare(const Span& s, const Protection<T>& p, const M& machine,
                                          T i, T theta_e, T error, Span& meant) const {
    if (!tells(s, p, i)) return 0;
    const Reading y = reading(p, i);
    const T psi0 = machine.at(y.i, wrap(theta_e - error)).psi;
    const T psi1 = machine.at(y.i, wrap(theta_e + error)).psi;
    meant.least = y.flows ? min(psi0, psi1) * (T(1) - y.part) - psi_error : T(0);
    meant.most = max(psi0, psi1) * (T(1) + y.part) + psi_error;
    if (s.least > meant.most) return -1;
    return s.most < meant.least ? 1 : 0;
  }

  /// Whether a reading can contradict bounds: without current only flux linkage can.
  constexpr bool tells(const Span& s, const Protection<T>& p, T i) const {
    return i > p.i_zero || s.least > psi_error;
  }

  /// The most current that a reading means where none flows, or the current.
  struct Reading {
    T i{};         // [A]
    T part{};      // by which the flux linkage of the map may be wrong there [1]
    bool flows{};  // a current flows
  };
  constexpr Reading reading(const Protection<T>& p, T i) const {
    const bool flows = i > p.i_zero;
    return {.i = flows ? i : p.i_zero + p.flux.i_error,
            .part = map_error + (flows ? i_gain + p.flux.i_error / i : T(0)),
            .flows = flows};
  }

 private:
  constexpr Drop drop_of(const Protection<T>& p, T i0, T i1, T u_dc) const {
    const T T_s = p.flux.T_s, margin = u_error * T_s * u_dc;
    const T high = max(max(i0, i1), T(0)) * (T(1) + i_gain) + p.flux.i_error;
    const T low = max(min(i0, i1) * (T(1) - i_gain) - p.flux.i_error, T(0));
    return {.least = T_s * p.flux.R * (T(1) - R_error) * low - margin,
            .most = T_s * p.flux.R * (T(1) + R_error) * high + margin,
            .flows = low > T(0),
            .ends_at_zero = i1 <= p.i_zero};
  }

  /// Counts samples since the flux linkage may have been zero, from when on the middle of its
  /// bounds is what the nominal voltage and resistance make of it. left: what it was then, at most,
  /// and what the orders have left open since, as the error of the middle.
  static constexpr void count(State& x, const Push& push, const Drop& drop) {
    if (x.any.least > T(0)) {
      ++x.age;
      x.taken = x.taken + (drop.least + drop.most) / T(2);
      if (!x.timed) x.left = x.left + (push.most - push.least) / T(2);
    } else {
      x.age = 0;
      x.taken = T(0);
      x.left = x.any.most / T(2);
    }
  }
};

}  // namespace srm
