// What the next sample brings: torque and flux linkage of every phase as straight lines in time.
//
// Within a sample the flux linkage is linear in the leg voltage, dpsi/dt = u - R i, whatever the
// iron does, and torque is nearly linear in the flux linkage. So the prediction needs three numbers
// a phase: torque at the start, its gain dtau/dpsi = (dpsi/dtheta)/(dpsi/di), and its drift while
// the guide is followed. Gain and drift are secants to the point where the guide leads, which is
// exact to second order along the way that the phase will take.
//
// One sample of delay is bridged by the same flux linkage equation with the legs that are already
// ordered. P. Cortes, J. Rodriguez, C. Silva, A. Flores, "Delay compensation in model predictive
// current control of a three-phase inverter", IEEE Trans. Ind. Electron. 59(2), 2012.
#pragma once

#include "srm/control/interface/interface.hpp"
#include "srm/control/part/reference_profile.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

/// One phase at the start of the sample that the orders will act in. Angles are mirrored for a
/// negative torque reference, so that torque is positive on (0, pi).
template <Real T>
struct PhasePrediction {
  T psi;        // flux linkage [Wb]
  T i;          // current [A]
  T tau;        // torque [N m]
  T gain;       // dtau/dpsi [N m/Wb]
  T drift;      // dtau/dt at constant flux linkage [N m/s]
  T goal;       // the guide's flux linkage [Wb]
  T goal_rate;  // its slope: the voltage across the winding without R i [V]
  T i_gain;     // di/dpsi [1/H]
  T i_drift;    // di/dt at constant flux linkage [A/s]
  bool idle;    // the guide wants no current here
  T bias{};     // voltage that the model misses [V]

  /// Slope of the flux linkage. A phase without current stays there: the diodes block.
  T rate(int level, T u_dc, T R) const {
    if (level <= 0 && !(psi > T(0))) return T(0);
    return static_cast<T>(level) * u_dc - R * i + bias;
  }
};

/// Volt-seconds of a timer command over one sample, per volt of the dc link [s].
template <Real T>
T magnetizing_time(const PhaseCommand<T>& c, T T_s) {
  T sum = T(0), from = T(0);
  for (int n = 0; n <= max_edges; ++n) {
    const T to = n < max_edges ? clamp(c.t_edge[n], from, T_s) : T_s;
    sum = sum + static_cast<T>(static_cast<int>(c.leg[n])) * (to - from);
    from = to;
  }
  return sum;
}

/// What a law remembers from sample to sample.
template <Real T, int N>
struct Memory {
  Command<T, N> ordered{};        // in the sample before
  std::array<T, N> i_expected{};  // at this sample, by the prediction of the one before [A]
  std::array<T, N> bias{};        // voltage that the model misses [V]
};

template <Machine M, int N>
struct Prediction {
  using T = typename M::Scalar;

  M machine;
  Profile<T> guide;  // flux linkage over electrical angle [Wb]
  T R;               // phase resistance [ohm]
  T T_s;             // control period [s]
  int delay;         // samples from measurement to effect: 0 or 1
  T ahead;           // length of the secants [s]
  T off;             // a guide below this flux linkage wants no current [Wb]; 0: it has no say

  std::array<PhasePrediction<T>, N> at(const Measurement<T, N>& y, T tau_ref,
                                       Memory<T, N>& memory) const {
    const T sense = tau_ref < T(0) ? T(-1) : T(1);
    const T omega_e = sense * (static_cast<T>(machine.N_r) * y.omega_m);
    const T begin = static_cast<T>(delay) * T_s;
    std::array<PhasePrediction<T>, N> phases;
    for (int k = 0; k < N; ++k) {
      const T theta_k = sense * phase_angle<N>(y.theta_e, k);
      const auto angle = [&](T t) { return wrap(theta_k + omega_e * t); };
      T i = max(y.i[k], T(0));
      if (delay > 0) {
        i = carried(i, angle(T(0)), angle(begin), memory.ordered[k], y.u_dc, memory.i_expected[k],
                    memory.bias[k]);
        memory.i_expected[k] = i;
      }
      phases[k] = phase(i, angle(begin), angle(begin + ahead), sense * y.omega_m, y.u_dc);
      phases[k].bias = memory.bias[k];
    }
    return phases;
  }

 private:
  /// The current after the sample under way: flux linkage first, then the machine's curve. On the
  /// way the error of the last such prediction corrects the bias: device drops, a warm winding. A
  /// tenth of the dc link bounds it, so that a wrong flux map cannot wind it up.
  T carried(T i, T theta, T theta_end, const PhaseCommand<T>& c, T u_dc, T i_expected,
            T& bias) const {
    const T magnetized = magnetizing_time(c, T_s) * u_dc;
    if (!(i > T(0)) && !(magnetized > T(0))) {  // the diodes block
      bias = T(0);
      return T(0);
    }
    const Magnetics<T> here = machine.at(i, theta);
    if (i > T(0) && i_expected > T(0)) {
      const T missed = (i - i_expected) * here.L_inc / T_s;
      bias = clamp(bias + missed / T(8), -u_dc / T(10), u_dc / T(10));
    }
    const T driven = here.psi + magnetized + bias * T_s;
    T i_end = i;
    for (int trial = 0; trial < 2; ++trial) {
      const Magnetics<T> m = machine.at(i_end, theta_end);
      const T psi_end = max(driven - R * T_s * (i + i_end) / T(2), T(0));
      i_end = max(i_end + (psi_end - m.psi) / m.L_inc, T(0));
    }
    return i_end;
  }

  PhasePrediction<T> phase(T i, T theta, T theta_next, T omega_m, T u_dc) const {
    const T goal = guide.at(theta);
    const T goal_next = guide.at(theta_next);
    const bool idle = max(goal, goal_next) < off;
    if (idle && !(i > T(0))) {
      PhasePrediction<T> nothing{};
      nothing.idle = true;
      return nothing;
    }
    const Magnetics<T> here = machine.at(i, theta);
    // A phase without current can only be magnetized: its secant goes there. One far from the guide
    // takes all of the voltage.
    const T most = u_dc * ahead;
    const T back = goal_next - here.psi;
    T move = i > T(0) ? max(goal_next - goal, -here.psi) : most;
    if (abs(back) > most) move = back > T(0) ? most : -most;
    const T emf = i > T(0) ? omega_m * here.psi_theta : T(0);
    const T L_inverse = T(1) / here.L_inc;
    const Magnetics<T> next =
        machine.at(max(i + (move - emf * ahead) * L_inverse, T(0)), theta_next);
    const T gain = here.psi_theta * L_inverse;
    const T gain_next = next.psi_theta / next.L_inc;
    const T tau_next = next.tau + gain_next * (here.psi + move - next.psi);
    PhasePrediction<T> x;
    x.psi = here.psi;
    x.i = i;
    x.tau = here.tau;
    x.gain = i > T(0) ? (gain + gain_next) / T(2) : tau_next / move;
    x.drift = i > T(0) ? (tau_next - here.tau - x.gain * move) / ahead : T(0);
    x.goal = goal;
    x.goal_rate = (goal_next - goal) / ahead;
    x.i_gain = L_inverse;
    x.i_drift = -emf * L_inverse;
    x.idle = idle;
    return x;
  }
};

}  // namespace srm
