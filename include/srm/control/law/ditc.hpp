// Direct instantaneous torque control (DITC): the torque itself is compared, and picks the legs.
//
// R. B. Inderka, R. W. De Doncker, "DITC - direct instantaneous torque control of switched
// reluctance drives", IEEE Trans. Ind. Appl. 39(4), 2003. One phase in charge holds the inner band
// by soft chopping. In commutation the incoming phase is magnetized first; the outgoing one fills
// or removes what is left. The table is our reading of that rule:
//
//   torque             below outer   below inner   within     above inner   above outer
//   single phase       magnetize     magnetize     keep (1)   freewheel     demagnetize
//   incoming phase     magnetize     magnetize     magnetize  keep          freewheel
//   outgoing phase     magnetize     freewheel     keep       demagnetize   demagnetize
//
// (1) but a demagnetizing phase freewheels once the torque is back within. Phases outside their
// window demagnetize; one above i_max is not magnetized.
//
// At other torques and speeds than those that the window is made for it opens as early as flux
// needs to be built up (turn_on.hpp), and the mean is held by feedback (mean_hold.hpp): incoming
// phases push the torque to the upper end of the band, and above base speed the voltage is short.
// Where that asks for more than twice the torque the whole window magnetizes, and it is entered
// earlier.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/mean_hold.hpp"
#include "srm/control/part/mirror.hpp"
#include "srm/control/part/per_phase.hpp"
#include "srm/control/part/turn_on.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

enum class Role : std::int8_t { single, incoming, outgoing };

template <Real T>
struct TorqueBands {
  T inner, outer;  // half widths, inner <= outer [N m]
  SRM_FIELDS(inner, outer)

  /// The rule table. excess = torque - reference; last: this phase's leg in the sample before.
  constexpr Leg leg(Role role, T excess, Leg last) const {
    switch (role) {
      case Role::single:
        if (excess < -inner) return Leg::magnetize;
        if (excess > outer) return Leg::demagnetize;
        if (excess > inner) return Leg::freewheel;
        return last == Leg::demagnetize ? Leg::freewheel : last;
      case Role::incoming:
        if (excess > outer) return Leg::freewheel;
        return excess > inner ? last : Leg::magnetize;
      case Role::outgoing:
        if (excess < -outer) return Leg::magnetize;
        if (excess < -inner) return Leg::freewheel;
        return excess > inner ? Leg::demagnetize : last;
    }
    return Leg::demagnetize;
  }
};

template <Machine M, int N>
struct Ditc {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  static constexpr int n_phases = N;
  struct State {
    std::array<Leg, N> leg{};
    MeanHold<T> mean;
  };

  M machine;
  Conduction<T> conduction;  // the dwell is at least a stroke
  TurnOn<T> turn_on;
  TorqueBands<T> bands;
  T i_max;  // [A]
  T T_s;    // control period [s]
  SRM_FIELDS(machine, conduction, turn_on, bands, i_max, T_s)

  constexpr Command<T, N> step(State& x, const Measurement<T, N>& y, T tau_ref) const {
    const bool braking = brakes(y.omega_m, tau_ref);  // the window is entered at its far end
    const bool leads = turn_on.leads(abs(tau_ref), y.omega_m);
    Window<T> window = conduction.template window<N>(y.omega_m, tau_ref);
    if (leads && !(abs(y.omega_m) < conduction.omega_start)) {
      const T omega_e = static_cast<T>(machine.N_r) * y.omega_m;
      const T more = max(x.mean.part[braking ? 1 : 0], T(1));
      window = turn_on.ahead(window, abs(tau_ref), omega_e, y.u_dc, more, braking);
    }
    const T dwell = wrap(window.theta_off - window.theta_on);
    std::array<T, N> past_on{};  // angle since turn-on; the newest phase has the least
    T newest = dwell;
    T excess = leads ? T(0) : -abs(tau_ref);
    int active = 0;
    for (int k = 0; k < N; ++k) {
      const T theta = drive_angle<N>(y.theta_e, k, tau_ref);
      past_on[k] = wrap(braking ? window.theta_off - theta : theta - window.theta_on);
      if (past_on[k] < dwell) ++active;
      newest = min(newest, past_on[k]);
      if (y.i[k] > T(0)) excess = excess + machine.at(y.i[k], theta).tau;
    }
    if (leads) excess = excess - asked(x, y, excess, tau_ref, braking);
    return per_phase<T, N>([&](int k) {
      Leg leg = Leg::demagnetize;
      if (past_on[k] < dwell && tau_ref != T(0)) {
        const Role role = active == 1            ? Role::single
                          : past_on[k] == newest ? Role::incoming
                                                 : Role::outgoing;
        leg = bands.leg(role, excess, x.leg[k]);
        if (leg == Leg::magnetize && y.i[k] > i_max) leg = Leg::freewheel;
      }
      x.leg[k] = leg;
      return hold<T>(leg);
    });
  }

 private:
  [[gnu::noinline, gnu::cold]] constexpr T asked(State& x, const Measurement<T, N>& y, T given,
                                                 T tau_ref, bool braking) const {
    const T turn = static_cast<T>(machine.N_r) * y.omega_m * T_s;
    return x.mean.asked(abs(tau_ref), given, turn, braking);
  }
};

}  // namespace srm
