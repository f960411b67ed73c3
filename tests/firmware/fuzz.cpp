// Random bit patterns into the step and into its parameters, under the address and undefined
// behaviour sanitizers. Compiled by tests/support/firmware_fuzz.py with a generated
// `corrupt.hpp`.
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "corrupt.hpp"
#include "parameters.hpp"
#include "reluctance_controller.h"

namespace {

constexpr int N = RELUCTANCE_PHASES;
std::uint64_t state = 0x9E3779B97F4A7C15;

std::uint32_t bits() {  // xorshift64*, Vigna 2016
  state ^= state >> 12;
  state ^= state << 25;
  state ^= state >> 27;
  return static_cast<std::uint32_t>((state * 0x2545F4914F6CDD1D) >> 32);
}

/// A plain value, a special one, or any pattern at all.
float pattern(float plain) {
  static constexpr std::uint32_t special[] = {0x00000000, 0x80000000, 0x7F800000, 0xFF800000,
                                              0x7FC00000, 0x7F800001, 0x00000001, 0x7F7FFFFF,
                                              0xFF7FFFFF, 0x4F000000, 0xCF000000, 0x40C90FDB};
  const std::uint32_t choice = bits() % 4;
  if (choice < 2) return plain * static_cast<float>(bits() % 2048) / 1024.0F;
  const std::uint32_t word = choice == 2 ? special[bits() % 12] : bits();
  float value;
  std::memcpy(&value, &word, sizeof value);
  return value;
}

srm::Measurement<float, N> any_measurement() {
  srm::Measurement<float, N> y;
  for (float& i : y.i) i = pattern(reluctance::protection.levels.i_trip);
  y.theta_e = pattern(3.0F);
  y.omega_m = pattern(reluctance::protection.levels.omega_max);
  y.u_dc = pattern(reluctance::protection.levels.u_dc_max);
  return y;
}

bool all_off(const reluctance_command& command) {
  for (const auto& phase : command.phase) {
    if (phase.gate != RELUCTANCE_TIMER) return false;
    for (const std::int8_t leg : phase.leg) {
      if (leg != RELUCTANCE_DEMAGNETIZE) return false;
    }
  }
  return true;
}

/// Through the C interface: a fault is all legs off, and stays until the reset.
int step_through_the_interface(int n) {
  reluctance_controller controller;
  reluctance_init(&controller);
  int refused = 0;
  for (int step = 0; step < n; ++step) {
    const auto y = any_measurement();
    reluctance_measurement measurement;
    static_assert(sizeof measurement == sizeof y);
    std::memcpy(&measurement, &y, sizeof y);
    reluctance_command command;
    const auto status = reluctance_step(&controller, &measurement, pattern(40.0F), &command);
    if (status != reluctance_get_status(&controller)) return 1;
    if (status == RELUCTANCE_OK) continue;
    ++refused;
    if (!all_off(command) || std::strlen(reluctance_describe(status)) < 10) return 1;
    if (bits() % 4 == 0) reluctance_reset(&controller);
  }
  return refused > 0 ? 0 : 1;
}

/// The law behind the protection, with samples and parameters of any kind. Angle and phase count
/// are what the law is promised; the rest is not.
void step_with_corrupt_parameters(int n) {
  for (int round = 0; round < n; ++round) {
    auto control = reluctance::control;
    auto machine = reluctance::machine;
    auto protection = reluctance::protection;
    corrupt(control, machine, protection, [](float& value) {
      if (bits() % 8 == 0) value = pattern(value);
    });
    decltype(control)::State x;
    decltype(protection)::State<N> guard;
    for (int step = 0; step < 10; ++step) {
      auto y = any_measurement();
      const float reference = pattern(40.0F);
      protection.admits(guard, machine, y, reference, protection.levels);
      y.theta_e = srm::wrap(y.theta_e);
      const auto command = control.step(x, y, reference);
      protection.remember(guard, machine.N_r, y, command, protection.levels);
      guard.fault.status = srm::Status::ok;
      guard.latched = false;
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int n = argc > 1 ? std::atoi(argv[1]) : 1000;
  if (argc > 2) state ^= std::strtoull(argv[2], nullptr, 10) << 8;
  step_with_corrupt_parameters(n / 10);
  const int failed = step_through_the_interface(n);
  std::puts(failed ? "a fault did not end in the safe state" : "ok");
  return failed;
}
