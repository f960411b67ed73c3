// Order of the phases, direction and zero of the encoder: where a free rotor comes to rest when a
// phase carries current.
//
// Each phase k is entered from every other one. Friction stops the rotor short of alignment; so the
// rests after a turn in either direction are averaged. A phase that is half a period away cannot
// turn the rotor, and a turn below an eighth of a period does not count.
//
// An aligned rotor swings. Between two turning points, whose middle is the rest, the current is low
// while the rotor comes and high while it goes: each swing takes energy out.
#pragma once

#include "srm/control/commission/current_hold.hpp"
#include "srm/control/commission/finding.hpp"

namespace srm {

/// The swing of a rotor about its rest, from the angle alone.
template <Real T>
struct Swing {
  T low{}, high{};    // last turning points [rad]
  T extreme{};        // reached since [rad]
  bool rises = true;  // away from `low`
  int turned = 0;     // turning points so far
  T place{};          // where it was when it last moved on [rad]
  int idle = 0;       // samples since then

  constexpr void start(T x) {
    *this = {};
    low = high = extreme = place = x;
  }

  /// A return by more than `slack` is a turning point, a motion by less than `still` is none [rad].
  constexpr void follow(T x, T slack, T still) {
    ++idle;
    if (abs(x - place) > still) {
      place = x;
      idle = 0;
    }
    if (rises ? x > extreme : x < extreme) extreme = x;
    if (turned == 0 && rises && x < low - slack) {  // it turns the other way from the start
      rises = false;
      extreme = x;
    }
    if (!(rises ? x < extreme - slack : x > extreme + slack)) return;
    (rises ? high : low) = extreme;
    rises = !rises;
    extreme = x;
    ++turned;
  }

  /// True while it comes nearer to the middle of its last turning points, in a swing that is wide.
  constexpr bool comes(T x, T wide) const {
    if (turned < 2 || high - low < wide) return false;
    return rises ? x < (low + high) / T(2) : x > (low + high) / T(2);
  }
};

template <Real T>
struct Alignment {
  CurrentHold<T> hold;
  T i_hold;    // [A]
  T i_low;     // while the rotor swings back [A]
  T slack;     // electrical: a return by more is a turning point [rad]
  int n_rest;  // of a rotor that stays within some slack: then it is at rest [samples]
  int n_wait;  // longest wait for it [samples]
  SRM_FIELDS(hold, i_hold, i_low, slack, n_rest, n_wait)

  static constexpr T wide_slack = T(4);   // a swing wider than this is taken energy from
  static constexpr T still_slack = T(6);  // one less wide is a rest: its mean is taken
  static constexpr int idle_part = 2;     // of n_rest: one slower than at rest for so long is held

  template <int N>
  struct State {
    Finding finding = Finding::running;
    int first = 0, second = 1, visit = 0;  // a pair of phases: first, second, first
    int n = 0;                             // samples of this visit
    int still = 0;                         // samples within the slack
    T x{}, before{}, shown{};          // angle since the start, at the last rest; as shown [rad]
    T base{}, least{}, most{}, sum{};  // of the angle while it is still [rad]
    Swing<T> swing;
    typename CurrentHold<T>::State current;
    std::array<T, N> below{}, above{};  // sums of the rests, by the side it came from [rad]
    std::array<int, N> n_below{}, n_above{};
    std::array<std::int32_t, N> place{};  // of each leg, in the order of the rising angle
    std::int32_t direction = 0;  // 1: the angle rises as the legs follow each other, -1: it falls,
                                 // 0: they do not follow each other
    T zero{};                    // angle shown where leg 0 is unaligned [rad]
    T spread{};                  // greatest distance of a rest from its place [rad]
    constexpr T progress() const {
      const int pairs = first * (2 * N - first - 1) / 2 + second - first - 1;
      return static_cast<T>(3 * pairs + visit) / static_cast<T>(3 * N * (N - 1) / 2);
    }
  };

