// The border between the desk, which simulates in double, and a controller in its own precision.
#pragma once

#include <concepts>

#include "srm/control/frame/drive_control.hpp"
#include "srm/sim/controller.hpp"
#include "srm/sim/tables.hpp"

namespace srm {

/// One step of a controller. Measurement and orders change precision here, as they would at the
/// target's sensors and timers.
template <ControlLaw Law>
Orders<Law::n_phases> step_on_desk(const DriveControl<Law>& control,
                                   typename DriveControl<Law>::State& state,
                                   const Measurement<double, Law::n_phases>& y, double reference) {
  using T = typename Law::Scalar;
  constexpr int N = Law::n_phases;
  Measurement<T, N> seen;
  assign(seen, y);
  seen.theta_e = wrap(seen.theta_e);
  const auto step = [&]() -> Orders<N> {
    if constexpr (std::same_as<T, double>) {
      return {.command = control.step(state, seen, reference)};  // without a copy
    } else {
      Orders<N> orders;
      assign(orders.command, control.step(state, seen, static_cast<T>(reference)));
      return orders;
    }
  };
  Orders<N> orders = step();
  orders.tau_ref = state.frame.tau_ref;
  if constexpr (requires { Law::learned(state.law); }) {
    assign(orders.learned, Law::learned(state.law));
  }
  return orders;
}

/// Closes a controller over its state and the tables that it views.
template <ControlLaw Law>
Controller<Law::n_phases> on_desk(const DriveControl<Law>& control,
                                  std::shared_ptr<const void> tables) {
  return [control, tables, state = typename DriveControl<Law>::State{}](
             const Measurement<double, Law::n_phases>& y, double reference) mutable {
    return step_on_desk(control, state, y, reference);
  };
}

}  // namespace srm
