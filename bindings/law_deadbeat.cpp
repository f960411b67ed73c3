#include "bind_law.hpp"
#include "srm/control/law/deadbeat.hpp"

namespace bound {

void bind_deadbeat(nb::module_& m) {
  bind_law<srm::Deadbeat>(
      m, "deadbeat", "The duty cycle that brings each phase to its shared torque in one sample.");
}

}  // namespace bound
