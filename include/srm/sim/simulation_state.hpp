// What changes while plant and control run together.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "srm/plant/faults.hpp"
#include "srm/sim/controller.hpp"
#include "srm/sim/gates.hpp"
#include "srm/sim/independent.hpp"
#include "srm/sim/recorder.hpp"
#include "srm/sim/rotor_sensor.hpp"

namespace srm {

/// What has become of a fault of the list.
struct Onset {
  bool present = false;
  double kept = 0;        // what its sensor showed when it began
  double t = never_ends;  // when that was [s]
};

/// All that changes from step to step but the state of the controller: a plain value.
template <int N>
struct SimulationState {
  std::array<Instant<N>, 2> instants;  // this one and the end of the step, in turns
  int here = 0;                        // which of them is this one
  Integrals<N> sums;
  Gates<N> gates;
  AllLegs<N> legs;  // what the windings see
  Circuit<N> circuit;
  bool rated = false;        // the rates are those of this point and circuit
  bool prepared = false;     // what is due at this point is done
  bool independent = false;  // each phase takes steps of its own
  bool windows = false;      // an order has a conduction window
  std::array<PhaseStep, N> phase_steps;
  double t = 0, t_sample = 0, t_course = 0, t_record = 0;  // now, and next [s]
  double theta_period = 0, theta_next = 0;  // next end of a period; next angle that matters [rad]
  double theta_begun = 0;                   // lower end of the present period [rad]
  int turns = 0;                            // direction in which theta_next is ahead; 0: unknown
  double t_angle = 0;                       // when it is met with independent phases [s]
  double omega_e = 0, h_most = 0;           // meanwhile: electrical speed [rad/s], longest step [s]
  double h_fine = 1e300;                    // what a step may be, from the ones before [s]
  double tau_ref = 0;
  Learned<double> learned;        // of the controller, where it learns
  FluxEstimate<double> estimate;  // of the controller, where it follows the rotor
  long samples = 0, steps = 0;
  Switchings switchings, before_end;  // so far; before the end of the period that is reached
  Extremes extremes;
  RotorSensor::State rotor;
  Condition<N> condition;
  std::array<Onset, most_faults> onset;
  std::array<Line, N> compared;  // what the comparators see of the currents

  Instant<N>& at() { return instants[here]; }
  const Instant<N>& at() const { return instants[here]; }
  Instant<N>& end() { return instants[1 - here]; }
  const State<N>& x() const { return at().x; }
  /// True where a fault of the list begins at an angle that is still to come.
  bool awaits(const BrokenPart& part, std::size_t j) const {
    return part.theta_e >= 0 && !onset[j].present && t >= part.start && t < part.end;
  }
  int direction() const { return x().omega_m < 0 ? -1 : 1; }
  bool period_ends() const { return std::abs(x().theta_m - theta_period) <= angle_tolerance; }

  /// True while a phase is within a step: its current and its integrals are those of its start.
  bool within_step() const {
    return std::any_of(phase_steps.begin(), phase_steps.end(),
                       [](const PhaseStep& phase) { return phase.active; });
  }
};

}  // namespace srm
