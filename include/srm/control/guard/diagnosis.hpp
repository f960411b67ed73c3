// What broke: each explanation is held against the flux linkages, and what contradicts is dropped.
//
// Where the flux linkage of a phase by its voltage and what its reading means by the map have no
// common value, a sound drive is contradicted (winding_flux.hpp). From then on one comparison is
// made a sample: of a phase at the angle shown, and in the next sample of an explanation with a
// phase:
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
// An angle that is off by less than half a step explains a small contradiction, and no other phase
// can tell: it agrees with such an angle as it does with the one shown. What tells is to hold the
// phases against each other (likeness.hpp), for which the law has to run. So a doubt waits and the
// law runs on, until the phase has left the window of this comparison; where it differs from all
// others there, until the next one has passed it. The doubt begins at once where such an angle is
// not enough, or where another phase contradicts.
//
// Phases that are wired wrongly carry currents that no control asks for. So the law runs neither in
// doubt nor before a trial of each phase alone (phase_trial.hpp). There is a second trial when the
// rotor has turned by half a stroke: where one angle leaves a zero that is off unseen, that one
// does not (docs/faults.md).
//
// A doubt ends with what is left after `patience` samples, where a round of trials has left a phase
// and an angle that is off by less than half a step, which no other phase can tell, where a current
// would pass i_max before legs that are switched off now can act, or where the phase has more flux
// linkage than i_max means.
//
// Angles are kept in steps of 15 deg, electrical, each with the angles half a step around it. A
// phase leaves an arc of them (angle_search.hpp), at first by the sample of the contradiction; the
// few that all arcs leave are asked one by one. With three phases, cables exchanged behind the
// sensors of two of them are the same as an angle that runs backwards: this is called reversed. At
// standstill offset and reversed are the same.
#pragma once

#include "srm/control/guard/angle_search.hpp"
#include "srm/control/guard/explanations.hpp"
#include "srm/control/guard/guarded.hpp"
#include "srm/control/guard/likeness.hpp"
#include "srm/control/guard/phase_trial.hpp"
#include "srm/control/guard/winding_flux.hpp"

namespace srm {

template <Real T>
struct Diagnosis {
  WindingFlux<T> flux;
  PhaseTrial<T> trial;
  Likeness<T> likeness;
  T theta_error;  // of the angle, electrical [rad]
  T i_max;        // a doubt ends before a current passes this one [A]
  int patience;   // samples of doubt, at most
  SRM_FIELDS(flux, trial, likeness, theta_error, i_max, patience)

  using Span = typename WindingFlux<T>::Span;

  /// Half a step of the angles that are kept [rad].
  static constexpr T half_step = pi<T> / T(Explanations::n_angles);

  template <int N>
  struct State {
    typename PhaseTrial<T>::State trial;
    std::array<typename WindingFlux<T>::State, N> phase;
    T u_dc{};                   // at the last sample [V]
    std::uint32_t doubted = 0;  // samples since the first contradiction, with it
    int near = -1;              // the phase of a contradiction that an angle nearby explains
    std::uint32_t near_at = 0;  // the sample of it
    T near_theta{};             // the angle there [rad]
    typename Likeness<T>::template State<N> likeness;
    int unlike = -1;         // the phase that is unlike the others
    std::uint8_t tried = 0;  // phases, when more than an angle nearby was left last
    Fault<T> first;
    Explanations left{};
    AngleSearch<T> search;
    int angle = 0, angle_phase = 0;  // asked next
    int both = 0, pair = 0;          // asked last
    // Of the phase that was contradicted first with each other one, were they exchanged: by the
    // orders of the first and the current of the other, and the other way round.
    std::array<Span, N> forth, back;
  };

  /// What the voltage says of phase k; nothing where it is the phase that is in doubt.
  template <int N>
  constexpr VoltageFlux<T> by_voltage(const State<N>& x, int k) const {
    VoltageFlux<T> said = flux.by_voltage(x.phase[k]);
    said.is = said.is && !(x.doubted > 0 && x.first.phase == k);
    return said;
  }

