#include "bind_law.hpp"
#include "srm/control/laws.hpp"

namespace bound {

template <>
void bind_built_in<srm::laws::PwmCurrent>(nb::module_& m) {
  bind_law<srm::laws::PwmCurrent>(
      m, "pwm_current",
      "Current held by a PI controller of this bandwidth [rad/s] between turn-on and turn-off.");
}

}  // namespace bound
