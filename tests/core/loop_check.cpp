// The inner loop allocates nothing: every `new` is counted while a closed loop runs.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <new>

#include "srm/control/law/paper_mpc.hpp"
#include "srm/machine/lehuy.hpp"
#include "srm/sim/simulation.hpp"

namespace {
long allocations = 0;
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  std::abort();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

int main() {
  using Machine = srm::LeHuy<double>;
  constexpr int N = 3, rows = 200, columns = 90;
  const Machine machine = srm::lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468);

  // A plain guide: a flat top whose height grows with the torque.
  static double guide[rows * columns];
  const double omega = 157;
  for (int row = 0; row < rows; ++row) {
    for (int column = 10; column < 40; ++column) {
      guide[row * columns + column] = 80.0 * row / (rows - 1);
    }
  }
  const srm::PaperMpc<Machine, N, 3, 2> law{
      .machine = machine,
      .guide = {{{guide, rows * columns}, rows, columns, 41.339}, {&omega, 1}, 240, 0},
      .N_p = 3,
      .N_c = 2,
      .r_w = 0.05,
      .w_i = 0.05,
      .R = 0.72,
      .i_max = 150,
      .i_band = 1,
      .T_s = 20e-6,
      .delay = 0,
      .short_from = 1e30};
  srm::Controller<N> controller = [&law, state = decltype(law)::State{}](
                                      const srm::Measurement<double, N>& y, double tau) mutable {
    srm::Orders<N> orders{.command = law.step(state, y, tau), .tau_ref = tau};
    for (auto& order : orders.command) srm::set_thresholds(order, srm::Comparators::analog);
    return orders;
  };
  const srm::Plant<Machine, N> plant{
      .machine = machine,
      .R = 0.72,
      .source = srm::Battery{.E = srm::constant(240), .R = 0.05, .C = 2.2e-3},
      .bridge = srm::AsymmetricBridge{{1, 0.001, 0.8, 0.001}},
      .shaft = {.rotation = srm::Rotation::turning,
                .J = 0.008,
                .B = 0.02,
                .k = 0.0015,
                .tau_0 = srm::constant(0),
                .omega = srm::constant(157)}};
  const srm::Sampling sampling{
      .T_s = 20e-6, .adc_bits = 12, .i_range = 200, .rotor = {.counts = 4096}};
  srm::Simulation<Machine, N> loop(plant, 0, sampling, std::move(controller), srm::constant(41.339),
                                   0, {10e-6, {150, 240}, 0});
  srm::Rows waveforms(srm::columns_of(srm::Waveform<N>{}), 1000);
  srm::Rows periods(srm::columns_of(srm::Period<N>{}), 10);

  const long before = allocations;
  for (double t = 0; t < 0.05;) {
    t = loop.advance(0.05, waveforms, periods);
    waveforms.clear();
    periods.clear();
  }
  const long during = allocations - before;
  std::printf("%s allocations in 50 ms of closed loop: %ld\n", during == 0 ? "ok  " : "FAIL",
              during);
  return during == 0 ? 0 : 1;
}
