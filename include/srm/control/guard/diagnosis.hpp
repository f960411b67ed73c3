// What broke: each explanation is held against the flux linkages, and what contradicts is dropped.
//
// From the voltage that was ordered follows between which bounds the flux linkage of a phase is,
// whatever the angle: it is zero without current, and changes by (u - R i) T_s a sample. The map
// says which flux linkages its reading means at an angle. Where these two have no common value, a
// sound drive is contradicted: the errors that the drive file states are in the bounds. From then
// on explanations are asked, some a sample, whether they agree with all phases:
//
//   phase k       its sensor, switches or winding are broken: the others agree with the angle
//   offset        the angle is what is shown and a constant: the zero is off
//   reversed      the angle is a constant less what is shown
//   exchanged     the windings or the channels of two phases, or both, are exchanged
//
// An explanation that has once been contradicted is never one again. Where one kind is left, that
// is the fault. Where none is left, the angle shown does not follow the rotor. Nothing is weighed;
// what decides is the errors stated. (Set-membership fault diagnosis: F. C. Schweppe, Uncertain
// Dynamic Systems, 1973, ch. 4.)
//
// An angle is searched in steps of 15 deg, electrical, each with the angles half a step around it.
// With three phases, cables exchanged behind the sensors of two of them are the same as an angle
// that runs backwards: this is called reversed. At standstill offset and reversed are the same.
#pragma once

#include "srm/control/guard/guarded.hpp"
#include "srm/control/part/order_flux.hpp"

namespace srm {

/// What is left of the explanations.
template <int N>
struct Explanations {
  static constexpr int n_angles = 24;
  static constexpr int n_pairs = N * (N - 1) / 2;

  std::uint32_t offset = (1U << n_angles) - 1, reversed = offset;            // a bit for each angle
  std::uint16_t power = (1U << n_pairs) - 1, sensors = power, both = power;  // for each pair
  std::uint8_t phase = (1U << N) - 1;                                        // for each phase
};

template <Real T>
struct Diagnosis {
  Drops<T> drops;
  T R_error;      // of the resistance [1]
  T u_error;      // of the voltage over a sample, over u_dc [1]
  T i_gain;       // of a reading [1]
  T map_error;    // of the flux linkage that the map says [1]
  T psi_error;    // the same in addition: flux linkage of the other phases [Wb]
  T psi_zero;     // most flux linkage of a phase that reads no current, at any angle [Wb]
  T theta_error;  // of the angle, electrical [rad]
  T i_max;        // a phase without a reading ends the doubt at the flux linkage of this one [A]
  int patience;   // samples of doubt, at most
  SRM_FIELDS(drops, R_error, u_error, i_gain, map_error, psi_error, psi_zero, theta_error, i_max,
             patience)

  /// Between which bounds a flux linkage is [Wb].
  struct Span {
    T least{}, most{never<T>};
  };

  struct Phase {
    OrderFlux<T> now, next;  // of the orders in effect until the next sample, and from then on
    LateLeg<T> leg;
    bool timed = false, timed_next = false;  // they are orders for a timer
    int age = 0;                             // samples since it may have had no flux linkage
    Span any;                                // from the voltage alone: at any angle
    Span shown;                              // narrowed by what the readings mean at the angle
  };

  template <int N>
  struct State {
    std::array<Phase, N> phase;
    T u_dc{};                   // at the last sample [V]
    std::uint32_t doubted = 0;  // samples since the first contradiction, with it
    Fault<T> first;
    Explanations<N> left;
    int angle = 0, angle_phase = 0, pair = 0;  // asked next
    std::array<Span, N * N> crossed{};  // by the orders of a phase and the current of another
  };

  /// A sample that the levels admit. guard: before it remembers this sample. True where the fault
  /// is known, which guard is told.
  template <Machine M, int N>
  constexpr bool finds(State<N>& x, typename Protection<T>::template State<N>& guard,
                       const Protection<T>& p, const M& machine, const Measurement<T, N>& y) const {
    const T u_dc = (x.u_dc + y.u_dc) / T(2);
    x.u_dc = y.u_dc;
    if (!guard.has_last) {
      x = {};
      x.u_dc = y.u_dc;
      return false;
    }
    for (int k = 0; k < N; ++k) {
      Phase& each = x.phase[k];
      advance(each.any, each, guard.acting[k], p, guard.i[k], y.i[k], u_dc);
      each.age = each.any.least > T(0) ? each.age + 1 : 0;
      advance(each.shown, each, guard.acting[k], p, guard.i[k], y.i[k], u_dc);
      const T theta_e = phase_angle_in_turn<N>(y.theta_e, k);
      Span meant;
      const int side = compare(each.shown, p, machine, y.i[k], theta_e, theta_error, meant);
      if (side == 0) {
        each.shown.least = max(each.shown.least, meant.least);
        each.shown.most = min(each.shown.most, meant.most);
      } else {
        contradicted(x, p, k, side, each.shown, meant, y.i[k] > p.i_zero);
      }
    }
    return x.doubted > 0 && judge(x, guard, p, machine, y, u_dc);
  }

