#include "bind_law.hpp"
#include "srm/control/laws.hpp"

namespace bound {

template <>
void bind_built_in<srm::laws::TorqueSharing>(nb::module_& m) {
  bind_law<srm::laws::TorqueSharing>(
      m, "torque_sharing", "Shared torque as current references. guide: phase current [A].");
}

}  // namespace bound
