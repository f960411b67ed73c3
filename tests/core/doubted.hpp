// The machine, the protection and the diagnosis of the checks of a doubt.
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>

#include "errors.hpp"
#include "srm/control/guard/diagnosis.hpp"
#include "srm/machine/lehuy.hpp"
#include "within.hpp"

namespace doubted {

using namespace srm;

inline constexpr double T_s = 20e-6, R = 0.7, u_dc = 240;  // [s], [ohm], [V]
inline constexpr double i_zero = 0.5, i_max = 150, psi_error = 1e-3;

inline LeHuy<double> machine() { return lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468); }
inline double aligned(double i) { return machine().at(i, turn / 2).psi; }

inline Protection<double> protection(int delay) {
  return {
      .flux = {.R = R, .T_s = T_s, .i_error = 0.1, .model_error = 1, .u_margin = 1},
      .levels = {.i_trip = 300, .u_dc_min = 1, .u_dc_max = 1e3, .omega_max = 1e3, .angle_slack = 9},
      .advance = {},
      .i_zero = i_zero,
      .delay = delay,
      .frozen = 0};
}

inline Diagnosis<double> diagnosis() {
  Diagnosis<double> d{};
  d.flux.R_error = 0.02;
  d.flux.i_gain = 0.01;
  d.flux.map_error = 0.02;
  d.flux.psi_error = psi_error;
  d.flux.psi_zero = 1.02 * aligned(i_zero + 0.1) + psi_error;
  d.flux.psi_max = 1.02 * aligned(i_max) + psi_error;
  d.theta_error = 0.02;
  d.i_max = i_max;
  d.patience = 5000;
  d.trial = {.i = 12, .psi = 1.02 * aligned(12) + psi_error, .psi_sample = 1.5e-3};
  d.likeness.spread = 1e9;
  d.likeness.recent = 5000;
  return d;
}

}  // namespace doubted
