// Conduction windows as the position compare sees them: by the rotor sensor.
#pragma once

#include "srm/control/interface/interface.hpp"
#include "srm/sim/guard.hpp"

namespace srm {

struct SensedAngle {
  int N_r;
  int direction;  // of rotation
  double error;   // of the sensor, electrical: shown less true [rad]

  /// At the true electrical angle theta_e of the phase. An edge met within the tolerance counts as
  /// passed, in the direction of motion.
  bool inside(const PhaseCommand<double>& c, double theta_e) const {
    const double past = direction * 2 * N_r * angle_tolerance;
    return conducts(wrap(wrap(theta_e + error) + past), c.theta_on, c.theta_off);
  }

  /// How far the rotor is from the next edge of the window [rad].
  double to_edge(const PhaseCommand<double>& c, double theta_e) const {
    const double pitch = two_pi<double> / N_r;
    double ahead = pitch;
    for (const double edge : {c.theta_on, c.theta_off}) {
      const double gap = wrap(direction * (edge - wrap(theta_e + error))) / N_r;
      if (gap > angle_tolerance) ahead = min(ahead, gap);
    }
    return ahead;
  }
};

}  // namespace srm
