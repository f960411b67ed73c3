#include "bind_pairs.hpp"
#include "srm/control/laws.hpp"

namespace bound {

template <>
void bind_built_in<srm::laws::Ditc>(nb::module_& m) {
  bind_law<srm::laws::Ditc>(
      m, "ditc", "Direct instantaneous torque control: the torque error picks the legs.");
  bind_coupled<srm::laws::Ditc>(m, "coupled_ditc");
}

}  // namespace bound
