// Python view of what several control laws are made of.
#include "law_parts.hpp"

#include <nanobind/stl/array.h>

#include "srm/control/angles.hpp"
#include "srm/control/modulator.hpp"

namespace bound {

void bind_law_parts(nb::module_& m) {
  using Conduction = srm::Conduction<double>;
  using MeanTorque = srm::MeanTorque<double>;
  using Sharing = srm::Sharing<double>;
  nb::enum_<srm::Leg>(m, "Leg")
      .value("demagnetize", srm::Leg::demagnetize)
      .value("freewheel", srm::Leg::freewheel)
      .value("magnetize", srm::Leg::magnetize);
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
  nb::class_<Conduction>(m, "Conduction", "Turn-on and turn-off angle, electrical.")
      .def(
          "__init__",
          [](Conduction* self, double theta_on, double theta_off, double omega_start) {
            new (self) Conduction{theta_on, theta_off, omega_start};
          },
          nb::kw_only(), nb::arg("theta_on"), nb::arg("theta_off"), nb::arg("omega_start"));
  nb::class_<MeanTorque>(m, "MeanTorque", "Current reference over the torque reference.")
      .def(
          "__init__",
          [](MeanTorque* self, double tau_max, const decltype(MeanTorque::i_ref)& i_ref) {
            new (self) MeanTorque{tau_max, i_ref};
          },
          nb::kw_only(), nb::arg("tau_max"), nb::arg("i_ref"),
          "i_ref: 17 currents [A] for the torques 0..tau_max [N m].")
      .def_static("constant", &srm::constant_current<double>, nb::arg("i_ref"),
                  "The same current [A] for every torque.");
  nb::class_<Sharing>(m, "Sharing", "Torque sharing function.")
      .def(
          "__init__",
          [](Sharing* self, srm::Shape shape, double theta_on, double theta_ov,
             const decltype(Sharing::table)& table) {
            new (self) Sharing{shape, theta_on, theta_ov, table};
          },
          nb::kw_only(), nb::arg("shape"), nb::arg("theta_on"), nb::arg("theta_ov"),
          nb::arg("table") = decltype(Sharing::table){},
          "Turn-on and overlap angle, electrical [rad]; with Shape.table the rise at 33 equally "
          "spaced angles of the overlap.")
      .def(
          "is_feasible",
          [](const Sharing& self, int n_phases) {
            return with_phases(n_phases, [&]<int N>() { return self.is_feasible<N>(); });
          },
          nb::arg("n_phases"), "True if every phase with a share can give torque.")
      .def(
          "share",
          [](const Sharing& self, int n_phases, double theta_e) {
            return with_phases(n_phases,
                               [&]<int N>() { return self.share<N>(srm::wrap(theta_e)); });
          },
          nb::arg("n_phases"), nb::arg("theta_e"), "Share of the phase at theta_e [1].");
}

}  // namespace bound
