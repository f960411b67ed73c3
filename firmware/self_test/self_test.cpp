// The self-test: CRC-32 of the tables, and of the orders for stored samples.
#include "reluctance_self_test.h"
#include "self_test_data.hpp"
#include "srm/base/crc32.hpp"

namespace {

constexpr int N = RELUCTANCE_PHASES;

reluctance_measurement measured(const float* sample) {
  reluctance_measurement y{};
  for (int k = 0; k < N; ++k) y.i_A[k] = sample[k];
  y.theta_e_rad = sample[N];
  y.omega_m_rad_s = sample[N + 1];
  y.u_dc_V = sample[N + 2];
  y.i_source_A = sample[N + 3];
  return y;
}

/// CRC of the orders of a step, after that of the steps before.
std::uint32_t crc_of(const reluctance_command& command, std::uint32_t before) {
  for (reluctance_phase_command phase : command.phase) {
    phase.unused = 0;
    std::uint32_t word[sizeof phase / 4];
    __builtin_memcpy(word, &phase, sizeof phase);
    before = srm::crc32(word, sizeof phase / 4, before);
  }
  return before;
}

}  // namespace

int32_t reluctance_self_test(reluctance_controller* controller, uint32_t (*cycles)(void),
                             reluctance_self_test_result* result) {
  *result = {};
  result->tables_differ = reluctance_tables_crc() != reluctance::tables_crc;
  reluctance_init(controller);
  std::uint32_t crc = 0;
  for (const auto& sample : reluctance::self_test_samples) {
    const reluctance_measurement y = measured(sample);
    reluctance_command command{};
    const std::uint32_t before = cycles ? cycles() : 0;
    reluctance_step(controller, &y, sample[N + 4], &command);
    const std::uint32_t spent = cycles ? cycles() - before : 0;
    if (spent > result->cycles_max) result->cycles_max = spent;
    crc = crc_of(command, crc);
  }
  reluctance_init(controller);
  result->orders_differ = crc != reluctance::self_test_orders_crc;
  return !result->tables_differ && !result->orders_differ;
}
