// The exchangeable parts of the plant, and what the loop is told of sensors and resolution.
#include "bind_struct.hpp"
#include "srm/sim/simulation.hpp"

namespace bound {

/// The alternatives of a part, each under its own name.
template <class... B>
void bind_each(nb::module_& m, const std::variant<B...>&) {
  (bind_struct<B>(m, type_text<B>().substr(sizeof "srm::" - 1).c_str(), B::about), ...);
}

void bind_plant(nb::module_& m) {
  nb::enum_<srm::Rotation>(m, "Rotation")
      .value("locked", srm::Rotation::locked)
      .value("turning", srm::Rotation::turning);
  bind_struct<srm::Course>(m, "Course",
                           "A quantity over time: linear between points, two points at "
                           "the same time make a step. Times in s.");
  bind_each(m, srm::Source());
  nb::borrow<nb::class_<srm::PvArray>>(m.attr("PvArray"))
      .def("current", &srm::PvArray::current, nb::arg("u"), nb::arg("G"), nb::arg("T_degC"),
           "Current of the array at a voltage [V], irradiance [W/m^2] and cell temperature "
           "[degC]; negative above its open-circuit voltage [A].");
  bind_struct<srm::Devices>(m, "Devices",
                            "On-state voltages of switches and diodes: thresholds [V], slopes "
                            "[ohm].");
  bind_each(m, srm::Bridge());
  bind_struct<srm::Pump, true>(
      m, "Pump",
      "A pump that lifts water: torque (rows of static heads, columns of "
      "sqrt(omega^2 - omega_0^2)) [N m], static head over time [m]. By default none.")
      .def(
          "torque",
          [](const srm::Pump& pump, double omega_m, double t) {
            return pump.torque(omega_m, {t, t});
          },
          nb::arg("omega_m"), nb::arg("t"), "Torque at a speed [rad/s] and time [s]; [N m].");
  bind_struct<srm::Shaft, true>(
      m, "Shaft",
      "Inertia J [kg m^2], friction B [N m s], k of a fan or pump [N m s^2], "
      "torque tau_0 [N m] and held speed omega [rad/s] over time, and a "
      "function of speed [rad/s] that gives more load torque [N m]; a pump.");
  bind_struct<srm::RotorSensor>(m, "RotorSensor",
                                "Encoder counts per revolution, whether it has an index and Hall "
                                "sensors, error of their edges [rad].");
  nb::enum_<srm::Broken>(m, "Broken", "The list of faults.")
#define SRM_ONE(name, about) .value(#name, srm::Broken::name, about)
      SRM_BROKEN(SRM_ONE)
#undef SRM_ONE
          ;
  m.attr("most_faults") = srm::most_faults;
  m.attr("never_ends") = srm::never_ends;
  bind_struct<srm::BrokenPart>(m, "BrokenPart", "One fault, and when it is present. SI units.");
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
