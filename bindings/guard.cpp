// The protection and the states of a drive, from Python.
#include "bind_struct.hpp"
#include "srm/control/guard/diagnosis.hpp"
#include "srm/control/guard/sequence.hpp"
#include "trees.hpp"

namespace bound {

namespace {

/// A struct of parameters whose fields Python can read.
template <class S>
nb::class_<S> bind_readable(nb::module_& m, const char* name, const char* doc) {
  nb::class_<S> bound = bind_struct<S>(m, name, doc);
  S sample{};
  const auto* base = reinterpret_cast<const char*>(&sample);
  srm::fields_of(sample, [&]<class... V>(srm::Field<V>... field) {
    (bound.def_prop_ro(field.name,
                       [at = reinterpret_cast<const char*>(&field.value) - base](const S& self) {
                         return *reinterpret_cast<const V*>(reinterpret_cast<const char*>(&self) +
                                                            at);
                       }),
     ...);
  });
  return bound;
}

/// In single precision, as on the target.
nb::dict described_guard(const srm::Protection<double>& protection,
                         const srm::Sequence<double>& sequence,
                         const std::optional<srm::Diagnosis<double>>& diagnosis,
                         const std::optional<srm::FluxAngle<double>>& flux_angle) {
  srm::Protection<float> protects;
  srm::Sequence<float> leads;
  srm::assign(protects, protection);
  srm::assign(leads, sequence);
  nb::dict nodes;
  nodes["protection"] = tree(protects);
  nodes["sequence"] = tree(leads);
  if (diagnosis) {
    srm::Diagnosis<float> names;
    srm::assign(names, *diagnosis);
    nodes["diagnosis"] = tree(names);
  }
  if (flux_angle) {
    srm::FluxAngle<float> follows;
    srm::assign(follows, *flux_angle);
    nodes["flux_angle"] = tree(follows);
  }
  return nodes;
}

}  // namespace

void bind_guard(nb::module_& m) {
  bind_struct<srm::Drops<double>>(m, "Drops",
                                  "Dead time [s] and threshold voltages [V] of the converter.");
  bind_readable<srm::FluxBounds<double>>(
      m, "FluxBounds", "What a current reading may be wrong by, and the voltage. SI units.");
  bind_readable<srm::TripLevels<double>>(m, "TripLevels", "Levels of the readings. SI units.");
  bind_readable<srm::Advance<double>>(m, "Advance",
                                      "How the angle of a rotor can advance. SI units.")
      .def_ro_static("parts", &srm::Advance<double>::parts);
  bind_readable<srm::Protection<double>>(
      m, "Protection", "The checks of every sample before the control law sees it. SI units.");
  bind_readable<srm::WindingFlux<double>>(
      m, "WindingFlux",
      "What the flux linkage of a phase may be wrong by in a sound drive. SI units.");
  bind_readable<srm::PhaseTrial<double>>(
      m, "PhaseTrial",
      "How far each phase is magnetized alone while the law does not run. SI units.");
  bind_readable<srm::Likeness<double>>(
      m, "Likeness", "By what a phase may differ from the others in a sound drive. SI units.");
  bind_readable<srm::Diagnosis<double>>(m, "Diagnosis",
                                        "What tells the faults of a drive apart. SI units.");
  bind_readable<srm::FluxAngle<double>>(
      m, "FluxAngle", "What the angle by the flux linkages may be wrong by. SI units.");
  bind_readable<srm::Sequence<double>>(
      m, "Sequence", "The states of a drive, from precharge to a fault and back. SI units.");
  m.def("described_guard", &described_guard, nb::arg("protection"), nb::arg("sequence"),
        nb::arg("diagnosis") = nb::none(), nb::arg("flux_angle") = nb::none(),
        "All in single precision as trees of names and numbers, for export.");
}

}  // namespace bound
