// The whole controller: a control law, and the frame around it.
#pragma once

#include "srm/control/frame/frame.hpp"

namespace srm {

template <ControlLaw Law>
struct DriveControl {
  using Scalar = typename Law::Scalar;
  using T = Scalar;
  static constexpr int n_phases = Law::n_phases;

  Law law;
  Frame<T> frame{};
  SRM_FIELDS(law, frame)

  struct State {
    typename Law::State law;
    typename Frame<T>::template State<n_phases> frame;
  };

  /// reference: as `frame.outer` says; torque [N m] or speed [rad/s].
  template <Uses used = Uses{}>
  Command<T, n_phases> step(State& state, const Measurement<T, n_phases>& y, T reference) const {
    return step<used>(state, y, reference, frame.tuning());
  }

  /// The same with another tuning than the one that it was built with.
  template <Uses used = Uses{}>
  Command<T, n_phases> step(State& state, Measurement<T, n_phases> y, T reference,
                            const Tuning<T>& tuned) const {
    const T asked = frame.template before<used, n_phases>(state.frame, y, reference, tuned);
    Command<T, n_phases> orders = law.step(state.law, y, asked);
    frame.template after<used, n_phases>(state.frame, y, orders, tuned);
    return orders;
  }
};

}  // namespace srm
