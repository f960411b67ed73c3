// The follower of a predictive law: each phase to the flux linkage of the reference profile by the
// end of the sample, on its own, and the mean torque by feedback (mean_torque_feedback.hpp).
//
// Where the voltage cannot hold the torque, a law that looks at the torque of the next samples
// delays the fall of a phase's flux to win torque now. What is left of it past alignment brakes,
// more torque is short, and no voltage is left to recover. A phase that follows the profile by
// itself always comes back: where it is late, the voltage that the profile leaves closes the gap,
// and where the profile falls with all of the voltage, magnetizing closes it at twice that rate.
//
// A phase keeps its level while it stays near the profile. Otherwise one edge inside the sample,
// between the two levels around the voltage that is needed, takes it there (dead-beat). The sample
// begins with the level of these two that the last one ended with, if it is one of them.
#pragma once

#include <array>

#include "srm/control/part/mean_torque_feedback.hpp"
#include "srm/control/part/prediction.hpp"

namespace srm {

/// The predicted torque of all phases [N m].
template <Real T, std::size_t N>
T torque_of(const std::array<PhasePrediction<T>, N>& phases) {
  T tau = T(0);
  for (const PhasePrediction<T>& p : phases) tau = tau + p.tau;
  return tau;
}

template <Real T, int N>
struct ProfileFollower {
  T R;      // phase resistance [ohm]
  T i_max;  // current limit [A]
  T T_s;    // control period [s]

  /// The legs that follow; leg: those that are ordered already; near: a deviation at the end of the
  /// sample that needs no edge [Wb].
  [[gnu::noinline, gnu::cold]] void follow(const std::array<PhasePrediction<T>, N>& phases, T near,
                                           T u_dc, Command<T, N>& command) const {
    for (int k = 0; k < N; ++k) {
      command[k] = order(phases[k], command[k].leg.back(), near, u_dc);
    }
  }

 private:
  PhaseCommand<T> order(const PhasePrediction<T>& x, Leg last, T near, T u_dc) const {
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
};

}  // namespace srm
