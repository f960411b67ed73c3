// A control law that learns the machine it drives.
//
// A machine whose flux linkage is k psi_map(b i, theta) is the believed one in other units: with
//
//   i' = b i,  psi' = psi/k,  u' = u/k,  tau' = tau b/k,  R' = R/(k b)
//
// voltage, torque and power obey the same equations. So the law stays as it is, with its tables,
// and is told what the believed machine would show: it is given i', u_dc' and tau_ref', and works
// with R' and a current limit in the same units.
//
// What the inductance of the unaligned position has beyond this likeness makes no torque. It is
// there while a phase builds up, and not where the iron saturates: the law's machine has half of it
// in addition, at every angle: all of it costs ripple where the belief is high in saturation, none
// of it where the belief is low.
//
// Where the phases couple, the iron that they share scales with the rest: the pairs of the believed
// machine are those of the other one in these units. The law knows the phases alone, and is asked
// for what the pairs leave for them.
//
// For laws whose orders are those of timers: what a comparator did is not known.
#pragma once

#include "srm/control/frame/stroke_fit.hpp"
#include "srm/machine/with_inductance.hpp"

namespace srm {

/// The machine of the law is one WithInductance, of 0 H as believed.
template <ControlLaw Law>
struct Learning {
  using Scalar = typename Law::Scalar;
  using T = Scalar;
  static constexpr int n_phases = Law::n_phases;

  Law law;
  StrokeFit<T> fit;
  Coupling<T> pairs;  // as believed; by default none
  // How the cost of a turn-on that makes the wanted frequency grows: its powers of torque and
  // voltage, where the law has one [1].
  T w_sw_torque, w_sw_voltage;
  SRM_FIELDS(law, fit, pairs, w_sw_torque, w_sw_voltage)

  struct State {
    typename Law::State law;
    typename StrokeFit<T>::template State<n_phases> fit;
    Law alike{};               // the law in the units of the believed machine, and these units:
    T i_unit{}, psi_unit_1{};  // b and 1/k [1]; 0: not made yet
    typename StrokeFit<T>::template Neighbours<n_phases> others;
  };

  /// couples: false where there are never pairs.
  template <bool couples = true>
  Command<T, n_phases> step(State& x, const Measurement<T, n_phases>& y, T tau_ref) const {
    const bool moved =
        fit.template observe<couples>(x.fit, x.others, law.machine.map, pairs, law.R, y);
    if (moved || !(x.i_unit > T(0))) make_alike(x);
    Measurement<T, n_phases> seen = y;
    for (T& i : seen.i) i = i * x.i_unit;
    seen.u_dc = y.u_dc * x.psi_unit_1;
    T asked = tau_ref * x.i_unit * x.psi_unit_1;
    if (couples && pairs.any()) asked = pairs.left_for_phases(asked, seen.i, y.theta_e);
    const Command<T, n_phases> orders = x.alike.step(x.law, seen, asked);
    fit.template remember<n_phases>(x.fit, orders);
    return orders;
  }

  static constexpr const Learned<T>& learned(const State& x) { return x.fit.learned; }

 private:
  /// The law for what is learned by now.
  [[gnu::noinline, gnu::cold]] void make_alike(State& x) const {
    const Learned<T>& learned = x.fit.learned;
    x.psi_unit_1 = T(1) / learned.saturated;
    x.i_unit = learned.aligned * x.psi_unit_1;
    x.alike = law;
    x.alike.machine.L_more = T(0.5) * fit.L_u * (learned.unaligned / learned.aligned - T(1));
    x.alike.R = law.R * learned.R / learned.aligned;
    x.alike.i_max = law.i_max * x.i_unit;
    if constexpr (requires { x.alike.w_sw; }) {
      const T power = w_sw_torque * log_near_one(x.i_unit * x.psi_unit_1) +
                      w_sw_voltage * log_near_one(x.psi_unit_1);
      x.alike.w_sw = law.w_sw * exp(power);
    }
  }

  /// ln x for x within 0.4 and 2.5, to 0.1 %.
  static constexpr T log_near_one(T x) {
    const T z = (x - T(1)) / (x + T(1)), s = z * z;
    return T(2) * z * (T(1) + s * (T(1.0 / 3) + s * (T(0.2) + s * T(1.0 / 7))));
  }
};

}  // namespace srm
