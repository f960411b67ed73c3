// How angles are held against each other: rotors that accelerate at random up to the greatest
// acceleration are never suspected, and a change of the speed or a jump beyond it always is.
#include <cmath>
#include <random>

#include "srm/control/guard/advance.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr double T_s = 20e-6, step = two_pi<double> / 1024, a = 2e4;  // electrical
constexpr double slack = step;                                        // two angles that are counted
constexpr int block = 5;
constexpr double tau = Advance<double>::parts * block * T_s;
constexpr Advance<double> advance{.bend = a * tau * tau, .block = block};
constexpr unsigned seed = 20261127;

/// A rotor and its counter.
struct Rotor {
  double theta = 0, omega = 0;

  void turn(double acceleration) {
    theta += (omega + acceleration * T_s / 2) * T_s;
    omega += acceleration * T_s;
  }
  double counted(double offset = 0) const {
    return wrap(step * std::floor((theta + offset) / step));
  }
};

/// Its counted angles, held against each other.
struct Held {
  Advance<double>::State x;
  double last = 0;

  bool contradicts(double theta_e) {
    const double beyond = advance.beyond(x, last, theta_e, 0, slack);
    last = theta_e;
    return std::fabs(beyond) > 0;
  }
};

/// Samples in which a sound rotor contradicts.
int false_alarms(std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1, 1);
  int wrong = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Rotor rotor{.theta = 10 * any(random), .omega = 2000 * any(random)};
    Held held;
    double acceleration = 0;
    for (int n = 0; n < 4000; ++n) {
      if (any(random) > 0.97) acceleration = any(random) > 0 ? a : -a;
      rotor.turn(acceleration);
      wrong += held.contradicts(rotor.counted());
    }
  }
  return wrong;
}

constexpr int watched = 1000;  // [samples]

/// Samples until a speed that changes at once, or an angle that jumps, is found; over all runs.
struct Until {
  int least = watched, most = 0;
};

Until found(std::mt19937& random, double speed, double jump) {
  std::uniform_real_distribution<double> any(-1, 1);
  Until until;
  for (int trial = 0; trial < 400; ++trial) {
    Rotor rotor{.theta = 10 * any(random), .omega = 300 * any(random)};
    Held held;
    const double sign = any(random) > 0 ? 1 : -1;
    const int sound = 200 + int(20 * any(random));
    int n = 0;
    for (; n < sound; ++n) {
      rotor.turn(0);
      held.contradicts(rotor.counted());
    }
    rotor.omega += sign * speed;
    for (n = 1; n < watched; ++n) {
      rotor.turn(0);
      if (held.contradicts(rotor.counted(sign * jump))) break;
    }
    until.least = n < until.least ? n : until.least;
    until.most = n > until.most ? n : until.most;
  }
  return until;
}

/// Samples until an angle that jumps with the first judgement is found.
int first_found() {
  Held held;
  constexpr int first = (2 * Advance<double>::parts + 1) * block;
  for (int n = 1; n < watched; ++n) {
    if (held.contradicts(n < first ? 0 : 1)) return n;
  }
  return watched;
}

}  // namespace

int main() {
  std::mt19937 random(seed);
  std::printf("seed %u\n", seed);
  check("no rotor within its acceleration is suspected [samples]", false_alarms(random), 0);
  const double beyond = 1.01 * (advance.most(slack) + 2 * step);
  const int samples = Advance<double>::parts * block;
  check("a speed that changes is found within tau and a block [samples]",
        found(random, beyond / tau, 0).most, samples + block);
  check("an angle that jumps is found within a block [samples]", found(random, 0, beyond).most,
        block);
  check("the first angle is judged when all before it are kept [samples]",
        first_found() - (2 * Advance<double>::parts + 1) * block, 0);
  check("a change that a rotor can make is found in no run [samples left]",
        watched - found(random, 0.98 * advance.bend / tau, 0).least, 0);
  return failures > 0;
}
