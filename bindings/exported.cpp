// A drive as it leaves Python: a tree of its control, its numbers by name, a blob.
#include "called_machine.hpp"
#include "simulation.hpp"
#include "srm/c_api/blob.hpp"
#include "srm/c_api/drive_unit.hpp"
#include "trees.hpp"

namespace bound {

namespace {

/// What leaves Python of a controller.
const Exported& exported(const AnyController& controller) {
  if (!controller.exported) throw std::invalid_argument("the law has no form outside Python");
  return *controller.exported;
}

/// All of a drive, in the order of a blob. Its fields are the same for any number of phases.
void show_drive(const AnyController* controller, const SimulationParts& of, srm::Archive& archive) {
  std::visit(
      [&]<class M>(const srm::Held<M>& model) {
        using Parameters = srm::c_api::LoopParameters<M, 3>;
        const Parameters loop{of.plant<M, 3>(model.value),
                              of.t_dead,
                              of.sampling,
                              of.reference,
                              of.theta_m,
                              of.resolution};
        show<Parameters>(&loop, archive);
      },
      of.machine);
  if (controller == nullptr) return;
  archive.name("control");
  exported(*controller).control(archive);
}

nb::dict numbers(const AnyController* controller, const SimulationParts& loop) {
  ByName archive;
  show_drive(controller, loop, archive);
  return archive.found;
}

/// The name of a template: `TorqueSharing` of `srm::TorqueSharing<...>`; of a law that computes
/// with pairs of phases `EdgeMpcOfPairs`.
std::string template_name(const std::string& type) {
  const std::string name = type.substr(0, type.find('<'));
  const bool pairs = type.find("WithPairs<") != std::string::npos;
  return name.substr(name.rfind(':') + 1) + (pairs ? "OfPairs" : "");
}

nb::bytes blob(const AnyController& controller, const SimulationParts& loop) {
  srm::c_api::Writer parameters;
  show_drive(&controller, loop, parameters);
  const Exported& given = *controller.exported;
  srm::c_api::Blob of;
  of.n_phases = int(controller.step.index()) + 2;
  of.law = template_name(given.law.type);
  of.machine = std::visit(
      []<class M>(const srm::Held<M>&) { return template_name(type_text<M>()); }, loop.machine);
  of.precision = given.single ? "float" : "double";
  of.around = given.around;
  const std::string bytes = srm::c_api::written(of, parameters);
  return nb::bytes(bytes.data(), bytes.size());
}

template <class T>
nb::object machine_tree(const AnyMachine& machine) {
  srm::Tables memory;
  return tree(called<T>(machine, memory));
}

nb::dict described(const AnyController& controller) {
  const Exported& given = exported(controller);
  Tree control;
  given.control(control);
  nb::dict trees;
  trees["control"] = control.made();
  trees["machine"] =
      given.single ? machine_tree<float>(given.machine) : machine_tree<double>(given.machine);
  return trees;
}

}  // namespace

void bind_exported(nb::module_& m) {
  m.def("described", &described, nb::arg("controller"),
        nb::sig("def described(controller: Controller) -> dict[str, typing.Any]"),
        "The controller, and its machine, as trees of names and numbers, for export.");
  m.def(
      "law_of",
      [](const AnyController& controller) -> std::optional<std::string> {
        if (!controller.exported) return std::nullopt;
        return template_name(controller.exported->law.type);
      },
      nb::arg("controller"), "The struct of a controller's law; None where it has no such form.");
  m.def(
      "numbers", &numbers, nb::arg("controller").none(), nb::arg("loop"),
      nb::sig("def numbers(controller: Controller | None, loop: SimulationParts) -> "
              "dict[str, float | list[float] | tuple[float, ...]]"),
      "Every number of a drive by its name in the C interface: arrays as lists, tables as tuples. "
      "Without a controller those of the plant.");
  m.def("blob", &blob, nb::arg("controller"), nb::arg("loop"),
        "The parameters of a drive as bytes, for the C interface.");
}

}  // namespace bound
