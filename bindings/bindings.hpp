// Shared by the binding files: what Python holds of the core, and the way from run-time choices
// (machine model, phase count, precision) to the templates.
//
// What is a template: scalar, phase count, machine model. What is decided at run time: everything
// else. A control law is reached through one std::function per sample, so the loop is compiled per
// machine and phase count only, and a new law adds its own file here (docs/adr/0005).
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "describe.hpp"
#include "flux_map_table.hpp"
#include "srm/control/drive_control.hpp"
#include "srm/machine/lehuy.hpp"
#include "srm/sim/sampling.hpp"

namespace bound {

namespace nb = nanobind;

using AnyMachine = std::variant<srm::LeHuy<double>, FluxMapTable<double>>;

/// A controller for 2 to 6 phases, with the tables that its law points into.
struct AnyController {
  std::variant<srm::Controller<2>, srm::Controller<3>, srm::Controller<4>, srm::Controller<5>,
               srm::Controller<6>>
      step;
  std::function<nb::object()> description;  // for export (describe.hpp); empty: not supported
};

/// Read-only arrays from Python, in C order.
using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

template <srm::Real T>
srm::LeHuy<T> in_precision(const srm::LeHuy<double>& m) {
  return {m.N_r, T(m.L_u), T(m.L_sat), T(m.A), T(m.B), T(m.i_sat)};
}

/// Calls f.template operator()<N>() for the phase count.
template <class F>
auto with_phases(int n_phases, F&& f) {
  switch (n_phases) {
    case 2:
      return f.template operator()<2>();
    case 3:
      return f.template operator()<3>();
    case 4:
      return f.template operator()<4>();
    case 5:
      return f.template operator()<5>();
    case 6:
      return f.template operator()<6>();
  }
  throw std::invalid_argument("n_phases = " + std::to_string(n_phases) + ", need 2 to 6");
}

/// What every law is given beside its own parameters.
struct Setting {
  AnyMachine machine;  // the controller's own model
  int n_phases;
  bool single;  // float, as on the target; else double
  srm::Outer outer;
  srm::SpeedPi<double> speed;
  double tracker_bandwidth;  // [rad/s]; 0: angle and speed are used as measured
  srm::Comparators comparators;
  double t_dead;  // of the converter [s]
};

/// The law with all that stands around it.
template <class Law>
srm::DriveControl<Law> drive_control(const Law& law, const Setting& s) {
  using T = typename Law::Scalar;
  const srm::SpeedPi<T> speed{T(s.speed.K_p), T(s.speed.K_i), T(s.speed.tau_min),
                              T(s.speed.tau_max), T(s.speed.T_s)};
  const int N_r = std::visit([](const auto& machine) { return machine.N_r; }, s.machine);
  const srm::Motion motion = s.tracker_bandwidth > 0 ? srm::Motion::tracked : srm::Motion::measured;
  const srm::AngleTracker<T> tracker{T(s.speed.T_s), T(s.tracker_bandwidth), N_r};
  return {law, s.outer, speed, motion, tracker, s.comparators, T(s.t_dead)};
}

/// Closes law, speed loop and state into the controller that the loop calls; measurement and
/// orders change precision at this border, as they would at the target's sensors and timers.
template <class Law>
srm::Controller<Law::n_phases> close(const srm::DriveControl<Law>& control,
                                     std::shared_ptr<void> tables) {
  using T = typename Law::Scalar;
  constexpr int N = Law::n_phases;
  return [control, tables, state = typename srm::DriveControl<Law>::State{}](
             const srm::Measurement<double, N>& y, double reference) mutable {
    srm::Measurement<T, N> seen;
    for (int k = 0; k < N; ++k) seen.i[k] = T(y.i[k]);
    seen.theta_e = srm::wrap(T(y.theta_e));
    seen.omega_m = T(y.omega_m);
    seen.u_dc = T(y.u_dc);
    const srm::Command<T, N> command = control.step(state, seen, T(reference));
    srm::Orders<N> orders;
    orders.tau_ref = state.tau_ref;
    for (int k = 0; k < N; ++k) {
      const srm::PhaseCommand<T>& c = command[k];
      orders.command[k] = {.leg = c.leg,
                           .gate = c.gate,
                           .chop = c.chop,
                           .i_ref = c.i_ref,
                           .i_band = c.i_band,
                           .theta_on = c.theta_on,
                           .theta_off = c.theta_off};
      for (int n = 0; n < srm::max_edges; ++n) orders.command[k].t_edge[n] = c.t_edge[n];
    }
    return orders;
  };
}

/// Controller and machine as trees, built when they are asked for.
template <class Law, class M>
std::function<nb::object()> description(const srm::DriveControl<Law>& control, const M& machine,
                                        std::shared_ptr<void> tables) {
  if constexpr (requires { described(control.law); }) {
    return [control, machine, tables] {
      nb::dict nodes;
      nodes["control"] = described(control);
      nodes["machine"] = described(machine);
      return nodes;
    };
  }
  return {};
}

/// Makes the controller of a law. `make.template operator()<T, N>(machine)` returns the law and
/// the shared owner of its tables as a pair.
template <class Make>
AnyController controller(const Setting& s, Make&& make) {
  return std::visit(
      [&](const auto& machine) {
        return with_phases(s.n_phases, [&]<int N>() -> AnyController {
          const auto closed = [&]<class T>() -> AnyController {
            const auto model = in_precision<T>(machine);
            const auto [law, tables] = make.template operator()<T, N>(model);
            const auto control = drive_control(law, s);
            return {close(control, tables), description(control, model, tables)};
          };
          return s.single ? closed.template operator()<float>()
                          : closed.template operator()<double>();
        });
      },
      s.machine);
}

void bind_angle_offset(nb::module_& m);
void bind_angle_tracker(nb::module_& m);
void bind_angles(nb::module_& m);
void bind_box_qp(nb::module_& m);
void bind_controller(nb::module_& m);
void bind_deadbeat(nb::module_& m);
void bind_ditc(nb::module_& m);
void bind_edge_mpc(nb::module_& m);
void bind_finite_set_mpc(nb::module_& m);
void bind_incremental_mpc(nb::module_& m);
void bind_law_parts(nb::module_& m);
void bind_flux_map(nb::module_& m);
void bind_machine(nb::module_& m);
void bind_guide(nb::module_& m);
void bind_paper_mpc(nb::module_& m);
void bind_pwm_current(nb::module_& m);
void bind_simulation(nb::module_& m);
void bind_step_time(nb::module_& m);
void bind_torque_sharing(nb::module_& m);

}  // namespace bound
