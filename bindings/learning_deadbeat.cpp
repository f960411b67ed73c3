#include "bind_learning.hpp"
#include "srm/control/law/deadbeat.hpp"

namespace bound {

void bind_learning_deadbeat(nb::module_& m) {
  bind_learning<srm::Deadbeat>(m, "learning_deadbeat");
}

}  // namespace bound
