// The wiring routine of commissioning: which sensor shows which leg, after how many samples, and
// what it says where no sensor does, two do, or one does twice.
#include <cmath>
#include <cstdint>

#include "errors.hpp"
#include "srm/control/commission/wiring.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr int N = 3;
constexpr double T_s = 20e-6;
constexpr Wiring<double> routine{.duty = 0.5, .i_detect = 2, .n_pulse = 10, .n_rest = 6};

/// Leg k drives a current of rise A a sample in sensor `of[k]`, with a sign, and a part of it in
/// the next sensor.
struct Bench {
  std::array<int, N> of{0, 1, 2}, sign{1, 1, 1};
  double rise = 0.5, part = 0;
  Wiring<double>::State<N> x{};
  Measurement<double, N> y{.u_dc = 100};
  int pulses = 0, rests = 0;

  Finding run() {
    for (int n = 0; n < 1000 && x.finding == Finding::running; ++n) {
      const int k = x.k;
      const Command<double, N> orders = routine.step(x, y, T_s);
      bool driven = false;
      for (int j = 0; j < N; ++j) driven = driven || orders[j].leg[1] == Leg::magnetize;
      (driven ? pulses : rests) += 1;
      const double i = driven ? std::fabs(y.i[of[k]]) + rise : 0;
      y.i = {};
      y.i[of[k]] = sign[k] * i;
      y.i[(of[k] + 1) % N] = part * i;
    }
    return x.finding;
  }
};

/// More than 2 A, with 0.5 A a sample, are there after five of them and seen in the sixth. Each leg
/// rests for more than six samples, and for more than twice as long as its pulse.
double sensors_and_signs() {
  double worst = 0;
  for (const auto& of : {std::array{0, 1, 2}, std::array{2, 0, 1}, std::array{1, 0, 2}}) {
    Bench b{.of = of, .sign = {1, -1, 1}};
    worst += unless(b.run() == Finding::done && b.pulses == 3 * 5);
    for (int k = 0; k < N; ++k) {
      worst += unless(b.x.sensor[k] == of[k] && b.x.sign[k] == b.sign[k]);
    }
    worst += unless(b.rests == 3 * (1 + 2 * 6 + 1));
  }
  Bench quick{.rise = 3};
  worst += unless(quick.run() == Finding::done && quick.rests == 3 * (1 + 6 + 1));
  return worst;
}

/// No current within the longest pulse; the last sample of it may show one.
double no_sensor() {
  Bench open{.rise = 0};
  double worst = unless(open.run() == Finding::open_phase && open.x.k == 0);
  worst += unless(open.pulses == routine.n_pulse + 1);
  Bench late{.rise = 2.0001 / routine.n_pulse};
  worst += unless(late.run() == Finding::done);
  Bench later{.rise = 1.9999 / routine.n_pulse};
  worst += unless(later.run() == Finding::open_phase);
  return worst;
}

double wrong_sensors() {
  Bench less{.part = 0.333}, more{.part = 0.334}, twice{.of = {0, 1, 0}};
  return worst_of({unless(less.run() == Finding::done), unless(more.run() == Finding::two_sensors),
                   unless(twice.run() == Finding::same_sensor && twice.x.k == 2)});
}

}  // namespace

int main() {
  check("sensors and signs of the legs, samples of pulse and rest", sensors_and_signs(), 0);
  check("a leg without a current", no_sensor(), 0);
  check("two sensors of a leg, two legs of a sensor", wrong_sensors(), 0);
  return failures == 0 ? 0 : 1;
}