  /// A sample that guard has not admitted: too much current in two phases that contradict a sound
  /// drive comes from what the two have exchanged, where that is left.
  template <int N>
  constexpr void explain(const State<N>& x,
                         typename Protection<T>::template State<N>& guard) const {
    const bool two = x.doubted > 0 && x.left.phase == 0;
    if (two && guard.latched && guard.fault.status == Status::over_current &&
        (x.left.power | x.left.sensors) != 0) {
      guard.fault.status = Status::phases_exchanged;
    }
  }

  /// Keeps what the next sample needs, after guard has.
  template <int N>
  constexpr void remember(State<N>& x, const Protection<T>& p,
                          const std::type_identity_t<Command<T, N>>& orders) const {
    for (int k = 0; k < N; ++k) {
      Phase& each = x.phase[k];
      const bool late = p.delay > 0;
      if (late) {
        each.now = each.next;
        each.timed = each.timed_next;
      }
      bool& timed = late ? each.timed_next : each.timed;
      timed = orders[k].gate == Gate::timer;
      if (!timed) continue;
      OrderFlux<T>& last = late ? each.next : each.now;
      if (Drops<T>::stays(orders[k], each.leg, p.flux.T_s)) {
        last = drops.held(each.leg.leg, p.flux.T_s);
      } else {
        last = drops.of(orders[k], each.leg, p.flux.T_s);
      }
    }
  }

 private:
  /// Moves bounds over a sample with readings i0 and i1 at its ends.
  constexpr void advance(Span& s, const Phase& ordered, const Expected<T>& expected,
                         const Protection<T>& p, T i0, T i1, T u_dc) const {
    const T T_s = p.flux.T_s, margin = u_error * T_s * u_dc;
    const T high = max(max(i0, i1), T(0)) * (T(1) + i_gain) + p.flux.i_error;
    const T low = max(min(i0, i1) * (T(1) - i_gain) - p.flux.i_error, T(0));
    const T drop_most = T_s * p.flux.R * (T(1) + R_error) * high + margin;
    const T drop_least = T_s * p.flux.R * (T(1) - R_error) * low - margin;
    if (ordered.timed) {
      const OrderFlux<T>& o = ordered.now;
      const T idle = o.idle_level * u_dc - o.idle_drop;
      const T rest = o.level * u_dc - o.drop - idle;
      s.least = max(max(s.least + idle, T(0)) + rest - drop_most, T(0));
      s.most = max(max(s.most + idle, T(0)) + rest - drop_least, T(0));
      if (!(low > T(0))) s.most = s.most + o.drop;
    } else {
      // A comparator may see the current with another gain than the readings have.
      const bool below = max(i0, i1) < expected.below * (T(1) - i_gain);
      const bool above = min(i0, i1) > expected.above * (T(1) + i_gain);
      const T least = below ? expected.least : T(-1), most = above ? expected.most : T(1);
      const T slack = drops.t_dead * u_dc + T(2) * (drops.v_switch + drops.v_diode) * T_s;
      s.least = max(s.least + least * T_s * u_dc - slack - drop_most, T(0));
      const T again = most > T(-1) ? T_s * u_dc + margin : T(0);
      s.most = max(s.most + most * T_s * u_dc + slack - drop_least, again);
    }
    if (i1 <= p.i_zero) s.most = min(s.most, psi_zero);
  }

  /// Whether a flux linkage within s agrees with reading i at an angle that may be wrong by error:
  /// 0, or -1 where the reading is too low, 1 where it is too high. meant: what the reading means.
  // noinline: asked in five places.
  template <Machine M>
  [[gnu::noinline]] constexpr int compare(const Span& s, const Protection<T>& p, const M& machine,
                                          T i, T theta_e, T error, Span& meant) const {
    const bool flows = i > p.i_zero;
    if (!flows && !(s.least > psi_error)) return 0;
    const T at = flows ? i : p.i_zero + p.flux.i_error;
    const T psi0 = machine.at(at, wrap(theta_e - error)).psi;
    const T psi1 = machine.at(at, wrap(theta_e + error)).psi;
    const T part = map_error + (flows ? i_gain + p.flux.i_error / i : T(0));
    meant.least = flows ? min(psi0, psi1) * (T(1) - part) - psi_error : T(0);
    meant.most = max(psi0, psi1) * (T(1) + part) + psi_error;
    if (s.least > meant.most) return -1;
    return s.most < meant.least ? 1 : 0;
  }

