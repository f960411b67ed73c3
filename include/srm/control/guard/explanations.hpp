// What is left of the explanations of a contradiction (diagnosis.hpp says which there are). One
// that has been dropped never returns.
//
// Angles are kept in steps of 15 deg, electrical, each with the angles half a step around it.
#pragma once

#include <bit>
#include <cstdint>

namespace srm {

struct Explanations {
  static constexpr int n_angles = 24;

  std::uint32_t offset = (1U << n_angles) - 1, reversed = offset;  // a bit for each angle
  std::uint8_t phase;                 // the phase that was contradicted first, or none
  std::uint8_t power, sensors, both;  // with which other phases it may be exchanged

  constexpr void no_angle() {
    offset = reversed = 0;
    both = 0;
  }

  /// Angles count from 0 to 2 n_angles: those of offset, then those of reversed.
  static constexpr bool backwards(int angle) { return angle >= n_angles; }
  constexpr void drop_angle(int angle) {
    std::uint32_t& left = backwards(angle) ? reversed : offset;
    left &= ~(1U << (backwards(angle) ? angle - n_angles : angle));
  }

  /// The first angle that is left from this one on; less than 0 where there is none.
  constexpr int next(int angle) const {
    for (int tries = 0; tries < 3; ++tries) {
      const int from = backwards(angle) ? n_angles : 0;
      const std::uint32_t rest = (from > 0 ? reversed : offset) >> (angle - from);
      if (rest != 0) return angle + std::countr_zero(rest);
      angle = n_angles - from;
    }
    return -1;
  }

  /// Whether nothing is left but a phase and an angle that is off by less than half a step.
  constexpr bool nearby() const {
    const bool exchanged = (power | sensors | both) != 0;
    return phase != 0 && offset == 1 && reversed == 0 && !exchanged;
  }
};

}  // namespace srm
