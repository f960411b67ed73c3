// An angle sensor whose zero is off: the control sees every angle shifted, and its position
// compare, which listens to the same sensor, switches where the shifted angle meets its edges.
#include "bindings.hpp"

namespace bound {

namespace {

AnyController with_angle_offset(AnyController controller, double offset) {
  std::visit(
      [&](auto& step) {
        step = [inner = std::move(step), offset](auto y, double reference) {
          y.theta_e = srm::wrap(y.theta_e + offset);
          auto orders = inner(y, reference);
          for (auto& command : orders.command) {
            command.theta_on = srm::wrap(command.theta_on - offset);
            command.theta_off = srm::wrap(command.theta_off - offset);
          }
          return orders;
        };
      },
      controller.step);
  return controller;
}

}  // namespace

void bind_angle_offset(nb::module_& m) {
  m.def("with_angle_offset", &with_angle_offset, nb::arg("controller"), nb::arg("offset"),
        "The controller behind an angle sensor that shows the electrical angle plus offset [rad].");
}

}  // namespace bound
