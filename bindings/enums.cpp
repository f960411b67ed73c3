// The named choices of the core.
#include "bindings.hpp"
#include "srm/control/frame/frame.hpp"
#include "srm/control/law/angles.hpp"
#include "srm/control/part/modulator.hpp"
#include "srm/control/part/sharing.hpp"

namespace bound {

void bind_enums(nb::module_& m) {
  nb::enum_<srm::Leg>(m, "Leg")
      .value("demagnetize", srm::Leg::demagnetize)
      .value("freewheel", srm::Leg::freewheel)
      .value("magnetize", srm::Leg::magnetize);
  nb::enum_<srm::Gate>(m, "Gate")
      .value("off", srm::Gate::off)
      .value("timer", srm::Gate::timer)
      .value("comparator", srm::Gate::comparator)
      .value("window", srm::Gate::window);
  nb::enum_<srm::AngleWatch>(m, "AngleWatch")
      .value("compare", srm::AngleWatch::compare)
      .value("sampled", srm::AngleWatch::sampled);
  nb::enum_<srm::Carriers>(m, "Carriers")
      .value("in_phase", srm::Carriers::in_phase)
      .value("interleaved", srm::Carriers::interleaved);
  nb::enum_<srm::Shape>(m, "Shape")
      .value("linear", srm::Shape::linear)
      .value("cubic", srm::Shape::cubic)
      .value("sinusoidal", srm::Shape::sinusoidal)
      .value("exponential", srm::Shape::exponential)
      .value("table", srm::Shape::table);
  nb::enum_<srm::Outer>(m, "Outer")
      .value("torque", srm::Outer::torque)
      .value("speed", srm::Outer::speed)
      .value("none", srm::Outer::none)
      .value("pv", srm::Outer::pv);
  nb::enum_<srm::Motion>(m, "Motion")
      .value("measured", srm::Motion::measured)
      .value("tracked", srm::Motion::tracked);
  nb::enum_<srm::LoadTorque>(m, "LoadTorque")
      .value("integral", srm::LoadTorque::integral)
      .value("observer", srm::LoadTorque::observer);
  nb::enum_<srm::Actuator>(m, "Actuator")
      .value("torque", srm::Actuator::torque)
      .value("speed", srm::Actuator::speed);
  nb::enum_<srm::ArrayCurrent>(m, "ArrayCurrent")
      .value("sensor", srm::ArrayCurrent::sensor)
      .value("legs", srm::ArrayCurrent::legs);
  nb::enum_<srm::Tracking>(m, "Tracking")
      .value("constant", srm::Tracking::constant)
      .value("perturb_observe", srm::Tracking::perturb_observe)
      .value("incremental_conductance", srm::Tracking::incremental_conductance);
  nb::enum_<srm::Comparators>(m, "Comparators")
      .value("analog", srm::Comparators::analog)
      .value("sampled", srm::Comparators::sampled)
      .value("two_level", srm::Comparators::two_level);
}

}  // namespace bound
