// The controller as the loop calls it.
#pragma once

#include <functional>

#include "srm/control/frame/flux_angle.hpp"
#include "srm/control/frame/learned.hpp"
#include "srm/control/interface/interface.hpp"

namespace srm {

/// What one call of a controller yields.
template <int N>
struct Orders {
  Command<double, N> command;
  double tau_ref = 0;               // the torque reference it worked to, for the record [N m]
  Learned<double> learned{};        // of a law that learns
  FluxEstimate<double> estimate{};  // of a control that follows the rotor by the flux linkages
  bool at_once = false;  // the gates are off: in effect at this sample, whatever the delay
};

/// A complete controller with its state inside: speed loop, torque law, float or double. Erased to
/// one indirect call per sample, so that the loop is compiled once per machine and phase count.
template <int N>
using Controller = std::function<Orders<N>(const Measurement<double, N>&, double reference)>;

}  // namespace srm
