// Python view of what several control laws are made of.
#include "bind_struct.hpp"
#include "srm/control/frame/stroke_fit.hpp"
#include "srm/control/law/ditc.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/feasible.hpp"
#include "srm/control/part/mean_torque.hpp"
#include "srm/control/part/sharing.hpp"

namespace bound {

void bind_law_parts(nb::module_& m) {
  using MeanTorque = srm::MeanTorque<double>;
  using Sharing = srm::Sharing<double>;
  bind_struct<srm::Conduction<double>>(m, "Conduction",
                                       "Turn-on and turn-off angle, electrical [rad]; the speed "
                                       "below which a window for starting replaces them [rad/s].");
  bind_struct<srm::TorqueBands<double>>(m, "TorqueBands", "Half widths of two torque bands [N m].");
  bind_struct<MeanTorque>(m, "MeanTorque",
                          "Current reference over the torque reference: 17 currents [A] for the "
                          "torques 0..tau_max [N m].")
      .def_static("constant", &srm::constant_current<double>, nb::arg("i_ref"),
                  "The same current [A] for every torque.");
  bind_struct<srm::TurnOn<double>>(m, "TurnOn",
                                   "Flux [Wb] that a phase is turned on ahead for: 9 values for "
                                   "the torques 0..tau_max, motoring and braking.");
  bind_struct<srm::Feasible<double>>(m, "Feasible",
                                     "Greatest omega_e/u_dc [rad/Wb] at which the voltage "
                                     "suffices for a law's own references: 9 values for the "
                                     "torques 0..tau_max, motoring and braking.");
  bind_struct<srm::StrokeFit<double>>(m, "StrokeFit",
                                      "Resistance and flux map from the strokes of the phases: "
                                      "unaligned inductance [H], currents [A], period [s].");
  bind_struct<Sharing>(m, "Sharing",
                       "Torque sharing function. Turn-on and overlap angle, electrical [rad]; with "
                       "Shape.table the rise at 33 equally spaced angles of the overlap.")
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
