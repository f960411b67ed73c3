// Flux that is there when it is needed: the start of a phase.
//
// A phase takes its share over near the unaligned position when motoring, just past alignment when
// braking. In both a little torque needs much flux, and flux does not jump: per electrical radian
// it grows by at most s = (u - R i)/omega_e. So the phase must follow a line of that slope
// beforehand, the lowest one that nowhere passes below the flux of its share,
//
//   psi(x) = psi_end - s (x_end - x),  x_end where psi_share(x) - s x is greatest over x >= 0,
//
// with x the angle travelled since the share starts. The line begins where it is zero, where the
// phase may still give torque of the wrong sign, and ends where it meets the flux of the share. The
// end is in tables over torque and 1/s, made offline from the machine and its sharing function; an
// end between two entries lies near the flux of the share too.
//
// When motoring, where neither the voltage nor the current limit keeps the phases from their
// shares, nothing of this is needed. A table gives, for each torque, the 1/s up to which the mean
// is within half a percent without a lead.
#pragma once

#include <array>

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"
#include "srm/base/interpolate.hpp"

namespace srm {

/// The lines of one direction of torque against motion.
template <Real T>
struct LeadLines {
  static constexpr int points = 9;  // of the torques, and of the angles per flux

  T theta_start;  // where the share starts, in the frame of positive torque [rad]
  std::array<T, points * points> psi_end;  // for each angle per flux over the torques [Wb]
  std::array<T, points * points> x_end;    // where the line meets the share [rad]
  T reach_least;  // angle per flux up to which the mean of every torque is held by the shares
                  // [rad/Wb]
  std::array<T, points> reach;  // of each torque
  SRM_FIELDS(theta_start, psi_end, x_end, reach_least, reach)
};

/// The line of one torque at one speed and voltage.
template <Real T>
struct LeadLine {
  T theta_start;
  T x_end, psi_end;  // where it meets the share [rad, Wb]
  T slope;           // of flux at full voltage [Wb/rad]
  bool braking;

  /// Least flux at theta, in the frame of positive torque, in which a braking rotor turns towards
  /// smaller angles; 0 where the share decides.
  constexpr T flux(T theta) const {
    const T past = braking ? theta_start - theta : theta - theta_start;
    const T x = wrap(past + pi<T>) - pi<T>;
    return x < x_end ? max(psi_end - slope * (x_end - x), T(0)) : T(0);
  }
};

template <Real T>
struct FluxLead {
  LeadLines<T> motoring, braking;
  T tau_max;    // last torque of the tables [N m]
  T reach_max;  // last angle per flux, 1/s, of the tables [rad/Wb]
  T drop;       // of the resistance at the greatest current of tau_max [V]
  SRM_FIELDS(motoring, braking, tau_max, reach_max, drop)

  /// True where, by that table, the mean is off without feedback; motoring, without a lead too.
  constexpr bool is_short(T u_dc, T tau, T omega_e, bool brakes) const {
    const LeadLines<T>& lines = brakes ? braking : motoring;
    if (!(omega_e > u_dc * lines.reach_least)) return false;
    return omega_e > u_dc * interpolate(lines.reach, tau / tau_max);
  }

  /// The line for a torque tau > 0. Its slope has a reserve of 3 % of the voltage. The resistance
  /// takes what the torque needs, not what the phase has: a phase with too much current would
  /// otherwise lead more, and get more.
  constexpr LeadLine<T> line(T u_dc, T tau, T omega_e, bool brakes) const {
    constexpr int last = LeadLines<T>::points - 1;
    const LeadLines<T>& lines = brakes ? braking : motoring;
    const T part = clamp(tau / tau_max, T(0), T(1));
    const T slope = (T(0.97) * u_dc - drop * sqrt(part)) / omega_e;
    if (!(slope * reach_max > T(0))) return {T(0), -two_pi<T>, T(0), T(0), brakes};
    const T row = clamp(T(1) / (slope * reach_max), T(0), T(1)) * T(last);
    const T column = part * T(last);
    return {lines.theta_start, between(lines.x_end, row, column),
            between(lines.psi_end, row, column), slope, brakes};
  }

 private:
  static constexpr int points = LeadLines<T>::points;

  static constexpr T between(const std::array<T, points * points>& table, T row, T column) {
    const int j = row < T(points - 1) ? static_cast<int>(row) : points - 2;
    const int k = column < T(points - 1) ? static_cast<int>(column) : points - 2;
    const T a = row - static_cast<T>(j), b = column - static_cast<T>(k);
    const T* const low = table.data() + j * points + k;
    const T* const high = low + points;
    return (T(1) - a) * ((T(1) - b) * low[0] + b * low[1]) +
           a * ((T(1) - b) * high[0] + b * high[1]);
  }
};

}  // namespace srm
