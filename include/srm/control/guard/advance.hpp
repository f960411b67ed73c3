// Whether the angle advances as a rotor can turn.
//
// Where the speed comes from the angle itself, an observer's say, three angles are held against
// each other, tau = parts `block` T_s apart. The errors of two angles differ by `slack` at most, so
// for a rotor that accelerates by a at most
//
//   |(theta - theta_1) - (theta_1 - theta_0)| <= 2 slack + a tau^2
//
// A change of the speed is seen within tau and a block from (2 slack + a tau^2)/tau on, a jump at
// the end of a block. The least such change is 2 sqrt(2 slack a), with tau = sqrt(2 slack/a).
//
// Where another sensor gives the speed (block = 0), the angle has to advance by N_r omega_m T_s a
// sample. What it does not is the slip; it is summed, and forgotten by 1/64 a sample, so that a
// speed error of 1 % never adds up to one sample's advance. The fault is |slip| > slack: one sample
// after the angle freezes where a sample turns the rotor further than that, ceil(slack/advance)
// samples when slower, never below slack/64 a sample.
#pragma once

#include <array>

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"

namespace srm {

template <Real T>
struct Advance {
  T bend;     // a tau^2, electrical [rad]
  int block;  // samples from one angle that is kept to the next; 0: the speed is measured apart
  SRM_FIELDS(bend, block)

  static constexpr int parts = 8;  // blocks of tau

  struct State {
    T slip{};
    std::array<T, 2 * parts> theta_e{};  // at the ends of blocks, the oldest at `next`
    int kept = 0;                        // of them, since the samples began
    int next = 0;
    int n = 0;  // samples since the last one
  };

  /// By what the angle is further than a rotor can turn, or less far [rad]; 0: by no more than
  /// most(slack). from, theta_e: at the last sample and now; turned: what the speed says [rad].
  /// counted: false leaves the code for a speed from the angle out.
  template <bool counted = true>
  constexpr T beyond(State& x, T from, T theta_e, T turned, T slack) const {
    if (!counted || block == 0) {
      x.slip = x.slip * T(63.0 / 64) + (shortest(theta_e - from) - turned);
      return abs(x.slip) > slack ? x.slip : T(0);
    }
    if constexpr (counted) {
      if (++x.n < block) return T(0);
      x.n = 0;
      return bent(x, theta_e, slack);
    }
  }

  constexpr T most(T slack) const { return block == 0 ? slack : T(2) * slack + bend; }

 private:
  /// At the end of a block.
  // noinline: the target calls it in two places.
  [[gnu::noinline]] constexpr T bent(State& x, T theta_e, T slack) const {
    T& oldest = x.theta_e[x.next];
    const T before = oldest, middle = x.theta_e[x.next ^ parts];
    oldest = theta_e;
    x.next = (x.next + 1) % (2 * parts);
    if (x.kept < 2 * parts) {
      ++x.kept;
      return T(0);
    }
    const T turn = shortest(shortest(theta_e - middle) - shortest(middle - before));
    return abs(turn) > most(slack) ? turn : T(0);
  }

  /// The same turn within half a period, of a difference of two angles in [-2 pi, 2 pi].
  static constexpr T shortest(T turn) {
    if (turn > pi<T>) return turn - two_pi<T>;
    return turn < -pi<T> ? turn + two_pi<T> : turn;
  }
};

}  // namespace srm
