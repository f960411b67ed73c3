// The frame around a law: its parameters.
#include "bind_struct.hpp"
#include "controllers.hpp"

namespace bound {

void bind_frame(nb::module_& m) {
  bind_struct<srm::LimitedPi<double>>(m, "LimitedPi",
                                      "Output per error, and per error and control period.");
  bind_struct<srm::PowerTracker<double>>(
      m, "PowerTracker", "Maximum power point tracking on a voltage reference [V].");
  bind_struct<srm::WholePeriods<double>>(m, "WholePeriods",
                                         "Means over whole electrical periods [s].");
  bind_struct<srm::StrokeRipple<double>>(m, "StrokeRipple",
                                         "Adaptive notch filter at the stroke frequency [s].");
  bind_struct<srm::PvControl<double>>(m, "PvControl",
                                      "Voltage control and tracking of a drive on a photovoltaic "
                                      "array. SI units.");
  bind_struct<srm::SpeedPi<double>>(m, "SpeedPi", "PI speed controller. SI units.");
  bind_struct<srm::SpeedRamp<double>>(m, "SpeedRamp",
                                      "The speed reference that the torque can follow. SI units.");
  bind_struct<srm::TrackerGains<double>>(m, "TrackerGains",
                                         "Of angle [1], speed [1/s] and load torque [N m/rad].");
  bind_struct<srm::AngleTracker<double>>(
      m, "AngleTracker", "Observer of angle, speed and load torque on the angle. SI units.");
  bind_struct<srm::EdgeLimits<double>>(m, "EdgeLimits",
                                       "Shortest leg state, time without edges before a sample, "
                                       "control period [s].");
  bind_struct<srm::UserLimits<double>>(m, "UserLimits",
                                       "Of torque [N m] and phase current [A], below what the law "
                                       "is built for.");
  bind_struct<srm::Frame<double>, true>(
      m, "Frame",
      "What stands around a control law: angle tracker, speed or voltage loop, limits, sampled "
      "comparators, dead-time compensation. By default none of them. SI units.");
  nb::class_<AnyLaw>(m, "Law", "A control law of the core, or a function that stands for one.");
  nb::class_<AnyController>(m, "Controller", "A complete controller, ready to be sampled.")
      .def(nb::new_(&controlled<Forms::usual>), nb::arg("law"), nb::arg("frame"),
           nb::arg("coupling") = nb::none(),
           "A law with its frame and the pairs of phases that it knows, and their state.");
}

}  // namespace bound
