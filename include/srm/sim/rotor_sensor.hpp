// The rotor sensor: an encoder that knows its zero, an incremental encoder with an index, or Hall
// sensors.
//
// N Hall sensors divide an electrical period into 2 N sectors: alone, they show the middle of the
// sector. With an incremental encoder they tell where to start, to half a sector; an edge between
// two sectors sets the angle to the error of the edge's place, and the index sets it for good.
#pragma once

#include <cmath>

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"

namespace srm {

struct RotorSensor {
  int counts{};         // of the encoder, per mechanical revolution; 0: none
  bool index{};         // the encoder counts from where it is switched on, until its index passes
  bool hall{};          // one Hall sensor a phase
  double hall_error{};  // of the place of their edges: shown less true, mechanical [rad]
  SRM_FIELDS(counts, index, hall, hall_error)

  struct State {
    bool started = false;
    bool found = false;  // the index has passed
    double theta_m = 0;  // true, of the last sample [rad]
    double error = 0;    // of what is counted: shown less true [rad]
  };

  /// The angle that is shown [rad], at the true angle theta_m.
  double step(State& x, double theta_m, int N_r, int n_phases) const {
    const double sector = pi<double> / (n_phases * N_r);
    if (counts == 0) return hall ? middle(theta_m - hall_error, sector) + hall_error : theta_m;
    const double count = two_pi<double> / counts;
    if (index && !x.started) x.error = middle(theta_m, sector) - middle(theta_m, count);
    if (index && x.started && !x.found) {
      if (passed(x.theta_m, theta_m, sector)) x.error = hall_error;
      x.found = passed(x.theta_m, theta_m, two_pi<double>);
      if (x.found) x.error = 0;
    }
    x.started = true;
    x.theta_m = theta_m;
    return middle(theta_m, count) + x.error;
  }

 private:
  /// The middle of the interval that the angle is in.
  static double middle(double theta_m, double interval) {
    return (std::floor(theta_m / interval) + 0.5) * interval;
  }

  /// True where a multiple of `interval` lies between two angles.
  static bool passed(double from, double to, double interval) {
    return std::floor(to / interval) != std::floor(from / interval);
  }
};

}  // namespace srm
