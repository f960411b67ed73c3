// Flux linkages brought to the guide by the end of the sample, each phase on its own.
//
// Where the guide takes nearly all of the voltage, flux linkage that a phase lacks cannot be built
// up again as long as it takes, and flux linkage left past alignment brakes: a law that looks at
// the torque of the next samples delays the fall of the flux to win torque now, and loses more of
// it for a period. A phase that follows the guide by itself always comes back to it: where it is
// late, the voltage that the guide leaves closes the gap, and where the guide falls with all of the
// voltage, magnetizing closes it at twice that rate. The torque then is the guide's.
//
// A phase keeps its level while it stays near the guide. Otherwise one edge inside the sample,
// between the two levels around the voltage that is needed, takes it there (dead-beat). The sample
// begins with the level of these two that the last one ended with, if it is one of them.
#pragma once

#include "srm/control/part/outlook.hpp"

namespace srm {

/// Orders for one phase. near: deviation at the sample's end that needs no edge [Wb].
template <Real T>
PhaseCommand<T> track(const PhaseOutlook<T>& x, Leg last, T near, T u_dc, T R, T i_max, T T_s) {
  const T missing = max(x.goal + x.goal_rate * T_s, T(0)) - x.psi;
  const bool over = x.i > i_max;
  const int level = static_cast<int>(last);
  if (!(over && level > 0) && abs(x.rate(level, u_dc, R) * T_s - missing) <= near) {
    return hold<T>(last);
  }
  const T i = max(x.i + (x.i_drift * T_s + x.i_gain * missing) / T(2), T(0));  // halfway
  const T wanted = clamp((missing / T_s + R * i - x.bias) / u_dc, T(-1), over ? T(0) : T(1));
  const int low = wanted < T(0) ? -1 : 0;
  const T high_part = wanted - static_cast<T>(low);  // of the sample
  const bool high_first = level > low;
  const Leg first = static_cast<Leg>(high_first ? low + 1 : low);
  const Leg second = static_cast<Leg>(high_first ? low : low + 1);
  const T t = T_s * (high_first ? high_part : T(1) - high_part);
  if (!(t > T(0))) return hold<T>(second);
  PhaseCommand<T> c = hold<T>(t < T_s ? second : first);
  if (t < T_s) {
    c.leg[0] = first;
    c.t_edge[0] = t;
  }
  return c;
}

}  // namespace srm