  /// A sample that the levels admit. guard: before it remembers this sample. True where the fault
  /// is known, which guard is told.
  template <Machine M, int N>
  constexpr bool finds(State<N>& x, typename Protection<T>::template State<N>& guard,
                       const Protection<T>& p, const M& machine, const Measurement<T, N>& y) const {
    const T u_dc = (x.u_dc + y.u_dc) / T(2);
    x.u_dc = y.u_dc;
    if (!guard.has_last) {
      x.phase = {};
      x.trial.magnetizes = false;
      x.doubted = 0;
      x.near = x.unlike = -1;
      likeness.forget(x.likeness);
      return false;
    }
    const bool in_doubt = x.doubted > 0;
    ++x.likeness.now;
    for (int k = 0; k < N; ++k) {
      auto& each = x.phase[k];
      if (in_doubt || !each.idle()) {
        flux.step(each, guard.acting[k], p, guard.i[k], y.i[k], u_dc);
      }
      if (in_doubt && x.doubted % (4U * N) != 4U * k) continue;
      ask_shown(x, p, machine, y, k);
    }
    if (x.unlike >= 0 && x.doubted == 0) {
      guard.latched = true;
      guard.fault = {Status::phase_unlike, std::int8_t(x.unlike)};
      return true;
    }
    if (x.near >= 0 && passed(x, y.theta_e)) doubts(x);
    return in_doubt && judge(x, guard, p, machine, y, u_dc);
  }

