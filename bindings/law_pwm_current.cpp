#include "bind_law.hpp"
#include "srm/control/law/pwm_current.hpp"

namespace bound {

void bind_pwm_current(nb::module_& m) {
  bind_law<srm::PwmCurrent>(
      m, "pwm_current",
      "Current held by a PI controller of this bandwidth [rad/s] between turn-on and turn-off.");
}

}  // namespace bound
