// What a source does to the dc link at an instant.
#pragma once

namespace srm {

/// Rate of the dc-link voltage, and the powers that the energy balance needs.
struct Feed {
  double du_dc;   // [V/s]
  double i;       // into the dc link [A]
  double p;       // delivered by the source [W]
  double p_loss;  // lost between the source and the dc link [W]
};

}  // namespace srm
