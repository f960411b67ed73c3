// Orders as timers take them: integer ticks, edges of each switch, images of registers.
#include <cstddef>
#include <new>

#include "_standard.hpp"
#include "reluctance_controller.h"
#include "srm/control/frame/timer_ticks.hpp"

namespace {

using Phase = srm::PhaseCommand<float>;

static_assert(sizeof(srm::LegEdges) == sizeof(reluctance_leg_edges));
static_assert(offsetof(srm::SwitchEdges, tick) == offsetof(reluctance_switch_edges, tick));
static_assert(sizeof(Phase) == sizeof(reluctance_phase_command));

constexpr uint16_t least_compare = 3;  // HRTIM: smaller compare values are ignored

/// The bit of the compare unit with this value, a new one where none has it; 0 where all are taken.
uint8_t compare_bit(reluctance_hrtim& to, int& used, uint16_t tick) {
  for (int n = 0; n < used; ++n) {
    if (to.cmp[n] == tick) return static_cast<uint8_t>(1U << n);
  }
  if (used == 4 || tick < least_compare) return 0;
  to.cmp[used] = tick;
  return static_cast<uint8_t>(1U << used++);
}

/// Which compare units set and reset an output; false where they do not suffice.
bool write_output(const reluctance_switch_edges& edges, reluctance_hrtim& to, int& used,
                  uint8_t& set, uint8_t& reset) {
  constexpr uint8_t period = 1U << 4;
  (edges.on != 0 ? set : reset) = period;
  for (int n = 0; n < edges.count; ++n) {
    const uint8_t bit = compare_bit(to, used, edges.tick[n]);
    if (bit == 0) return false;
    const bool rises = (n % 2 == 0) != (edges.on != 0);
    uint8_t& source = rises ? set : reset;
    source = static_cast<uint8_t>(source | bit);
  }
  return true;
}

}  // namespace

reluctance_leg_edges reluctance_edges(const reluctance_phase_command* order, int lower_freewheels,
                                      uint16_t period_ticks) {
  const Phase& phase = *std::launder(reinterpret_cast<const Phase*>(order));
  const auto freewheel =
      lower_freewheels != 0 ? srm::Freewheel::lower_opens : srm::Freewheel::upper_opens;
  const float ticks_per_s = static_cast<float>(period_ticks) / RELUCTANCE_CONTROL_PERIOD_S;
  const srm::LegEdges edges = srm::leg_edges(phase, freewheel, ticks_per_s, period_ticks);
  reluctance_leg_edges told;
  ::new (&told) srm::LegEdges(edges);
  return told;
}

int32_t reluctance_to_hrtim(const reluctance_leg_edges* edges, reluctance_hrtim* registers) {
  reluctance_hrtim to = {{0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF}, 0, 0, 0, 0};
  int used = 0;
  if (!write_output(edges->upper, to, used, to.set1, to.reset1)) return 0;
  if (!write_output(edges->lower, to, used, to.set2, to.reset2)) return 0;
  *registers = to;
  return 1;
}

void reluctance_to_epwm(const reluctance_leg_edges* edges, reluctance_epwm* registers) {
  const reluctance_switch_edges* outputs[2] = {&edges->upper, &edges->lower};
  registers->start = 0;
  for (int side = 0; side < 2; ++side) {
    const reluctance_switch_edges& from = *outputs[side];
    if (from.on != 0) registers->start = static_cast<uint8_t>(registers->start | 1U << side);
    for (int n = 0; n < 4; ++n) {
      registers->xcmp[4 * side + n] = n < from.count ? from.tick[n] : uint16_t(0xFFFF);
    }
  }
}
