// The shaft and its load: dynamometer, pump, constant torque.
#pragma once

namespace srm {

enum class Shaft { locked, turning };  // locked: a dynamometer holds the speed

struct Mechanics {
  Shaft shaft;
  double J;         // inertia of rotor and load [kg m^2]
  double B;         // viscous friction [N m s]
  double k_pump;    // centrifugal pump: torque k omega^2 against the motion [N m s^2]
  double tau_load;  // constant torque against positive rotation [N m]
};

/// All torque that opposes the machine at speed omega_m [N m].
constexpr double load_torque(const Mechanics& m, double omega_m) {
  const double magnitude = omega_m < 0 ? -omega_m : omega_m;
  return m.tau_load + m.B * omega_m + m.k_pump * magnitude * omega_m;
}

/// J domega/dt = tau - load (eq. 2.4 of the paper, corrected) [rad/s^2].
constexpr double acceleration(const Mechanics& m, double tau, double omega_m) {
  return m.shaft == Shaft::locked ? 0 : (tau - load_torque(m, omega_m)) / m.J;
}

}  // namespace srm
