// What a commissioning routine has come to: it runs, it is done, or why not.
#pragma once

#include <cstdint>

namespace srm {

/// Numbers are part of the C interface.
enum class Finding : std::int32_t {
  idle = 0,
  running = 1,
  done = 2,
  over_current = 3,
  wrong_voltage = 4,
  not_a_number = 5,
  too_long = 6,
  open_phase = 7,
  two_sensors = 8,
  same_sensor = 9,
  no_current = 10,
  no_motion = 11,
  no_order = 12,
  rotor_moved = 13
};

constexpr const char* describe(Finding finding) {
  switch (finding) {
    case Finding::idle:
      return "no routine was started";
    case Finding::running:
      return "running";
    case Finding::done:
      return "done";
    case Finding::over_current:
      return "a current is above the trip level; lower the dc-link voltage or the duty";
    case Finding::wrong_voltage:
      return "the dc-link voltage is outside its limits; check the supply";
    case Finding::not_a_number:
      return "a measurement is not a finite number; check the sensors";
    case Finding::too_long:
      return "the routine took too long; check that the rotor can come to rest";
    case Finding::open_phase:
      return "no sensor shows a current while the leg magnetizes; check leg, winding and sensor";
    case Finding::two_sensors:
      return "two sensors show the current of one leg; check for a short between phases";
    case Finding::same_sensor:
      return "one sensor shows the currents of two legs; check the wiring of the sensors";
    case Finding::no_current:
      return "the current does not reach its reference, or does not fall in time; run `wiring` "
             "first, then check the voltage";
    case Finding::no_motion:
      return "the rotor does not turn to a phase from both sides; release it, or raise the current";
    case Finding::no_order:
      return "the resting angles are not one stroke apart; check N_r and the encoder";
    case Finding::rotor_moved:
      return "the rotor moved during a pulse; clamp it";
  }
  return "unknown";
}

}  // namespace srm
