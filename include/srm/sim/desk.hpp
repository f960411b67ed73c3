// The border between the desk, which simulates in double, and a controller in its own precision.
#pragma once

#include "srm/control/frame/drive_control.hpp"
#include "srm/sim/controller.hpp"
#include "srm/sim/tables.hpp"

namespace srm {

/// Closes a controller over its state and the tables that it views. Measurement and orders change
/// precision here, as they would at the target's sensors and timers.
template <ControlLaw Law>
Controller<Law::n_phases> on_desk(const DriveControl<Law>& control,
                                  std::shared_ptr<const void> tables) {
  using T = typename Law::Scalar;
  constexpr int N = Law::n_phases;
  return [control, tables, state = typename DriveControl<Law>::State{}](
             const Measurement<double, N>& y, double reference) mutable {
    Measurement<T, N> seen;
    assign(seen, y);
    seen.theta_e = wrap(seen.theta_e);
    const Command<T, N> command = control.step(state, seen, static_cast<T>(reference));
    Orders<N> orders;
    assign(orders.command, command);
    orders.tau_ref = state.tau_ref;
    return orders;
  };
}

}  // namespace srm
