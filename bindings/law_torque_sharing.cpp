#include "bind_pairs.hpp"
#include "srm/control/laws.hpp"

namespace bound {

template <>
void bind_built_in<srm::laws::TorqueSharing>(nb::module_& m) {
  bind_law<srm::laws::TorqueSharing>(
      m, "torque_sharing", "Shared torque as current references. guide: phase current [A].");
  bind_coupled<srm::laws::TorqueSharing>(m, "coupled_torque_sharing");
}

}  // namespace bound
