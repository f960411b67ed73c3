// The reference profile of the checks of `edge_mpc`: the flux linkages of a sharing function, which
// leave no ripple.
#pragma once

#include <cstddef>
#include <vector>

#include "errors.hpp"
#include "srm/control/part/sharing.hpp"
#include "srm/machine/lehuy.hpp"
#include "srm/machine/torque_inverse.hpp"

namespace sharing_guide {

inline constexpr int rows = 40, columns = 360;
inline constexpr double tau_max = 40;  // [N m]

inline srm::LeHuy<double> machine() {
  return srm::lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468);
}

/// Of one of three phases over torque and angle [Wb].
inline std::vector<double> values() {
  std::vector<double> psi(static_cast<std::size_t>(rows * columns));
  const srm::Sharing<double> s{.shape = srm::Shape::cubic, .theta_on = 0.35, .theta_ov = 0.6};
  for (int row = 1; row < rows; ++row) {
    const double tau = tau_max * row * row / (rows - 1.0) / (rows - 1.0);
    for (int column = 0; column < columns; ++column) {
      const double theta = column * turn / columns, share = s.share<3>(theta);
      if (!(share > 0)) continue;
      const double i = srm::current_for_torque(machine(), share * tau, theta, 150.0);
      psi[static_cast<std::size_t>(row * columns + column)] = machine().at(i, theta).psi;
    }
  }
  return psi;
}

}  // namespace sharing_guide
