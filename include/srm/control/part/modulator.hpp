// From duty cycle to switching instants: centre-aligned PWM with soft switching.
//
// A period holds one pulse of the active leg, +u_dc or -u_dc, and freewheels for the rest; so the
// mean winding voltage is duty * u_dc and each period turns each switch on at most once. D. G.
// Holmes, T. A. Lipo, Pulse Width Modulation for Power Converters, Wiley 2003, ch. 3 and 6.
#pragma once

#include "srm/control/interface/interface.hpp"

namespace srm {

/// Where the pulses of the phases lie: all at mid-period, or spread over it.
enum class Carriers : std::int8_t { in_phase, interleaved };

/// Centre of the pulse of phase k, as a fraction of the period.
template <int N, Real T>
constexpr T pulse_centre(Carriers carriers, int k) {
  if (carriers == Carriers::in_phase) return T(0.5);
  return (static_cast<T>(k) + T(0.5)) / T(N);
}

/// duty in [-1, 1], held there. A pulse that passes the end of the period goes on at its start.
template <Real T>
constexpr PhaseCommand<T> modulate(T duty, T T_s, T centre = T(0.5)) {
  const Leg active = duty < T(0) ? Leg::demagnetize : Leg::magnetize;
  const T width = clamp(abs(duty), T(0), T(1));
  if (width <= T(0)) return hold<T>(Leg::freewheel);
  if (width >= T(1)) return hold<T>(active);
  const T start = centre - width / T(2);
  const T end = centre + width / T(2);
  if (start < T(0)) return pulse(active, Leg::freewheel, end * T_s, (start + T(1)) * T_s);
  if (end > T(1)) return pulse(active, Leg::freewheel, (end - T(1)) * T_s, start * T_s);
  return pulse(Leg::freewheel, active, start * T_s, end * T_s);
}

}  // namespace srm
