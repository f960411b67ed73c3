// Sensors and timing of the controller: what it sees of the plant.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "srm/control/interface/interface.hpp"
#include "srm/plant/drive.hpp"
#include "srm/sim/noise.hpp"
#include "srm/sim/rotor_sensor.hpp"

namespace srm {

/// Sensors and timing of the controller. Zero bits, counts, noise and offsets mean an ideal sensor.
struct Sampling {
  static constexpr int most_phases = 6;

  double T_s{};                                // control period [s]
  int delay{};                                 // samples from measurement to effect: 0 or 1
  int adc_bits{};                              // of the current converter
  double i_range{};                            // its full scale [A]
  double i_noise{};                            // rms, before the converter [A]
  std::array<double, most_phases> i_offset{};  // shown at no current [A]
  std::array<double, most_phases> i_gain{1, 1, 1, 1, 1, 1};  // shown over true
  double u_noise{};                                          // of the dc-link voltage, rms [V]
  int seed{};                                                // of the noise
  RotorSensor rotor{};
  double angle_offset{};  // of the angle sensor, electrical: shown less true [rad]
  SRM_FIELDS(T_s, delay, adc_bits, i_range, i_noise, i_offset, i_gain, u_noise, seed, rotor,
             angle_offset)
};

/// The current as the sensor of phase k shows it: quantised, and saturated at the converter's
/// range. A converter with noise or offset shows negative values too.
inline double sensed_current(const Sampling& s, double i, int k, long sample) {
  i = s.i_gain[k] * i + s.i_offset[k];
  if (s.i_noise > 0) i += s.i_noise * noise(s.seed, k, sample);
  if (s.adc_bits == 0) return i;
  const double codes = std::ldexp(1.0, s.adc_bits);
  const double code = std::floor(i / s.i_range * codes);
  return std::clamp(code, -codes, codes - 1) / codes * s.i_range;
}

/// The sensors' view of the state. i_source: of the source [A]; sample: its number; rotor: what
/// the rotor sensor remembers.
template <Machine M, int N>
Measurement<double, N> measured(const Plant<M, N>& p, const State<N>& x, double i_source,
                                const Sampling& s, long sample, RotorSensor::State& rotor) {
  Measurement<double, N> y;
  for (int k = 0; k < N; ++k) y.i[k] = sensed_current(s, x.i[k], k, sample);
  const double theta_m = s.rotor.step(rotor, x.theta_m, p.machine.N_r, N);
  y.theta_e = wrap(wrap(p.machine.N_r * theta_m) + s.angle_offset);
  y.omega_m = x.omega_m;
  y.u_dc = x.u_dc;
  if (s.u_noise > 0) y.u_dc += s.u_noise * noise(s.seed, Sampling::most_phases, sample);
  y.i_source = i_source;
  return y;
}

}  // namespace srm
