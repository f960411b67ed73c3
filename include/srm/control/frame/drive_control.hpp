// The whole controller: a control law, and the frame around it.
//
// Where the phases couple, the law knows them alone. The torque that their pairs add, at the
// currents and the angle of the sample, is taken off what is asked of the law: so much the phases
// alone have to give. A reference keeps its sign, and zero stays zero.
#pragma once

#include "srm/control/frame/frame.hpp"
#include "srm/machine/with_pairs.hpp"

namespace srm {

/// Whether a law that learns its machine takes pairs into account itself (learning.hpp).
template <class Law>
inline constexpr bool learns_pairs = requires(Law law, typename Law::State x) {
  Law::learned(x);
  law.pairs;
};

template <ControlLaw Law>
struct DriveControl {
  using Scalar = typename Law::Scalar;
  using T = Scalar;
  static constexpr int n_phases = Law::n_phases;

  Law law;
  Frame<T> frame{};
  Coupling<T> coupling{};  // as the controller knows it; by default none
  SRM_FIELDS(law, frame, coupling)

  struct State {
    typename Law::State law;
    typename Frame<T>::template State<n_phases> frame;
  };

  /// The pairs, where the control knows them: the law itself, or the frame for it.
  constexpr const Coupling<T>& pairs() const {
    const Coupling<T>* own = pairs_of(law);
    return own != nullptr && own->any() ? *own : coupling;
  }

  /// What these parameters use.
  constexpr Uses uses() const {
    Uses used = frame.uses();
    used.pairs = coupling.any() && frame.outer != Outer::none;
    if constexpr (learns_pairs<Law>) used.learned_pairs = law.pairs.any();
    return used;
  }

  /// reference: as `frame.outer` says; torque [N m] or speed [rad/s].
  template <Uses used = Uses{}>
  Command<T, n_phases> step(State& state, const Measurement<T, n_phases>& y, T reference) const {
    return step<used>(state, y, reference, frame.tuning());
  }

  /// The same with another tuning than the one that it was built with.
  template <Uses used = Uses{}>
  Command<T, n_phases> step(State& state, Measurement<T, n_phases> y, T reference,
                            const Tuning<T>& tuned) const {
    T asked = frame.template before<used, n_phases>(state.frame, y, reference, tuned);
    if constexpr (used.pairs) asked = of_phases_alone(asked, y);
    Command<T, n_phases> orders = ordered<used>(state.law, y, asked);
    frame.template after<used, n_phases>(state.frame, y, orders, tuned);
    return orders;
  }

 private:
  template <Uses used>
  Command<T, n_phases> ordered(typename Law::State& state, const Measurement<T, n_phases>& y,
                               T asked) const {
    if constexpr (learns_pairs<Law>) {
      return law.template step<used.learned_pairs>(state, y, asked);
    } else {
      return law.step(state, y, asked);
    }
  }

  T of_phases_alone(T asked, const Measurement<T, n_phases>& y) const {
    if (!coupling.any() || frame.outer == Outer::none) return asked;
    return coupling.left_for_phases(asked, y.i, y.theta_e);
  }
};

}  // namespace srm
