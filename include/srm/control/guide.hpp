// The profiles that a predictive law follows, over torque, angle and speed.
//
// A profile depends on speed and dc link through (u_dc - R i)/omega, what the flux linkage can rise
// in a radian. So profiles for several speeds at one dc-link voltage serve every voltage u, at the
// speed omega (u_dc - drop)/(u - drop). drop is R i at the peak, where the voltage is shortest.
//
// Between two speeds the profiles are blended linearly in 1/omega. With psi' <= u/omega_1 and psi'
// <= u/omega_2 the blend of weight w has psi' <= u ((1 - w)/omega_1 + w/omega_2), which is u/omega:
// two profiles within the voltage give one within the voltage. Below the first speed its profiles
// serve: what the voltage allows at one speed it allows at all lower ones.
#pragma once

#include "srm/base/table.hpp"

namespace srm {

/// Profiles over torque and angle at one speed.
template <Real T>
struct Profiles {
  AngleTable<T> table;  // of the next lower speed; that of the next higher one lies behind it
  int speed;            // index of the lower one
  T weight;             // of the higher one [1]

  T at(T torque, T theta_e) const {
    const T lower = table.at(torque, theta_e);
    if (!(weight > T(0))) return lower;
    AngleTable<T> next = table;
    next.values += table.rows * table.columns;
    return lower + weight * (next.at(torque, theta_e) - lower);
  }

  /// The value here of a number that the law has for each of the guide's speeds.
  T of(const T* per_speed) const {
    const T lower = per_speed[speed];
    return weight > T(0) ? lower + weight * (per_speed[speed + 1] - lower) : lower;
  }
};

template <Real T>
struct Guide {
  AngleTable<T> first;       // of the lowest speed; those of the others lie behind it
  const T* omega = nullptr;  // speeds, increasing [rad/s]
  int n_speeds = 0;
  T u_dc{};  // dc-link voltage of the profiles [V]
  T drop{};  // of the resistance at their peak [V]

  Profiles<T> at(T omega_m, T u_dc_now) const {
    Profiles<T> p{first, 0, T(0)};
    if (n_speeds < 2) return p;
    const T left = max(u_dc_now - drop, u_dc / T(100));
    const T speed = abs(omega_m) * (u_dc - drop) / left;
    if (!(speed > omega[0])) return p;
    while (p.speed < n_speeds - 2 && speed > omega[p.speed + 1]) ++p.speed;
    const T lower = omega[p.speed], upper = omega[p.speed + 1];
    p.table.values += p.speed * first.rows * first.columns;
    p.weight = speed < upper ? upper / speed * (speed - lower) / (upper - lower) : T(1);
    return p;
  }
};

}  // namespace srm
