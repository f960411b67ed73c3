// The emulated board: main.c with the board of board.c, whose bench is at the other end of two
// pipes. Reads a bench_sample from the file `samples` once a control period, and answers with a
// bench_answer in the file `orders`.
extern "C" {
#include "bench.h"
}
#include "semihosting.hpp"

extern "C" int main();

namespace {
bench_sample sample;
bench_answer answer;
}  // namespace

int main() {
  const int samples = semihosting::open_file("samples", 1);
  const int orders = semihosting::open_file("orders", 5);
  if (samples < 0 || orders < 0) {
    semihosting::print("need the files `samples` and `orders`\n");
    return 66;
  }
  bench_start();
  while (semihosting::read_all(samples, &sample, sizeof sample)) {
    bench_period(&sample, &answer);
    if (!semihosting::write_all(orders, &answer, sizeof answer)) return 74;
  }
  return 0;
}
