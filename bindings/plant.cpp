// The exchangeable parts of the plant, and what the loop is told of sensors and resolution.
#include "bind_struct.hpp"
#include "srm/sim/simulation.hpp"

namespace bound {

void bind_plant(nb::module_& m) {
  nb::enum_<srm::Rotation>(m, "Rotation")
      .value("locked", srm::Rotation::locked)
      .value("turning", srm::Rotation::turning);
  bind_struct<srm::Course>(m, "Course",
                           "A quantity over time: linear between points, two points at "
                           "the same time make a step. Times in s.");
  bind_struct<srm::StiffSource>(m, "StiffSource", "A dc link that holds its voltage [V].");
  bind_struct<srm::Battery>(m, "Battery",
                            "Open-circuit voltage [V] behind R [ohm], dc-link capacitor C [F].");
  bind_struct<srm::Devices>(m, "Devices",
                            "On-state voltages of switches and diodes: thresholds [V], slopes "
                            "[ohm].");
  bind_struct<srm::AsymmetricBridge>(m, "AsymmetricBridge", "Two switches and two diodes a phase.");
  bind_struct<srm::SharedSwitchBridge>(m, "SharedSwitchBridge",
                                       "All phases share one upper switch (Miller converter).");
  bind_struct<srm::Shaft>(m, "Shaft",
                          "Inertia J [kg m^2], friction B [N m s], k of a fan or pump [N m s^2], "
                          "torque tau_0 [N m] and held speed omega [rad/s] over time, and a "
                          "function of speed [rad/s] that gives more load torque [N m].");
  bind_struct<srm::Sampling>(m, "Sampling", "Sensors and timing of the controller.");
  bind_struct<srm::Scale>(m, "Scale", "Currents [A] and voltages [V] that matter.");
  bind_struct<srm::Resolution>(m, "Resolution", "How finely a run is computed and kept.");
  m.def(
      "n_switches",
      [](const srm::Bridge& bridge, int n_phases) {
        return std::visit([&](const auto& b) { return b.n_switches(n_phases); }, bridge);
      },
      nb::arg("bridge"), nb::arg("n_phases"), "Switches of a bridge.");
}

}  // namespace bound
