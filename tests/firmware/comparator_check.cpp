// The comparator's rule in software against the simulation's gate drive, over random orders.
#include <cstdio>
#include <random>

#include "srm/control/frame/comparator.hpp"
#include "srm/sim/gate.hpp"

int main() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> part(0, 1);
  const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  int different = 0, seen[3] = {};
  for (int trial = 0; trial < 200000; ++trial) {
    srm::PhaseCommand<double> order;
    order.gate = pick(2) == 0 ? srm::Gate::comparator : srm::Gate::window;
    order.i_ref = pick(8) == 0 ? 0 : 10 * part(random);
    order.i_band = 3 * part(random);
    srm::set_thresholds(order,
                        pick(2) == 0 ? srm::Comparators::analog : srm::Comparators::two_level);
    order.chop = pick(2) == 0 ? srm::Leg::freewheel : srm::Leg::demagnetize;
    order.theta_on = 6 * part(random);
    order.theta_off = 6 * part(random);
    const double theta_e = 6.28 * part(random);
    const double i = pick(4) == 0 ? order.i_ref : 16 * part(random);
    const int k = pick(3);
    srm::GateState gate;
    gate.leg = static_cast<srm::Leg>(pick(3) - 1);
    gate.inside = srm::conducts(srm::phase_angle<3>(theta_e, k), order.theta_on, order.theta_off);
    const srm::Leg wanted = srm::ordered(order, gate, i);
    const srm::Leg got = srm::compared<3>(order, gate.leg, i, theta_e, k);
    ++seen[static_cast<int>(wanted) + 1];
    if (got != wanted) ++different;
  }
  std::printf("%d\n", different);
  return different == 0 && seen[0] > 0 && seen[1] > 0 && seen[2] > 0 ? 0 : 1;
}
