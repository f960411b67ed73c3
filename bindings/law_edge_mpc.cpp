#include "bind_learning.hpp"
#include "bind_pairs.hpp"
#include "srm/control/laws.hpp"

namespace bound {

template <>
void bind_built_in<srm::laws::EdgeMpc>(nb::module_& m) {
  bind_law<srm::laws::EdgeMpc>(
      m, "edge_mpc",
      "Predictive torque control with switching instants as variables. guide: flux linkage [Wb]; "
      "psi_slack: most that a phase may leave it, at each of its speeds [Wb].");
  bind_learning<srm::laws::EdgeMpc>(m, "learning_edge_mpc");
  bind_coupled<srm::laws::EdgeMpc>(m, "coupled_edge_mpc");
}

}  // namespace bound
