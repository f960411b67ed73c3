#include "bind_pairs.hpp"
#include "srm/control/laws.hpp"

namespace bound {

template <>
void bind_built_in<srm::laws::FiniteSetMpc>(nb::module_& m) {
  bind_law<srm::laws::FiniteSetMpc>(
      m, "finite_set_mpc",
      "Finite-control-set predictive torque control. guide: flux linkage [Wb]; w_psi: weight of "
      "the distance to it [N^2 m^2/Wb^2], feedback: 1 where feedback holds the mean, else 0 [1], "
      "each at each of its speeds.");
  bind_coupled<srm::laws::FiniteSetMpc>(m, "coupled_finite_set_mpc");
}

}  // namespace bound
