// The self-test in the emulator. Ends with 0 where it passes; 1: tables, 2: orders, 3: both differ.
// `cycles` are ticks of the emulator's timer here.
#include "reluctance_self_test.h"
#include "semihosting.hpp"

extern "C" int main();

namespace {

volatile std::uint32_t& tick_register(std::uint32_t offset) {
  return *reinterpret_cast<volatile std::uint32_t*>(0xE000E010 + offset);
}

std::uint32_t ticks() { return 0xFFFFFF - tick_register(8); }

reluctance_controller controller;

}  // namespace

int main() {
  tick_register(4) = 0xFFFFFF;  // reload
  tick_register(8) = 0;         // current value
  tick_register(0) = 5;         // processor clock, no interrupt
  reluctance_self_test_result result;
  reluctance_self_test(&controller, ticks, &result);
  if (result.cycles_max == 0) return 4;
  return result.tables_differ + 2 * result.orders_differ;
}
