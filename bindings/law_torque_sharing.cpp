#include "bind_law.hpp"
#include "srm/control/law/torque_sharing.hpp"

namespace bound {

void bind_torque_sharing(nb::module_& m) {
  bind_law<srm::TorqueSharing>(
      m, "torque_sharing",
      "Shared torque as current references, for the instant t_ahead [s] after the sample.");
}

}  // namespace bound