  /// Phase k contradicts a sound drive: only what concerns it is left.
  template <int N>
  constexpr void contradicted(State<N>& x, const Protection<T>& p, int k, int side, const Span& s,
                              const Span& meant, bool flows) const {
    if (x.doubted == 0) {
      const Status status = side > 0 ? Status::current_too_high
                            : flows  ? Status::current_too_low
                                     : Status::dead_current_sensor;
      x.first = {status, std::int8_t(k), side > 0 ? meant.least : meant.most,
                 side > 0 ? s.most : s.least};
      x.left = {};
      for (int j = 0; j < N; ++j) {  // the current of another phase was at most the trip level
        const Phase& each = x.phase[j];
        const T drop = static_cast<T>(each.age) * p.flux.T_s * p.flux.R * (T(1) + R_error);
        for (int m = 0; m < N; ++m) {
          x.crossed[j * N + m] = {.least = max(each.any.least - drop * p.levels.i_trip, T(0))};
        }
      }
      x.doubted = 1;
    }
    x.left.phase = static_cast<std::uint8_t>(x.left.phase & (1U << k));
    std::uint16_t with = 0;
    for (int a = 0, pair = 0; a < N; ++a) {
      for (int b = a + 1; b < N; ++b, ++pair) {
        if (a == k || b == k) with = static_cast<std::uint16_t>(with | (1U << pair));
      }
    }
    x.left.power &= with;
    x.left.sensors &= with;
    x.left.both &= with;
  }

  /// One more sample in doubt.
  template <Machine M, int N>
  [[gnu::noinline, gnu::cold]] constexpr bool judge(
      State<N>& x, typename Protection<T>::template State<N>& guard, const Protection<T>& p,
      const M& machine, const Measurement<T, N>& y, T u_dc) const {
    if (x.doubted > 1) {
      for (int j = 0; j < N; ++j) {
        for (int k = 0; k < N; ++k) {
          if (j == k) continue;
          advance(x.crossed[j * N + k], x.phase[j], guard.acting[j], p, guard.i[k], y.i[k], u_dc);
        }
      }
    }
    const int k = static_cast<int>(x.doubted % N);
    ask_extremes(x, p, machine, y, k);
    const T most = machine.at(i_max, phase_angle_in_turn<N>(y.theta_e, k)).psi;
    const bool beyond = y.i[k] <= p.i_zero && x.phase[k].shown.least > most;
    ask_angle(x, p, machine, y);
    ask_pair(x, p, machine, y);
    ++x.doubted;
    return named(x, guard, beyond);
  }

  /// Whether any angle agrees with phase k: the map is monotone from unaligned to aligned.
  template <Machine M, int N>
  constexpr void ask_extremes(State<N>& x, const Protection<T>& p, const M& machine,
                              const Measurement<T, N>& y, int k) const {
    Span meant;
    const Span& any = x.phase[k].any;
    if (compare(any, p, machine, y.i[k], pi<T> / T(2), pi<T> / T(2), meant) == 0) return;
    x.left.offset = x.left.reversed = 0;
    x.left.both = 0;
  }

  /// The next angle that is left is held against the next phase.
  template <Machine M, int N>
  constexpr void ask_angle(State<N>& x, const Protection<T>& p, const M& machine,
                           const Measurement<T, N>& y) const {
    constexpr int n_angles = Explanations<N>::n_angles;
    constexpr T step = two_pi<T> / T(n_angles);
    const auto bits = [&] { return std::uint64_t(x.left.reversed) << n_angles | x.left.offset; };
    if (bits() == 0) return;
    int& n = x.angle;
    const int k = x.angle_phase;
    for (; (bits() >> n & 1U) == 0; n = (n + 1) % (2 * n_angles)) {
    }
    const bool backwards = n >= n_angles;
    const T theta_e = (backwards ? -y.theta_e : y.theta_e) + static_cast<T>(n) * step;
    Span meant;
    const int side = compare(x.phase[k].any, p, machine, y.i[k], phase_angle<N>(wrap(theta_e), k),
                             theta_error + step / T(2), meant);
    if (side != 0) {
      std::uint32_t& left = backwards ? x.left.reversed : x.left.offset;
      left &= ~(1U << (backwards ? n - n_angles : n));
    }
    x.angle_phase = side != 0 || k + 1 == N ? 0 : k + 1;
    if (x.angle_phase == 0) n = (n + 1) % (2 * n_angles);
  }

