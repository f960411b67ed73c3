// A supervised drive on the desk: a law with its frame, the protection and the states around them.
#include "bind_struct.hpp"
#include "describe_control.hpp"
#include "describe_plant.hpp"
#include "srm/sim/columns.hpp"
#include "srm/sim/supervision.hpp"

namespace bound {

namespace {

using Events = std::shared_ptr<std::vector<srm::Event>>;

template <class Drive>
AnyController sampled(const Drive& drive, const srm::Supervision& plan,
                      const std::shared_ptr<const void>& memory) {
  const Events events = std::make_shared<std::vector<srm::Event>>();
  AnyController made{srm::Controller<Drive::N>(
      [drive, plan, memory, events, x = srm::SupervisedState<Drive>{}](
          const srm::Measurement<double, Drive::N>& y, double reference) mutable {
        srm::Orders<Drive::N> orders = srm::step_supervised(drive, plan, x, y, reference);
        const auto& law = x.drive.control.law;
        orders.tau_ref = x.outputs.gate_enable ? double(law.frame.tau_ref) : 0.0;
        srm::assign(orders.learned, law.law.learned);
        srm::note(*events, drive, x, plan.T_s);
        return orders;
      })};
  made.events = [events] { return *events; };
  return made;
}

AnyController supervised(const AnyLaw& law, const srm::Frame<double>& frame,
                         const AnyMachine& machine, const srm::Protection<double>& protection,
                         const srm::Sequence<double>& sequence, const srm::Supervision& plan) {
  const auto around = [&]<class T, int N>(const srm::CalledLaw<T, N>& called) -> AnyController {
    if (plan.phase < 0 || plan.phase >= N) throw std::invalid_argument("phase of the trouble");
    const auto guarded = [&]<template <class> class M>(const srm::Held<M<double>>& model) {
      using Control = srm::DriveControl<srm::CalledLaw<T, N>>;
      srm::Tables memory;
      srm::Supervised<srm::Guarded<M<T>, Control>> drive{};
      srm::assign(drive.control.machine, model.value, memory);
      srm::assign(drive.control.protection, protection);
      srm::assign(drive.control.control.frame, frame);
      drive.control.control.law = called;
      srm::assign(drive.sequence, sequence);
      AnyController made = sampled(drive, plan, memory.owner());
      if (law.describe != nullptr) {
        made.description = [law, drive, plan, owner = memory.owner()] {
          nb::dict tree = described_controller(law, drive.control.control.frame);
          tree["known"] = described(drive.control.machine);
          tree["protection"] = described(drive.control.protection);
          tree["sequence"] = described(drive.sequence);
          tree["supervision"] = described_part(plan);
          return tree;
        };
      }
      return made;
    };
    return std::visit(guarded, machine);
  };
  return std::visit([&](const auto& any) { return std::visit(around, any); }, law.called);
}

/// Rows of srm::Event; None where the controller is not supervised.
nb::object events_of(const AnyController& controller) {
  if (!controller.events) return nb::none();
  const std::vector<srm::Event> events = controller.events();
  const std::size_t columns = std::size_t(srm::columns_of(srm::Event{}));
  std::vector<double> values(events.size() * columns);
  for (std::size_t n = 0; n < events.size(); ++n) {
    srm::write_columns(events[n], &values[n * columns]);
  }
  return nb::cast(numpy(std::move(values), {events.size(), columns}));
}

}  // namespace

void bind_supervised(nb::module_& m) {
  nb::enum_<srm::Trouble>(m, "Trouble", "What goes wrong with a supervised drive.")
      .value("none", srm::Trouble::none)
      .value("over_current", srm::Trouble::over_current)
      .value("over_voltage", srm::Trouble::over_voltage)
      .value("under_voltage", srm::Trouble::under_voltage)
      .value("dead_current_sensor", srm::Trouble::dead_current_sensor)
      .value("frozen_current_sensor", srm::Trouble::frozen_current_sensor)
      .value("lost_encoder", srm::Trouble::lost_encoder)
      .value("no_command", srm::Trouble::no_command)
      .value("hardware_trip", srm::Trouble::hardware_trip);
  bind_struct<srm::Supervision>(m, "Supervision",
                                "When a supervised drive is enabled and cleared, and its trouble; "
                                "courses of 0 and 1. SI units.");
  m.def("supervised", &supervised, nb::arg("law"), nb::arg("frame"), nb::kw_only(),
        nb::arg("machine"), nb::arg("protection"), nb::arg("sequence"), nb::arg("supervision"),
        "A law with its frame, protection and states, and their state: the step of a target, on "
        "the desk. machine: as the protection knows it.");
  m.def("events", &events_of, nb::arg("controller"),
        nb::sig("def events(controller: Controller) -> "
                "typing.Annotated[numpy.typing.NDArray[numpy.float64], dict(shape=(None, 6))] | "
                "None"),
        "The states that a supervised drive has entered: time [s], state, status, phase, value and "
        "limit of a fault. None where the controller is not supervised.");
  m.def(
      "describe_status", [](int status) { return srm::describe(static_cast<srm::Status>(status)); },
      nb::arg("status"), "A status of the protection in words.");
}

}  // namespace bound
