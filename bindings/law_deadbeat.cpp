#include "bind_learning.hpp"
#include "bind_pairs.hpp"
#include "srm/control/laws.hpp"

namespace bound {

template <>
void bind_built_in<srm::laws::Deadbeat>(nb::module_& m) {
  bind_law<srm::laws::Deadbeat>(
      m, "deadbeat", "The duty cycle that brings each phase to its shared torque in one sample.");
  bind_learning<srm::laws::Deadbeat>(m, "learning_deadbeat");
  bind_coupled<srm::laws::Deadbeat>(m, "coupled_deadbeat");
}

}  // namespace bound