  template <int N>
  constexpr Command<T, N> step(State<N>& x, const Measurement<T, N>& y, T T_s) const {
    const bool begins = x.n == 0;
    if (begins && x.first == 0 && x.second == 1 && x.visit == 0) x.shown = y.theta_e;
    x.x = x.x + (wrap(y.theta_e - x.shown + pi<T>) - pi<T>);
    x.shown = y.theta_e;
    if (begins) x.swing.start(x.x);
    x.swing.follow(x.x, slack, still_slack / T(idle_part) * slack);
    const int k = x.visit == 1 ? x.second : x.first;
    if (x.swing.idle > n_rest / idle_part) x.swing.start(x.x);  // friction holds it
    const bool comes = x.swing.comes(x.x, wide_slack * slack);
    const T duty = hold.step(x.current, comes ? i_low : i_hold, y.i[k], y.u_dc, -hold.duty_max);
    if (begins || comes || !within(x)) {
      x.still = 0;
      x.base = x.least = x.most = x.x;
      x.sum = T(0);
    }
    // A triangle over time: what is left of a swing averages out.
    const T weight = static_cast<T>(x.still < n_rest / 2 ? x.still : n_rest - x.still);
    x.sum = x.sum + weight * (x.x - x.base);
    ++x.still;
    ++x.n;
    if (x.still >= n_rest) {
      if (y.i[k] < i_low / T(2)) {
        x.finding = Finding::no_current;
      } else {
        const T half = static_cast<T>(n_rest) / T(2);
        rest(x, k, x.base + x.sum / (half * half));
      }
    } else if (x.n > n_wait) {
      x.finding = Finding::too_long;
    }
    return drive_one<T, N>(k, duty, T_s);
  }

 private:
  /// The angle stays within some slack since it was still.
  template <int N>
  constexpr bool within(State<N>& x) const {
    x.least = min(x.least, x.x);
    x.most = max(x.most, x.x);
    return x.most - x.least <= still_slack * slack;
  }

  /// Takes a rest at phase k, and goes on to the next phase.
  template <int N>
  constexpr void rest(State<N>& x, int k, T at) const {
    const T shown = x.shown + (at - x.x);
    const T turned = at - x.before;
    const bool entered = x.visit > 0 || x.first > 0 || x.second > 1;
    if (entered && abs(turned) > pi<T> / T(4)) {
      const bool up = turned > T(0);
      std::array<T, N>& sum = up ? x.below : x.above;
      int& n = (up ? x.n_below : x.n_above)[k];
      // Angles about the first rest: they may lie on both sides of zero.
      const T first = n > 0 ? sum[k] / static_cast<T>(n) : shown;
      sum[k] = sum[k] + first + (wrap(shown - first + pi<T>) - pi<T>);
      ++n;
    }
    x.before = at;
    x.n = 0;
    x.current = {};
    if (++x.visit < 3) return;
    x.visit = 0;
    if (++x.second < N) return;
    if (++x.first < N - 1) {
      x.second = x.first + 1;
      return;
    }
    conclude(x);
  }

  template <int N>
  constexpr void conclude(State<N>& x) const {
    constexpr T stroke = two_pi<T> / T(N);
    std::array<T, N> at{};
    for (int k = 0; k < N; ++k) {
      if (x.n_below[k] == 0 || x.n_above[k] == 0) {
        x.finding = Finding::no_motion;
        return;
      }
      const T low = x.below[k] / static_cast<T>(x.n_below[k]);
      const T high = x.above[k] / static_cast<T>(x.n_above[k]);
      at[k] = low + (wrap(high - low + pi<T>) - pi<T>) / T(2);
    }
    T off = T(0);  // mean distance from the places that leg 0 gives
    std::array<T, N> distance{};
    int found = 0;
    for (int k = 0; k < N; ++k) {
      const T strokes = floor(wrap(at[k] - at[0]) / stroke + T(0.5));
      distance[k] = wrap(at[k] - at[0] - strokes * stroke + pi<T>) - pi<T>;
      x.place[k] = static_cast<std::int32_t>(strokes) % N;
      found |= 1 << x.place[k];
      off = off + distance[k] / T(N);
    }
    for (const T d : distance) x.spread = max(x.spread, abs(d - off));
    if (found != (1 << N) - 1 || x.spread > stroke / T(4)) {
      x.finding = Finding::no_order;
      return;
    }
    x.zero = wrap(at[0] + off + pi<T>);
    bool follow = true, reversed = true;
    for (int k = 0; k < N; ++k) {
      follow = follow && x.place[k] == k;
      reversed = reversed && x.place[k] == (N - k) % N;
    }
    x.direction = follow ? 1 : reversed ? -1 : 0;
    x.finding = Finding::done;
  }
};

}  // namespace srm
