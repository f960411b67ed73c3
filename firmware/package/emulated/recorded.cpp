// Runs the states of the drive with the recorder, in the emulator, and writes the recorder's dump.
//
// Reads records from the file `calls`: measurement, request, number of a parameter that is set
// before the call (-1: none), its value. Writes instructions of each recorded call to the file
// `counts`, and at the end the dump to the file `dump`. Little-endian 32-bit words throughout.
#include "reluctance_parameters.h"
#include "reluctance_recorder.h"
#include "semihosting.hpp"

extern "C" int main();

namespace {

struct Call {
  reluctance_measurement measurement;
  reluctance_request request;
  std::int32_t parameter;
  float value;
};

constexpr std::uint32_t segments = 4, samples = 64, after = 32;

reluctance_controller controller;
reluctance_recorder recorder;
std::uint32_t memory[RELUCTANCE_RECORDER_WORDS(segments, samples)];
Call call;
reluctance_command command;
reluctance_outputs outputs;

volatile std::uint32_t& tick_register(std::uint32_t offset) {
  return *reinterpret_cast<volatile std::uint32_t*>(0xE000E010 + offset);
}

[[gnu::noinline]] std::uint32_t counted_call() {
  const std::uint32_t before = tick_register(8);
  reluctance_run_recorded(&recorder, &controller, &call.measurement, &call.request, &command,
                          &outputs);
  return (((before - tick_register(8)) & 0xFFFFFF) * 10 + 128) / 256;
}

void put(void* file, const std::uint32_t* words, std::uint32_t count) {
  semihosting::write_all(*static_cast<int*>(file), words, 4 * count);
}

}  // namespace

int main() {
  const int calls = semihosting::open_file("calls", 1);
  const int counts = semihosting::open_file("counts", 5);
  int dump = semihosting::open_file("dump", 5);
  if (calls < 0 || counts < 0 || dump < 0) {
    semihosting::print("need the files `calls`, `counts` and `dump`\n");
    return 66;
  }
  tick_register(4) = 0xFFFFFF;  // reload
  tick_register(8) = 0;         // current value
  tick_register(0) = 5;         // processor clock, no interrupt
  reluctance_init(&controller);
  const std::uint32_t words = sizeof memory / sizeof memory[0];
  if (reluctance_recorder_start(&recorder, memory, words, samples, after) == 0) return 78;
  while (semihosting::read_all(calls, &call, sizeof call)) {
    if (call.parameter >= 0 && reluctance_parameter_set(&controller, call.parameter, call.value)) {
      semihosting::print("a parameter was refused\n");
      return 65;
    }
    const std::uint32_t spent = counted_call();
    if (!semihosting::write_all(counts, &spent, sizeof spent)) return 74;
  }
  return reluctance_recorder_dump(&recorder, put, &dump) > 0 ? 0 : 74;
}
