// A machine whose phases share iron, as a law knows it that computes with the pairs themselves: the
// magnetics of a phase alone, and what two currents at once add.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/machine/coupling.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

/// Whether machines of a model may have pairs.
template <class M>
inline constexpr bool may_couple = requires {
  M::may_couple;
};

template <Machine M>
struct WithPairs {
  using Scalar = typename M::Scalar;
  using T = Scalar;

  M map;
  int N_r;  // rotor poles
  Coupling<T> pairs;
  SRM_FIELDS(map, N_r, pairs)

  /// One phase, the others without current. i >= 0 [A], theta_e in [0, 2 pi).
  [[gnu::always_inline]] constexpr Magnetics<T> at(T i, T theta_e) const {
    return map.at(i, theta_e);
  }

  /// Where nothing is asked of a phase with less, it counts as one without current [A]. By the
  /// pairs alone, so that it is the same whatever stands for the map: not every one has an end.
  constexpr T no_current() const { return no_current_part<T> * i_last(pairs); }

  /// The name of what is wrong with the phases alone; null where nothing is.
  constexpr const char* fault() const { return map.fault(); }
};

template <class M>
inline constexpr bool has_pairs = requires(M machine) {
  machine.pairs;
};

/// The pairs that a law computes with, its machine's or its own; null where it knows none.
template <class Law>
constexpr const Coupling<typename Law::Scalar>* pairs_of(const Law& law) {
  if constexpr (requires { law.machine.pairs; }) {
    return &law.machine.pairs;
  } else if constexpr (requires { law.known_pairs; }) {
    return &law.known_pairs;
  } else if constexpr (requires { law.pairs; }) {
    return &law.pairs;
  } else {
    return nullptr;
  }
}

/// What the pairs add to the torque of the sense that is asked for, by the measured currents [N m].
template <class M, class Measured, class T>
constexpr T pair_torque(const M& machine, const Measured& y, T tau_ref) {
  const T tau = machine.pairs.torque(y.i, y.theta_e);
  return tau_ref < T(0) ? -tau : tau;
}

}  // namespace srm
