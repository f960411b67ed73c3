// Runs the controller on recorded or simulated samples, in the emulator.
//
// Reads records from the file `samples` and answers each in the file `orders`. Where the two are
// pipes, a simulation is at the other end and the loop is closed. Little-endian 32-bit words:
//
//   sample   measurement, reference
//   order    status, instructions of the step, instructions of the run, command, torque reference
//   at the end: fingerprint and stack bytes, as the last two words
//
// The answer is that of reluctance_step. The run is reluctance_run, which firmware calls, on the
// same sample: of a second controller, which begins in `run`. The stack is the deepest of all
// calls.
//
// Instructions are counted by SysTick under the emulator's `-icount shift=10`: an instruction takes
// 1024 ns, the timer runs at 25 MHz, so 25.6 ticks are one instruction.
#include "reluctance_controller.h"
#include "semihosting.hpp"
#include "state.hpp"

extern "C" std::uint32_t stack_low;
extern "C" int main();

namespace {

struct Sample {
  reluctance_measurement measurement;
  float reference;
};

struct Order {
  std::uint32_t status;
  std::uint32_t step, run;  // instructions
  reluctance_command command;
  float tau_ref;
};

volatile std::uint32_t& tick_register(std::uint32_t offset) {
  return *reinterpret_cast<volatile std::uint32_t*>(0xE000E010 + offset);
}

void start_ticks() {
  tick_register(4) = 0xFFFFFF;  // reload
  tick_register(8) = 0;         // current value
  tick_register(0) = 5;         // processor clock, no interrupt
}

std::uint32_t ticks() { return tick_register(8); }

constexpr std::uint32_t paint = 0xA5A5A5A5;

/// Marks the free stack below this frame.
[[gnu::noinline]] void paint_stack() {
  const auto* here = static_cast<const std::uint32_t*>(__builtin_frame_address(0)) - 8;
  for (volatile std::uint32_t* word = &stack_low; word < here; ++word) *word = paint;
}

/// From the caller's frame down to the deepest word that was written.
[[gnu::noinline]] std::uint32_t stack_used(const void* frame) {
  const volatile std::uint32_t* word = &stack_low;
  while (*word == paint) ++word;
  return static_cast<std::uint32_t>(static_cast<const volatile char*>(frame) -
                                    reinterpret_cast<const volatile char*>(word));
}

reluctance_controller stepped, driven;
reluctance_request request;
reluctance_command driven_command;
reluctance_outputs outputs;
Sample sample;
Order order;

/// Instructions of a call.
template <class Call>
std::uint32_t counted(const Call& call) {
  const std::uint32_t before = ticks();
  call();
  const std::uint32_t after = ticks();
  return (((before - after) & 0xFFFFFF) * 10 + 128) / 256;
}

/// The calls in frames of their own, so that the stack is counted from them.
[[gnu::noinline]] std::uint32_t counted_run() {
  return counted(
      [] { reluctance_run(&driven, &sample.measurement, &request, &driven_command, &outputs); });
}
[[gnu::noinline]] std::uint32_t counted_step() {
  return counted([] {
    order.status = reluctance_step(&stepped, &sample.measurement, sample.reference, &order.command);
  });
}

/// Both begin anew; the second in `run`, without what leads there.
void begin() {
  reluctance_init(&stepped);
  reluctance_init(&driven);
  reluctance::state_of(&driven).states.mode = srm::Mode::run;
  request.enable = 1;
}

void answer() {
  request.reference = sample.reference;
  ++request.sequence;
  order.run = counted_run();
  order.step = counted_step();
  order.tau_ref = reluctance_torque_reference(&stepped);
}

}  // namespace

int main() {
  const int samples = semihosting::open_file("samples", 1);
  const int orders = semihosting::open_file("orders", 5);
  if (samples < 0 || orders < 0) {
    semihosting::print("need the files `samples` and `orders`\n");
    return 66;
  }
  start_ticks();
  begin();
  paint_stack();
  while (semihosting::read_all(samples, &sample, sizeof sample)) {
    answer();
    if (!semihosting::write_all(orders, &order, sizeof order)) return 74;
  }
  request.tripped = 1;  // the stack of `fault` is another one
  for (int n = 0; n < 2; ++n) counted_run();
  const std::uint32_t last[2] = {reluctance_fingerprint(), stack_used(__builtin_frame_address(0))};
  return semihosting::write_all(orders, last, sizeof last) ? 0 : 74;
}
