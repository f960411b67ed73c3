// Proportional and integral action between limits that may move from sample to sample.
//
// The integral stays within the limits, and stops while the output is at one and the error pushes
// further (conditional integration, as in speed_pi.hpp).
#pragma once

#include "srm/base/fields.hpp"
#include "srm/base/real.hpp"

namespace srm {

template <Real T>
struct LimitedPi {
  T K_p;   // output per error
  T K_iT;  // output per error and control period
  SRM_FIELDS(K_p, K_iT)

  /// The integral is the state.
  constexpr T step(T& integral, T error, T least, T most) const {
    const T out = K_p * error + integral;
    const bool pushes_out = (out >= most && error > T(0)) || (out <= least && error < T(0));
    integral = clamp(pushes_out ? integral : integral + K_iT * error, least, most);
    return clamp(out, least, most);
  }
};

}  // namespace srm
