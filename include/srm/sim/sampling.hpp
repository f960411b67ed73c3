// Sensors and timing of the controller: what it sees of the plant.
#pragma once

#include <algorithm>
#include <cmath>

#include "srm/control/frame/interface.hpp"
#include "srm/plant/drive.hpp"

namespace srm {

/// Sensors and timing of the controller. Zero bits or counts mean an ideal sensor.
struct Sampling {
  double T_s{};           // control period [s]
  int delay{};            // samples from measurement to effect: 0 or 1
  int adc_bits{};         // of the current converter
  double i_range{};       // its full scale [A]
  int encoder_counts{};   // per mechanical revolution
  double angle_offset{};  // of the angle sensor, electrical: shown less true [rad]
  SRM_FIELDS(T_s, delay, adc_bits, i_range, encoder_counts, angle_offset)
};

/// The sensors' view of the state: quantised, and saturated at the converter's range. i_source: of
/// the source [A].
template <Machine M, int N>
Measurement<double, N> measured(const Plant<M, N>& p, const State<N>& x, double i_source,
                                const Sampling& s) {
  Measurement<double, N> y;
  y.i = x.i;
  if (s.adc_bits > 0) {
    const double codes = std::ldexp(1.0, s.adc_bits);
    for (double& i : y.i) {
      i = std::min(std::floor(i / s.i_range * codes), codes - 1) / codes * s.i_range;
    }
  }
  double theta_m = x.theta_m;
  if (s.encoder_counts > 0) {
    const double count = two_pi<double> / s.encoder_counts;
    theta_m = (std::floor(theta_m / count) + 0.5) * count;  // the middle of the interval it is in
  }
  y.theta_e = wrap(wrap(p.machine.N_r * theta_m) + s.angle_offset);
  y.omega_m = x.omega_m;
  y.u_dc = x.u_dc;
  y.i_source = i_source;
  return y;
}

}  // namespace srm
