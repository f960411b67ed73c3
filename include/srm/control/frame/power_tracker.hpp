// Maximum power point tracking: where the voltage reference of an array goes next.
//
// Perturb and observe: on in the same direction while the power rises. Incremental conductance: up
// while di/du > -i/u, left of the maximum, and down right of it. T. Esram, P. L. Chapman, IEEE
// Trans. Energy Convers. 22(2), 2007.
#pragma once

#include <cstdint>

#include "srm/base/fields.hpp"
#include "srm/base/real.hpp"

namespace srm {

enum class Tracking : std::int8_t { constant, perturb_observe, incremental_conductance };

template <Real T>
struct PowerTracker {
  Tracking method;
  T u_start;       // reference before the first step [V]
  T u_min, u_max;  // of the reference [V]
  T step;          // [V]
  SRM_FIELDS(method, u_start, u_min, u_max, step)

  struct State {
    T u_ref{};            // [V]
    T u{}, i{}, p{};      // means before the last step
    T direction = T(-1);  // of the last step: from the open-circuit voltage down
    bool has_last = false;
  };

  constexpr void start(State& x) const {
    x = {};
    x.u_ref = u_start;
  }

  /// Means of voltage [V], current [A] and power [W] since the last step.
  constexpr void advance(State& x, T u, T i, T p) const {
    if (method == Tracking::constant) return;
    if (x.has_last) x.direction = next(x, u, i, p);
    x.u = u;
    x.i = i;
    x.p = p;
    x.has_last = true;
    const T wanted = x.u_ref + x.direction * step;
    x.u_ref = clamp(wanted, u_min, u_max);
    if (x.u_ref != wanted) x.direction = -x.direction;  // at a limit the only way is back
  }

 private:
  constexpr T next(const State& x, T u, T i, T p) const {
    if (method == Tracking::perturb_observe) return p < x.p ? -x.direction : x.direction;
    const T du = u - x.u, di = i - x.i;
    if (abs(du) < T(0.1) * step) return di > T(0) ? T(1) : T(-1);  // the light changed
    // di/du + i/u > 0, without divisions
    const T rise = (di * u + i * du) * du;
    return rise > T(0) ? T(1) : T(-1);
  }
};

}  // namespace srm
