#include "bind_learning.hpp"
#include "srm/control/law/edge_mpc.hpp"

namespace bound {

void bind_learning_edge_mpc(nb::module_& m) { bind_learning<srm::EdgeMpc>(m, "learning_edge_mpc"); }

}  // namespace bound
