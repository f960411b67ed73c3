// The profiles that a predictive law follows, over torque, angle and speed.
//
// A profile depends on speed and dc link through (u_dc - R i)/omega, what the flux linkage can rise
// in a radian. So profiles for several speeds at one dc-link voltage serve every voltage u, at the
// speed omega (u_dc - drop)/(u - drop). drop is R i at the peak, where the voltage is shortest; it
// grows about as the square root of the torque.
//
// Between two speeds the profiles are blended linearly in 1/omega. With psi' <= u/omega_1 and psi'
// <= u/omega_2 the blend of weight w has psi' <= u ((1 - w)/omega_1 + w/omega_2), which is u/omega:
// two profiles within the voltage give one within the voltage. Below the first speed its profiles
// serve: what the voltage allows at one speed it allows at all lower ones.
#pragma once

#include <cstdint>

#include "srm/base/fields.hpp"
#include "srm/base/table.hpp"

namespace srm {

template <Real T>
struct ReferenceProfile;

/// The guide at one torque and speed.
template <Real T>
struct Profile {
  AngleRow<T> row;            // at the next lower speed
  const T* faster = nullptr;  // values at the next higher one; none: the lower one serves alone
  T weight{};                 // of the higher one [1]
  int speed = 0;              // index of the lower one
  const ReferenceProfile<T>* coupled = nullptr;  // the guide, where phases couple

  T at(T theta_e) const {
    const T slow = row.at(theta_e);
    if (!faster) return slow;
    const T fast = AngleRow<T>{faster, row.columns, row.weight}.at(theta_e);
    return slow + weight * (fast - slow);
  }

  /// That of phase k, at a torque of one sense or of the other.
  Profile of_phase(int k, bool other_sense) const;

  /// What neighbouring phases add to the value; 0 where they do not couple.
  T mutual_at(T theta_e) const;

  /// The value here of a number that the law has for each of the guide's speeds.
  T of(const View<T>& per_speed) const {
    const T slow = per_speed[speed];
    return faster ? slow + weight * (per_speed[speed + 1] - slow) : slow;
  }

 private:
  Profile with_row(const T* values) const {
    Profile other = *this;
    other.row.values = values;
    if (faster) other.faster = values + (faster - row.values);
    return other;
  }
};

template <Real T>
struct ReferenceProfile {
  AngleTable<T> first;  // of the lowest speed; those of the others lie behind it
  View<T> omega;        // speeds, increasing [rad/s]
  T u_dc{};             // dc-link voltage of the profiles [V]
  T drop{};             // of the resistance at the peak of the highest torque [V]
  // Where phases couple: the flux linkage that neighbours add, in the order of the values; else
  // empty [Wb].
  View<T> mutual{};
  // Where their neighbours differ, all of this stands for each phase in turn, and may stand again
  // for phases in reverse order. (n_phases): which one a phase has at a torque of the other sense;
  // else empty.
  View<std::uint8_t> mirrored{};
  SRM_FIELDS(first, omega, u_dc, drop, mutual, mirrored)

  Profile<T> at(T torque, T omega_m, T u_dc_now) const {
    Profile<T> p{first.at(torque)};
    if (mutual.size > 0) p.coupled = this;
    if (omega.size < 2) return p;
    const T lost = drop * sqrt(clamp(torque / first.level_max, T(0), T(1)));
    const T left = max(u_dc_now - lost, u_dc / T(100));
    const T same = abs(omega_m) * (u_dc - lost) / left;  // speed with u_dc
    if (!(same > omega[0])) return p;
    while (p.speed < omega.size - 2 && same > omega[p.speed + 1]) ++p.speed;
    const T slower = omega[p.speed], faster = omega[p.speed + 1];
    const int size = first.rows * first.columns;
    p.row.values += p.speed * size;
    p.faster = p.row.values + size;
    p.weight = same < faster ? faster / same * (same - slower) / (faster - slower) : T(1);
    return p;
  }
};

template <Real T>
T Profile<T>::mutual_at(T theta_e) const {
  if (!coupled) return T(0);
  return with_row(coupled->mutual.data + (row.values - coupled->first.values.data)).at(theta_e);
}

template <Real T>
Profile<T> Profile<T>::of_phase(int k, bool other_sense) const {
  if (!coupled || coupled->mirrored.size == 0) return *this;
  const ReferenceProfile<T>& guide = *coupled;
  const int set = other_sense ? guide.mirrored[k] : k;
  return with_row(row.values + set * guide.omega.size * guide.first.rows * guide.first.columns);
}

}  // namespace srm
