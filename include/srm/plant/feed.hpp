// What a source does to the dc link at an instant.
#pragma once

#include "srm/plant/moving.hpp"

namespace srm {

/// Rate of the dc-link voltage, and the powers that the energy balance needs.
struct Feed {
  Moving du_dc;   // [V/s]
  Moving i;       // into the dc link [A]
  Moving i_cap;   // into its capacitor; of a link that holds its voltage, less its mean [A]
  Moving p;       // delivered by the source [W]
  Moving p_loss;  // lost between the source and the dc link [W]
};

}  // namespace srm
