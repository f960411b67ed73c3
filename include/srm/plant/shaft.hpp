// The shaft and its load: dynamometer, friction, fan, pump, constant torque, any function of speed.
#pragma once

#include <algorithm>
#include <functional>

#include "srm/plant/course.hpp"
#include "srm/plant/pump.hpp"

namespace srm {

/// locked: a dynamometer holds the speed.
enum class Rotation { locked, turning };

struct Shaft {
  Rotation rotation = Rotation::locked;
  double J = 1;                // inertia of rotor and load [kg m^2]
  double B{};                  // viscous friction [N m s]
  double k{};                  // fan or pump without static head: torque k omega |omega| [N m s^2]
  Course tau_0 = constant(0);  // torque against positive rotation, at any speed [N m]
  Course omega = constant(0);  // held where locked; else its first value is the start's [rad/s]
  std::function<double(double omega_m)> load{};  // more torque against the rotation [N m]
  Pump pump{};
  SRM_FIELDS(rotation, J, B, k, tau_0, omega, load, pump)
};

/// All torque that opposes the machine at speed omega_m [N m].
inline double load_torque(const Shaft& s, double omega_m, Moment m) {
  const double magnitude = omega_m < 0 ? -omega_m : omega_m;
  const double more = s.load ? s.load(omega_m) : 0;
  return s.tau_0.at(m) + s.B * omega_m + s.k * magnitude * omega_m + s.pump.torque(omega_m, m) +
         more;
}

/// J domega/dt = tau - load (eq. 2.4 of the paper, corrected) [rad/s^2]. Its rate is that of the
/// machine's torque alone.
inline Moving acceleration(const Shaft& s, const Moving& tau, double omega_m, Moment m) {
  if (s.rotation == Rotation::locked) return s.omega.rate(m.start);
  return 1 / s.J * (tau - load_torque(s, omega_m, m));
}

/// What the load's part in the change of speed over a step of length h is more than by its mean at
/// both ends: by Simpson's rule, for a load need not have a derivative [rad/s].
inline double load_between(const Shaft& s, const Moving& tau0, const Moving& omega0,
                           const Moving& tau1, const Moving& omega1, Moment start, double h) {
  if (s.rotation == Rotation::locked) return 0;
  const double ends = (tau0.now + tau1.now - s.J * (omega0.rate + omega1.rate)) / 2;
  const double middle = (omega0.now + omega1.now) / 2 + h / 8 * (omega0.rate - omega1.rate);
  return h * 2 / 3 / s.J * (ends - load_torque(s, middle, {start.t + h / 2, start.start}));
}

/// When load or held speed change their course next [s].
inline double next_change(const Shaft& s, double t) {
  return std::min({s.tau_0.next(t), s.omega.next(t), s.pump.H_static.next(t)});
}

/// The speed at t where the shaft is held; else omega_m [rad/s].
inline double forced(const Shaft& s, double omega_m, double t) {
  return s.rotation == Rotation::locked ? s.omega.at(t) : omega_m;
}

}  // namespace srm
