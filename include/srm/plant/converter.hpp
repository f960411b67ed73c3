// The asymmetric half bridge: what a winding sees, with the drops of switches and diodes.
#pragma once

#include "srm/base/leg.hpp"

namespace srm {

struct Converter {
  double u_dc;      // dc-link voltage [V]
  double v_switch;  // on-state voltage of a switch: threshold [V] ...
  double R_switch;  // ... and slope [ohm]
  double v_diode;   // forward voltage of a diode: threshold [V] ...
  double R_diode;   // ... and slope [ohm]
  double t_dead;    // a switch turns on this much later than ordered [s], see dead_time.hpp
};

/// Winding voltage for i > 0, or for a magnetized leg at any current. Magnetize puts two switches
/// in the path, freewheel one switch and one diode, demagnetize two diodes.
constexpr double winding_voltage(const Converter& c, Leg leg, double i) {
  switch (leg) {
    case Leg::magnetize:
      return c.u_dc - 2 * (c.v_switch + c.R_switch * i);
    case Leg::freewheel:
      return -(c.v_switch + c.R_switch * i) - (c.v_diode + c.R_diode * i);
    case Leg::demagnetize:
      return -c.u_dc - 2 * (c.v_diode + c.R_diode * i);
  }
  return 0;
}

/// True while the leg carries or can build up current: the diodes block the reverse direction.
constexpr bool conducts(Leg leg, double i) { return i > 0 || leg == Leg::magnetize; }

}  // namespace srm
