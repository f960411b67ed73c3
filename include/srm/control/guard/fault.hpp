// What the protection finds: a status, and what it was found by.
#pragma once

#include <cstdint>

#include "srm/base/real.hpp"

namespace srm {

/// Numbers are part of the C interface.
enum class Status : std::int8_t {
  ok = 0,
  not_a_number = 1,
  over_current = 2,
  over_voltage = 3,
  under_voltage = 4,
  over_speed = 5,
  sensor_out_of_range = 6,
  stuck_angle = 7,
  dead_current_sensor = 8,
  current_too_low = 9,
  current_too_high = 10,
  frozen_current_sensor = 11,
  precharge_timeout = 12,
  calibration_failed = 13,
  command_timeout = 14,
  hardware_trip = 15,
  angle_off = 16,
  angle_reversed = 17,
  phases_exchanged = 18,
  angle_lost = 19,
  phase_unlike = 20
};

constexpr const char* describe(Status status) {
  switch (status) {
    case Status::ok:
      return "ok";
    case Status::not_a_number:
      return "a measurement or the reference is not a finite number";
    case Status::over_current:
      return "a phase current is above its trip level";
    case Status::over_voltage:
      return "the dc-link voltage is above its limit";
    case Status::under_voltage:
      return "the dc-link voltage is below its limit";
    case Status::over_speed:
      return "the speed is above its limit";
    case Status::sensor_out_of_range:
      return "a current is negative, or the angle is outside [0, 2 pi)";
    case Status::stuck_angle:
      return "the angle does not advance as a rotor turns";
    case Status::dead_current_sensor:
      return "a magnetized phase shows no current";
    case Status::current_too_low:
      return "a phase shows less current than its voltage must have built up";
    case Status::current_too_high:
      return "a phase shows more current than its voltage can have left: a switch may be shorted";
    case Status::frozen_current_sensor:
      return "a current sensor shows the same value in every sample";
    case Status::precharge_timeout:
      return "the dc link did not reach its voltage in time";
    case Status::calibration_failed:
      return "a current sensor has too large an offset";
    case Status::command_timeout:
      return "no command came in time";
    case Status::hardware_trip:
      return "the board tripped by itself";
    case Status::angle_off:
      return "the flux linkages belong to another angle: its zero is off, or at rest its direction";
    case Status::angle_reversed:
      return "the angle runs against the flux linkages: encoder reversed, or two phases exchanged";
    case Status::phases_exchanged:
      return "a phase carries the current of another: windings or current sensors are exchanged";
    case Status::angle_lost:
      return "the angle does not follow the flux linkages: encoder frozen, or counts lost";
    case Status::phase_unlike:
      return "a phase is unlike the others: gain of its current sensor, or turns shorted";
  }
  return "unknown";
}

/// A fault with its evidence. The unit of value and limit is that of the quantity: A, V, rad/s,
/// rad, Wb, or samples.
template <Real T>
struct Fault {
  Status status = Status::ok;
  std::int8_t phase = -1;  // -1: none
  T value{}, limit{};
  std::uint32_t age = 0;  // samples since the last one that was bad
};

}  // namespace srm
