#include "bind_law.hpp"
#include "srm/control/law/ditc.hpp"

namespace bound {

void bind_ditc(nb::module_& m) {
  bind_law<srm::Ditc>(m, "ditc",
                      "Direct instantaneous torque control: the torque error picks the legs.");
}

}  // namespace bound
