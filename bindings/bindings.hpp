// Shared by the binding files: what Python holds of the core, and the way from run-time choices
// (machine model, phase count, precision) to the templates.
//
// What is a template: scalar, phase count, machine model. What is decided at run time: everything
// else. A control law is reached through one std::function per sample, and so is the controller. So
// the loop is compiled per machine and phase count, the frame per precision and phase count, and a
// new law adds its own file here (docs/adr/0005, 0018).
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
#include "forms.hpp"
#include "shower.hpp"
#include "srm/machine/coupling.hpp"
#include "srm/machine/machines.hpp"
#include "srm/sim/called_law.hpp"
#include "srm/sim/controller.hpp"
#include "srm/sim/event.hpp"
#include "srm/sim/tables.hpp"

namespace srm {

template <template <class> class... M>
using OneOf = std::variant<Held<M<double>>...>;

/// A machine model of this library, in the precision of the plant.
using AnyMachine = OneOf<SRM_BUILT_IN_MACHINES>;

}  // namespace srm

namespace bound {

using srm::AnyMachine;

/// The pairs of a machine, where there are any.
using AnyCoupling = std::optional<srm::Held<srm::Coupling<double>>>;

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

/// A law of any precision and number of phases, behind one call. Its frame is compiled in
/// frame.cpp.
struct AnyLaw {
  template <srm::Real T>
  using Any = std::variant<srm::CalledLaw<T, 2>, srm::CalledLaw<T, 3>, srm::CalledLaw<T, 4>,
                           srm::CalledLaw<T, 5>, srm::CalledLaw<T, 6>>;

  std::variant<Any<float>, Any<double>> called;
  ShownLaw itself{};
  AnyMachine machine{};  // as the law believes it
};

/// A controller as it leaves Python.
struct Exported {
  ShownLaw law;
  AnyMachine machine;  // as the law believes it
  bool single;
  std::string_view around;                     // the law, see c_api/blob.hpp
  std::function<void(srm::Archive&)> control;  // shows it
};

/// A controller for 2 to 6 phases.
struct AnyController {
  std::variant<srm::Controller<2>, srm::Controller<3>, srm::Controller<4>, srm::Controller<5>,
               srm::Controller<6>>
      step;
  std::function<std::vector<srm::Event>()> events{};  // of a supervised drive; else empty
  std::shared_ptr<const Exported> exported{};         // null: it has no such form
  bool follows = false;                               // the rotor, by the flux linkages
};

void bind_called_law(nb::module_& m);
void bind_controller(nb::module_& m);
void bind_coupling(nb::module_& m);
void bind_enums(nb::module_& m);
void bind_exported(nb::module_& m);
void bind_frame(nb::module_& m);
void bind_guard(nb::module_& m);
void bind_reference_profile(nb::module_& m);
void bind_law_parts(nb::module_& m);
void bind_machine(nb::module_& m);
void bind_plant(nb::module_& m);
void bind_simulation(nb::module_& m);
void bind_step_time(nb::module_& m);
void bind_supervised(nb::module_& m);

/// Python's function of a built-in law (control/laws.hpp). Each has a file: all of them in one took
/// 1.6 GB to compile. `Forms::other` adds the other forms to those of other_forms.hpp.
template <template <class, int> class Law, Forms here = forms_here>
void bind_built_in(nb::module_& m);

/// Likewise controllers, and loops of runs and environments (other_loops.cpp).
template <Forms here = forms_here>
void bind_controllers(nb::module_& m);
void bind_other_loops(nb::module_& m);

}  // namespace bound