  /// The next exchange that is left is held against both phases.
  template <Machine M, int N>
  constexpr void ask_pair(State<N>& x, const Protection<T>& p, const M& machine,
                          const Measurement<T, N>& y) const {
    constexpr int n_pairs = Explanations<N>::n_pairs;
    x.pair = (x.pair + 1) % (3 * n_pairs);
    const int pair = x.pair % n_pairs, kind = x.pair / n_pairs;
    std::uint16_t& bits = kind == 0 ? x.left.power : kind == 1 ? x.left.sensors : x.left.both;
    if ((bits >> pair & 1) == 0) return;
    int a = 0, b = pair + 1;
    while (b >= N) {
      ++a;
      b = b - N + a + 1;
    }
    const auto agrees = [&](const Span& s, int channel, int winding) {
      Span meant;
      return compare(s, p, machine, y.i[channel], phase_angle_in_turn<N>(y.theta_e, winding),
                     theta_error, meant) == 0;
    };
    const Span &ab = x.crossed[a * N + b], &ba = x.crossed[b * N + a];
    const bool left = kind == 0   ? agrees(ab, b, b) && agrees(ba, a, a)
                      : kind == 1 ? agrees(ab, b, a) && agrees(ba, a, b)
                                  : agrees(x.phase[a].any, a, b) && agrees(x.phase[b].any, b, a);
    if (!left) bits = static_cast<std::uint16_t>(bits & ~(1U << pair));
  }

  /// True where one kind of explanation is left, none, or the doubt ends. beyond: by a current.
  template <int N>
  constexpr bool named(const State<N>& x, typename Protection<T>::template State<N>& guard,
                       bool beyond) const {
    const Explanations<N>& left = x.left;
    const bool mirrored = N == 3 && left.both != 0;
    const std::uint32_t exchanged =
        left.power | left.sensors | (N == 3 ? 0U : std::uint32_t(left.both));
    const bool reversed = left.reversed != 0 || mirrored;
    const int kinds = (left.phase != 0) + (left.offset != 0) + reversed + (exchanged != 0);
    const bool ends = x.doubted > static_cast<std::uint32_t>(patience);
    if (kinds > 1 && !ends && !beyond) return false;
    guard.latched = true;
    guard.fault = x.first;
    if (left.phase == 0) guard.fault.phase = -1;
    if (left.phase != 0 && beyond) return true;
    if (beyond && exchanged != 0) {
      guard.fault.status = Status::phases_exchanged;
    } else if (left.offset != 0) {
      guard.fault.status = Status::angle_off;
    } else if (reversed) {
      guard.fault.status = Status::angle_reversed;
    } else if (exchanged != 0) {
      guard.fault.status = Status::phases_exchanged;
    } else if (left.phase == 0) {
      guard.fault.status = Status::angle_lost;
    }
    return true;
  }
};

/// A guarded control that says what broke.
template <class Guarded>
struct Diagnosed {
  using Scalar = typename Guarded::Scalar;
  using T = Scalar;
  using Tuning = typename Guarded::Tuning;
  static constexpr int N = Guarded::N;
  static constexpr int n_phases = N;

  Guarded guarded;
  Diagnosis<T> diagnosis;
  SRM_FIELDS(guarded, diagnosis)

  struct State {
    typename Guarded::State guarded;
    typename Diagnosis<T>::template State<N> diagnosis;
  };

  constexpr Tuning tuning() const { return guarded.tuning(); }
  constexpr bool motors() const { return guarded.motors(); }

  template <Uses used = Uses{}>
  [[gnu::always_inline]] Status step(State& x, const Measurement<T, N>& y, T reference,
                                     Command<T, N>& orders, const Tuning& at) const {
    return guarded.template step<used>(x.guarded, y, reference, orders, at, Asked{*this, x});
  }

  void start(State& x) const {
    guarded.start(x.guarded);
    x.diagnosis = {};
  }
  void forget(State& x) const {
    guarded.forget(x.guarded);
    x.diagnosis = {};
  }
  template <Uses used = Uses{}>
  void watch(State& x, const Measurement<T, N>& y, const Tuning& at) const {
    guarded.template watch<used>(x.guarded, y, at);
  }
  const Fault<T>& fault(const State& x) const { return guarded.fault(x.guarded); }
  bool latched(const State& x) const { return guarded.latched(x.guarded); }
  const auto& law(const State& x) const { return guarded.law(x.guarded); }

 private:
  struct Asked {
    static constexpr bool on = true;
    const Diagnosed& self;
    State& x;

    bool finds(const Measurement<T, N>& y) const {
      return self.diagnosis.finds(x.diagnosis, x.guarded.guard, self.guarded.protection,
                                  self.guarded.machine, y);
    }
    void explain() const { self.diagnosis.explain(x.diagnosis, x.guarded.guard); }
    void remember(const Command<T, N>& orders) const {
      self.diagnosis.remember(x.diagnosis, self.guarded.protection, orders);
    }
  };
};

}  // namespace srm
