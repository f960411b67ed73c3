// One hash of a closed loop: the plant, every located event and two laws give the same bits on each
// compiler and at each optimisation. tests/core/test_core.py compares the lines that builds print.
#include <bit>
#include <cstdint>
#include <cstdio>

#include "srm/control/law/deadbeat.hpp"
#include "srm/control/law/torque_sharing.hpp"
#include "srm/machine/lehuy.hpp"
#include "srm/sim/desk.hpp"
#include "srm/sim/simulation.hpp"

namespace {

using Machine = srm::LeHuy<double>;
constexpr int N = 3;

/// FNV-1a over the bits of the rows.
std::uint64_t hashed(std::uint64_t hash, const srm::Rows& rows) {
  for (int j = 0; j < rows.size() * rows.columns(); ++j) {
    const std::uint64_t bits = std::bit_cast<std::uint64_t>(rows.data()[j]);
    for (int byte = 0; byte < 8; ++byte) {
      hash = (hash ^ (bits >> (8 * byte) & 0xff)) * 1099511628211u;
    }
  }
  return hash;
}

template <class Law>
void run(const char* name, const Machine& machine, const Law& law) {
  const srm::DriveControl<Law> control{.law = law};
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
  const srm::Sampling sampling{.T_s = 20e-6, .adc_bits = 12, .i_range = 200};
  srm::Simulation<Machine, N> loop(plant, 0, sampling, srm::on_desk(control, nullptr),
                                   srm::constant(30), 0, {10e-6, {150, 240}, 0});
  srm::Rows waveforms(srm::columns_of(srm::Waveform<N>{}), 1000);
  srm::Rows periods(srm::columns_of(srm::Period<N>{}), 10);
  std::uint64_t hash = 14695981039346656037u;
  for (double t = 0; t < 0.02;) {
    t = loop.advance(0.02, waveforms, periods);
    hash = hashed(hashed(hash, waveforms), periods);
    waveforms.clear();
    periods.clear();
  }
  std::printf("%s %016llx\n", name, static_cast<unsigned long long>(hash));
}

}  // namespace

int main() {
  const Machine machine = srm::lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468);
  const srm::Sharing<double> sharing{
      .shape = srm::Shape::cubic, .theta_on = 0.17, .theta_ov = 0.7, .table = {}};
  run("sharing", machine,
      srm::TorqueSharing<Machine, N>{.machine = machine,
                                     .sharing = sharing,
                                     .feasible = srm::always_feasible<double>(),
                                     .guide = {},
                                     .R = 0.72,
                                     .i_max = 150,
                                     .i_band = 1,
                                     .T_s = 20e-6});
  run("deadbeat", machine,
      srm::Deadbeat<Machine, N>{.machine = machine,
                                .R = 0.72,
                                .sharing = sharing,
                                .feasible = srm::always_feasible<double>(),
                                .guide = {},
                                .i_max = 150,
                                .T_s = 20e-6});
  return 0;
}