  /// The orders of a sample in which the law does not run; false where it does. Where the law
  /// begins again, no current flows.
  template <Machine M, int N>
  constexpr bool tries(State<N>& x, const Protection<T>& p, const M& machine,
                       const Measurement<T, N>& y,
                       std::type_identity_t<Command<T, N>>& orders) const {
    const bool none = PhaseTrial<T>::over(x.trial) && x.doubted == 0;
    return !none && tries_phases(x, p, machine, y, orders);
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
  [[gnu::always_inline]] constexpr void remember(
      State<N>& x, const Protection<T>& p,
      const std::type_identity_t<Command<T, N>>& orders) const {
    for (int k = 0; k < N; ++k) flux.remember(x.phase[k], p, orders[k]);
  }

 private:
  template <Machine M, int N>
  [[gnu::noinline, gnu::cold]] constexpr bool tries_phases(
      State<N>& x, const Protection<T>& p, const M& machine, const Measurement<T, N>& y,
      std::type_identity_t<Command<T, N>>& orders) const {
    return trial.step(
        x.trial, flux, x.doubted > 0, p, machine, y,
        [&](int k) -> const Span& { return x.phase[k].any; }, orders);
  }

  /// Narrows the bounds of phase k by its reading, or finds them contradicted.
  template <Machine M, int N>
  constexpr void ask_shown(State<N>& x, const Protection<T>& p, const M& machine,
                           const Measurement<T, N>& y, int k) const {
    auto& each = x.phase[k];
    const T theta_e = phase_angle_in_turn<N>(y.theta_e, k);
    if (likeness.ends(x.likeness, k, theta_e)) {  // this once in the place of the comparison
      const int before = x.likeness.suspect;
      const int found = likeness.concludes(x.likeness, k, p.flux.T_s * x.u_dc);
      if (found >= 0) x.unlike = found;
      if (x.near >= 0) waits(x, k, before);
      return;
    }
    if (k == x.near) {
      ask_near(x, p, machine, y, theta_e);
      return;
    }
    Span meant;
    const int side = flux.compare(each.shown, p, machine, y.i[k], theta_e, theta_error, meant);
    if (side != 0) {
      contradicted(x, p, y, k, side, each.shown, meant);
      return;
    }
    hear(x, p, y, k, theta_e, meant);
    each.shown.least = max(each.shown.least, meant.least);
    each.shown.most = min(each.shown.most, meant.most);
  }

  /// Adds what phase k means to what is held against the other phases, where that is known.
  template <int N>
  constexpr bool hear(State<N>& x, const Protection<T>& p, const Measurement<T, N>& y, int k,
                      T theta_e, const Span& meant) const {
    const auto& each = x.phase[k];
    if (!(y.i[k] > p.i_zero && each.age > 0)) return false;
    const T psi = (each.any.least + each.any.most) / T(2);
    const T map = (meant.least + meant.most) / T(2);
    likeness.hears(x.likeness, k, {theta_e, y.i[k], psi, map, each.taken, each.left, each.age});
    return true;
  }

  /// The phase of a contradiction that an angle nearby explains: held against this one in every
  /// second sample, heard in the others.
  template <Machine M, int N>
  [[gnu::noinline, gnu::cold]] constexpr void ask_near(State<N>& x, const Protection<T>& p,
                                                       const M& machine, const Measurement<T, N>& y,
                                                       T theta_e) const {
    const int k = x.near;
    const Span s = x.phase[k].any;
    const bool wide = (x.likeness.now & 1) != 0;
    Span meant;
    const int side = flux.compare(s, p, machine, y.i[k], theta_e,
                                  wide ? theta_error + half_step : theta_error, meant);
    if (wide) {
      if (side != 0) contradicted(x, p, y, k, side, s, meant);
    } else if (!hear(x, p, y, k, theta_e, meant) && x.likeness.suspect != k) {
      doubts(x);
    }
  }

  /// Whether the next phase has been where a contradiction was.
  template <int N>
  [[gnu::noinline, gnu::cold]] constexpr bool passed(const State<N>& x, T theta_e) const {
    constexpr T most = two_pi<T> / T(N) + two_pi<T> / T(Likeness<T>::windows);
    const T turned = wrap(theta_e - x.near_theta + pi<T>) - pi<T>;
    const auto waited = x.likeness.now - x.near_at;
    return abs(turned) > most || waited > static_cast<std::uint32_t>(patience);
  }

  /// Phase k was held against the others. before: the suspect until then. The wait goes on while
  /// the phase of the contradiction is the suspect, or has still to be held against them.
  template <int N>
  [[gnu::noinline, gnu::cold]] constexpr void waits(State<N>& x, int k, int before) const {
    const bool asked = k == x.near || before == x.near;
    if (asked && x.unlike < 0 && x.likeness.suspect != x.near) doubts(x);
  }

  /// Phase k contradicts a sound drive: only what concerns it is left.
  template <int N>
  [[gnu::noinline, gnu::cold]] constexpr void contradicted(State<N>& x, const Protection<T>& p,
                                                           const Measurement<T, N>& y, int k,
                                                           int side, const Span& s,
                                                           const Span& meant) const {
    const bool flows = y.i[k] > p.i_zero;
    if (x.doubted == 0) {
      const bool before = x.near >= 0;
      if (before && k != x.near) {
        doubts(x);
        contradicted(x, p, y, k, side, s, meant);
        return;
      }
      const Status status = side > 0 ? Status::current_too_high
                            : flows  ? Status::current_too_low
                                     : Status::dead_current_sensor;
      x.first = {status, std::int8_t(k), side > 0 ? meant.least : meant.most,
                 side > 0 ? s.most : s.least};
      x.search = {};
      x.search.turn = 2 * k + (side > 0);
      begin(x.search, x.phase[k].any, p, y.i[k], y.theta_e);
      if (before || x.trial.rounds != 0 || !flows || x.phase[k].left > flux.psi_error) {
        doubts(x);
      } else {
        x.near = k;
        x.near_at = x.likeness.now;
        x.near_theta = y.theta_e;
      }
    } else if (k != x.first.phase) {
      const auto with = static_cast<std::uint8_t>(1U << k);
      x.left.phase = 0;
      x.left.power &= with;
      x.left.sensors &= with;
      x.left.both &= with;
    }
  }

  /// The doubt begins, with the contradiction that was found first.
  template <int N>
  constexpr void doubts(State<N>& x) const {
    const unsigned k = 1U << x.first.phase;
    const auto others = static_cast<std::uint8_t>(((1U << N) - 1) & ~k);
    x.left = {.phase = std::uint8_t(k), .power = others, .sensors = others, .both = others};
    x.doubted = 1;
    x.near = -1;
  }

  /// One more sample in doubt.
  template <Machine M, int N>
  [[gnu::noinline, gnu::cold]] constexpr bool judge(
      State<N>& x, typename Protection<T>::template State<N>& guard, const Protection<T>& p,
      const M& machine, const Measurement<T, N>& y, T u_dc) const {
    cross(x, guard, p, y, u_dc);
    const T least = x.phase[x.first.phase].any.least;
    if (y.i[x.first.phase] <= p.i_zero && least > flux.psi_zero) x.left.no_angle();
    if (x.unlike == x.first.phase && x.left.phase != 0) {
      x.left.no_angle();
      x.left.power = x.left.sensors = 0;
    }
    bool beyond = least > flux.psi_max;
    const T ahead = static_cast<T>(1 + p.delay);  // until legs that are switched off now act
    for (int k = 0; k < N; ++k) {
      if (y.i[k] + ahead * (y.i[k] - guard.i[k]) > i_max) beyond = true;
    }
    const int turn = static_cast<int>(x.doubted % 4);
    const bool pairs = (x.left.power | x.left.sensors) != 0;
    if (turn == 1 && pairs) {
      ask_pair(x, p, machine, y);
    } else if (turn == 1 || (turn == 2 && pairs)) {
      search(x, p, machine, y);
    } else if (turn == 3 && x.left.both != 0) {
      ask_both(x, p, machine, y);
    } else if (turn != 0) {  // then a phase was asked at the angle shown
      ask_angle(x, p, machine, y);
    }
    ++x.doubted;
    if (!x.left.nearby()) x.tried = x.trial.tried;
    if (beyond) {  // every phase once more: the law does not run in this sample
      for (int j = 0; j < N; ++j) ask_shown(x, p, machine, y, j);
      return named(x, guard, true);
    }
    return turn != 1 && named(x, guard, false);  // the dearest sample concludes later
  }

  /// Moves the bounds of phases that may be exchanged, or begins with them.
  template <int N>
  constexpr void cross(State<N>& x, const typename Protection<T>::template State<N>& guard,
                       const Protection<T>& p, const Measurement<T, N>& y, T u_dc) const {
    const unsigned left = x.left.power | x.left.sensors;
    if (left == 0) return;
    const int k = x.first.phase;
    for (int j = 0; j < N; ++j) {
      if ((left >> j & 1) == 0) continue;
      if (x.doubted == 1) {
        x.forth[j] = begun(x.phase[k], p, y.i[j]);
        x.back[j] = begun(x.phase[j], p, y.i[k]);
        continue;
      }
      flux.advance(x.forth[j],
                   flux.push_of(x.phase[k], guard.acting[k], p, guard.i[j], y.i[j], u_dc),
                   x.phase[j].drop);
      flux.advance(x.back[j],
                   flux.push_of(x.phase[j], guard.acting[j], p, guard.i[k], y.i[k], u_dc),
                   x.phase[k].drop);
    }
  }

  /// By the orders of a phase and the current i of another, which was at most the trip level.
  constexpr Span begun(const typename WindingFlux<T>::State& ordered, const Protection<T>& p,
                       T i) const {
    const T drop = static_cast<T>(ordered.age) * p.flux.T_s * p.flux.R * (T(1) + flux.R_error);
    const T flows = i * (T(1) + flux.i_gain) + p.flux.i_error;
    return {.least = max(ordered.any.least - drop * p.levels.i_trip, T(0)),
            .most = i <= p.i_zero      ? flux.psi_zero
                    : flows <= trial.i ? trial.psi
                    : flows <= i_max   ? flux.psi_max
                                       : never<T>};
  }

  /// Drops the angles where a phase has less flux linkage with its current than it must have, or
  /// more than it can have, at the sample where the search began.
  template <Machine M, int N>
  constexpr void search(State<N>& x, const Protection<T>& p, const M& machine,
                        const Measurement<T, N>& y) const {
    AngleSearch<T>& at = x.search;
    if (!at.ends()) {
      if (!at.step(machine)) x.left.no_angle();
      return;
    }
    if (at.found) {
      at.template narrow<Explanations::n_angles, N>(x.left.offset, x.left.reversed, theta_error);
    }
    at.turn = at.turn + 1 < 2 * N ? at.turn + 1 : 0;
    begin(at, x.phase[at.phase()].any, p, y.i[at.phase()], y.theta_e);
  }

  /// Begins a search where a sample tells something.
  constexpr void begin(AngleSearch<T>& at, const Span& any, const Protection<T>& p, T i,
                       T theta_e) const {
    const auto y = flux.reading(p, i);
    at.found = at.least() ? any.least > flux.psi_error : y.flows && y.part < T(1);
    if (!at.found) return;
    const T psi = at.least() ? (any.least - flux.psi_error) / (T(1) + y.part)
                             : (any.most + flux.psi_error) / (T(1) - y.part);
    at.begin(psi, y.i, theta_e);
  }

  /// The next angle that is left is held against the next phase.
  template <Machine M, int N>
  constexpr void ask_angle(State<N>& x, const Protection<T>& p, const M& machine,
                           const Measurement<T, N>& y) const {
    constexpr int n_angles = Explanations::n_angles;
    constexpr T step = two_pi<T> / T(n_angles);
    const int n = x.left.next(x.angle);
    if (n < 0) return;
    const int k = n == x.angle ? x.angle_phase : 0;
    const T theta_e =
        (Explanations::backwards(n) ? -y.theta_e : y.theta_e) + static_cast<T>(n) * step;
    Span meant;
    const int side =
        flux.compare(x.phase[k].any, p, machine, y.i[k], phase_angle<N>(wrap(theta_e), k),
                     theta_error + step / T(2), meant);
    if (side != 0) x.left.drop_angle(n);
    x.angle_phase = side != 0 || k + 1 == N ? 0 : k + 1;
    x.angle = x.angle_phase == 0 ? (n + 1) % (2 * n_angles) : n;
  }

  /// Whether the windings or the channels of two phases are exchanged: held against one of them.
  template <Machine M, int N>
  constexpr void ask_pair(State<N>& x, const Protection<T>& p, const M& machine,
                          const Measurement<T, N>& y) const {
    for (int tries = 0; tries < 2; ++tries) {
      x.pair = x.pair + 1 < 4 * N ? x.pair + 1 : 0;
      const int j = x.pair / 4, k = x.first.phase;
      const bool power = x.pair % 2 == 0, forth = x.pair % 4 < 2;
      std::uint8_t& left = power ? x.left.power : x.left.sensors;
      const int from = forth ? k : j, to = forth ? j : k;
      const Span& s = forth ? x.forth[j] : x.back[j];
      if ((left >> j & 1) == 0 || !flux.tells(s, p, y.i[to])) continue;
      drop(left, j, s, p, machine, y.i[to], phase_angle_in_turn<N>(y.theta_e, power ? to : from));
      return;
    }
  }

  /// The same where both are exchanged.
  template <Machine M, int N>
  constexpr void ask_both(State<N>& x, const Protection<T>& p, const M& machine,
                          const Measurement<T, N>& y) const {
    for (int tries = 0; tries < 2; ++tries) {
      x.both = x.both + 1 < 2 * N ? x.both + 1 : 0;
      const int j = x.both / 2, k = x.first.phase;
      const int from = x.both % 2 == 0 ? k : j, to = j + k - from;
      const Span& s = x.phase[from].any;
      if ((x.left.both >> j & 1) == 0 || !flux.tells(s, p, y.i[from])) continue;
      drop(x.left.both, j, s, p, machine, y.i[from], phase_angle_in_turn<N>(y.theta_e, to));
      return;
    }
  }

  /// Drops an exchange with phase j where a reading contradicts it.
  template <Machine M>
  constexpr void drop(std::uint8_t& left, int j, const Span& s, const Protection<T>& p,
                      const M& machine, T i, T theta_e) const {
    Span meant;
    if (flux.compare(s, p, machine, i, theta_e, theta_error, meant) == 0) return;
    left = static_cast<std::uint8_t>(left & ~(1U << j));
  }

  /// True where one kind of explanation is left, none, or the doubt ends. beyond: by a current.
  template <int N>
  constexpr bool named(const State<N>& x, typename Protection<T>::template State<N>& guard,
                       bool beyond) const {
    const Explanations& left = x.left;
    const bool mirrored = N == 3 && left.both != 0;
    const unsigned exchanged = left.power | left.sensors | (N == 3 ? 0U : unsigned(left.both));
    const bool reversed = left.reversed != 0 || mirrored;
    const int kinds = (left.phase != 0) + (left.offset != 0) + reversed + (exchanged != 0);
    const bool futile = static_cast<std::uint8_t>(x.trial.tried - x.tried) > N;
    const bool ends = futile || x.doubted > static_cast<std::uint32_t>(patience);
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

}  // namespace srm
