#include "bind_law.hpp"
#include "srm/control/law/angles.hpp"

namespace bound {

/// The law does without a machine.
template <class M, int N>
using Angles = srm::Angles<typename M::Scalar, N>;

void bind_angles(nb::module_& m) {
  bind_law<Angles>(m, "angles",
                   "Current held in a band of half width i_band [A] between turn-on and turn-off.");
}

}  // namespace bound
