// Predictive torque control with switching instants inside the sample.
#include "srm/control/edge_mpc.hpp"

#include "guide.hpp"

namespace bound {

namespace {

AnyController edge_mpc(const Setting& setting, const Guide& guide, double w_sw,
                       const std::vector<double>& psi_slack, double R, double i_max, double T_s,
                       int delay) {
  return controller(setting, [&]<class T, int N>(const auto& model) {
    using M = std::decay_t<decltype(model)>;
    GuideTables<T> tables(guide);
    const srm::EdgeMpc<M, N> law{.machine = model,
                                 .guide = tables.view(),
                                 .w_sw = T(w_sw),
                                 .psi_slack = tables.per_speed(psi_slack),
                                 .R = T(R),
                                 .i_max = T(i_max),
                                 .T_s = T(T_s),
                                 .delay = delay};
    return std::pair(law, tables.memory());
  });
}

double switching_weight(const AnyMachine& machine, const Guide& guide, double R, double tau_ref,
                        double omega_m, double u_dc, double i_max, double f_switch) {
  const GuideTables<double> tables(guide);
  const srm::Profile<double> profile = tables.view().at(tau_ref, omega_m, u_dc);
  return std::visit(
      [&](const auto& m) {
        return srm::switching_weight(m, profile, R, omega_m, u_dc, i_max, f_switch);
      },
      machine);
}

}  // namespace

void bind_edge_mpc(nb::module_& m) {
  m.def("edge_mpc", &edge_mpc, nb::arg("setting"), nb::kw_only(), nb::arg("guide"), nb::arg("w_sw"),
        nb::arg("psi_slack"), nb::arg("R"), nb::arg("i_max"), nb::arg("T_s"), nb::arg("delay"),
        "Predictive torque control with switching instants as variables. guide: flux "
        "linkage [Wb]. psi_slack: most that a phase may leave it, at each of its speeds [Wb].");
  m.def("switching_weight", &switching_weight, nb::arg("machine"), nb::kw_only(), nb::arg("guide"),
        nb::arg("R"), nb::arg("tau_ref"), nb::arg("omega_m"), nb::arg("u_dc"), nb::arg("i_max"),
        nb::arg("f_switch"),
        "Cost of a turn-on [N^2 m^2 s] that makes about f_switch [Hz] per switch.");
}

}  // namespace bound
