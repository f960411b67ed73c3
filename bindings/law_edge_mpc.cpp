#include "bind_law.hpp"
#include "srm/control/law/edge_mpc.hpp"

namespace bound {

void bind_edge_mpc(nb::module_& m) {
  bind_law<srm::EdgeMpc>(
      m, "edge_mpc",
      "Predictive torque control with switching instants as variables. guide: flux linkage [Wb]; "
      "psi_slack: most that a phase may leave it, conducts: part of the period in which it has "
      "current, each at each of its speeds [Wb, 1].");
}

}  // namespace bound
