// A supervised drive on the desk: a law with its frame, the protection and the states around them.
#include "bind_struct.hpp"
#include "controllers.hpp"
#include "srm/sim/columns.hpp"

namespace bound {

namespace {

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
  m.def("supervised", &supervised<Forms::usual>, nb::arg("law"), nb::arg("frame"), nb::kw_only(),
        nb::arg("machine"), nb::arg("protection"), nb::arg("sequence"), nb::arg("supervision"),
        nb::arg("coupling") = nb::none(), nb::arg("diagnosis") = nb::none(),
        nb::arg("flux_angle") = nb::none(),
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
