// Shared by the binding files: what Python holds of the core, and the way from run-time choices
// (machine model, phase count, precision) to the templates.
//
// What is a template: scalar, phase count, machine model. What is decided at run time: everything
// else. A control law is reached through one std::function per sample, so the loop is compiled per
// machine and phase count only, and a new law adds its own file here (docs/adr/0005).
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "arrays.hpp"
#include "describe.hpp"
#include "srm/machine/flux_map.hpp"
#include "srm/machine/lehuy.hpp"
#include "srm/sim/desk.hpp"

namespace bound {

using AnyMachine = std::variant<srm::Held<srm::LeHuy<double>>, srm::Held<srm::FluxMap<double>>>;

/// A controller for 2 to 6 phases.
struct AnyController {
  std::variant<srm::Controller<2>, srm::Controller<3>, srm::Controller<4>, srm::Controller<5>,
               srm::Controller<6>>
      step;
  std::function<nb::object()> description;  // for export (describe.hpp); empty: not supported
};

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

/// What every law is given in addition to its own parameters.
struct Setting {
  AnyMachine machine;  // the controller's own model
  int n_phases;
  bool single;  // float, as on the target; else double
  srm::Outer outer;
  srm::SpeedPi<double> speed;
  srm::SpeedRamp<double> ramp;
  srm::LoadTorque load;
  srm::Motion motion;
  srm::AngleTracker<double> tracker;
  int delay;  // samples from measurement to effect
  srm::Comparators comparators;
  double t_dead;              // of the converter [s]
  srm::PvControl<double> pv;  // used with Outer::pv
  srm::EdgeLimits<double> edges;
  double u_brake_full, u_brake_none;  // [V]
  srm::UserLimits<double> limits;
};

/// The law with all that stands around it.
template <class Law>
srm::DriveControl<Law> drive_control(const Law& law, const Setting& s) {
  using T = typename Law::Scalar;
  srm::DriveControl<Law> control{.law = law,
                                 .outer = s.outer,
                                 .speed = {},
                                 .ramp = {},
                                 .load = s.load,
                                 .pv = {},
                                 .motion = s.motion,
                                 .tracker = {},
                                 .delay = s.delay,
                                 .comparators = s.comparators,
                                 .t_dead = T(s.t_dead),
                                 .edges = {},
                                 .u_brake_full = T(s.u_brake_full),
                                 .u_brake_none = T(s.u_brake_none),
                                 .limits = {}};
  srm::assign(control.speed, s.speed);
  srm::assign(control.ramp, s.ramp);
  srm::assign(control.tracker, s.tracker);
  srm::assign(control.pv, s.pv);
  srm::assign(control.edges, s.edges);
  srm::assign(control.limits, s.limits);
  return control;
}

/// Controller and machine as trees, built when they are asked for.
template <class Law, class M>
std::function<nb::object()> description(const srm::DriveControl<Law>& control, const M& machine,
                                        const std::shared_ptr<const void>& tables) {
  return [control, machine, tables] {
    nb::dict nodes;
    nodes["control"] = described(control);
    nodes["machine"] = described(machine);
    return nodes;
  };
}

/// Makes the controller of a law. `make.template operator()<T, N>(machine, memory)` returns the
/// law; its tables are kept in the memory.
template <class Make>
AnyController controller(const Setting& s, Make&& make) {
  return std::visit(
      [&]<template <class> class M>(const srm::Held<M<double>>& machine) {
        return with_phases(s.n_phases, [&]<int N>() -> AnyController {
          const auto closed = [&]<class T>() -> AnyController {
            srm::Tables memory;
            M<T> model;
            srm::assign(model, machine.value, memory);
            const auto control = drive_control(make.template operator()<T, N>(model, memory), s);
            return {srm::on_desk(control, memory.owner()),
                    description(control, model, memory.owner())};
          };
          return s.single ? closed.template operator()<float>()
                          : closed.template operator()<double>();
        });
      },
      s.machine);
}

void bind_called_law(nb::module_& m);
void bind_controller(nb::module_& m);
void bind_enums(nb::module_& m);
void bind_guide(nb::module_& m);
void bind_law_parts(nb::module_& m);
void bind_machine(nb::module_& m);
void bind_plant(nb::module_& m);
void bind_simulation(nb::module_& m);
void bind_step_time(nb::module_& m);

// One file a law: all of them in one took 1.6 GB to compile.
void bind_angles(nb::module_& m);
void bind_deadbeat(nb::module_& m);
void bind_ditc(nb::module_& m);
void bind_edge_mpc(nb::module_& m);
void bind_finite_set_mpc(nb::module_& m);
void bind_learning_deadbeat(nb::module_& m);
void bind_learning_edge_mpc(nb::module_& m);
void bind_paper_mpc(nb::module_& m);
void bind_pwm_current(nb::module_& m);
void bind_torque_sharing(nb::module_& m);

}  // namespace bound
