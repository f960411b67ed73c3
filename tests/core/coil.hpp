// A phase without iron, for what must hold of its inductance alone.
#pragma once

#include <cmath>

#include "srm/machine/magnetics.hpp"

namespace srm {

/// An inductance over the angle, without saturation.
struct Coil {
  using Scalar = double;
  double L = 10e-3;  // mean [H]
  double part = 0;   // by which it varies over the angle
  int N_r = 4;
  Magnetics<double> at(double i, double theta_e) const {
    const Jet<double> m = jet(i, theta_e);
    return {.psi = m.psi,
            .W_c = m.psi * i / 2,
            .tau = m.tau,
            .L_inc = m.L_inc,
            .psi_theta = m.psi_theta};
  }
  Jet<double> jet(double i, double theta_e) const {
    const double L_now = L * (1 - part * std::cos(theta_e)),
                 slope = L * part * N_r * std::sin(theta_e);
    const double bend = L * part * N_r * N_r * std::cos(theta_e);
    return {.psi = L_now * i,
            .tau = i * i / 2 * slope,
            .L_inc = L_now,
            .psi_theta = i * slope,
            .tau_theta = i * i / 2 * bend,
            .L_i = 0,
            .L_theta = slope,
            .psi_theta_2 = i * bend};
  }
};

}  // namespace srm
