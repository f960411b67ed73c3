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
// By rule a phase is turned off at a fixed angle, and turned on so early that its flux is there a
// stroke before, when its predecessor leaves (TurnOn). Feedback holds the mean torque, for incoming
// phases push the torque to the upper end of the band. Where the voltage does not suffice
// (feasible.hpp), each phase follows the flux linkage of the reference profile. The torque that is
// compared is that of all phases and of their pairs, where the machine has any.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/feasible.hpp"
#include "srm/control/part/mean_torque_feedback.hpp"
#include "srm/control/part/mirror.hpp"
#include "srm/control/part/per_phase.hpp"
#include "srm/control/part/phase_profile.hpp"
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

/// How early a phase is turned on: psi takes the angle omega_e psi/u_dc to build up.
template <Real T>
struct TurnOn {
  T tau_max;                   // torque of the last entries [N m]; 0: angles of the user
  std::array<T, 9> psi;        // motoring: flux that gives 0, tau_max/8, ... tau_max alone, a
                               // stroke before turn-off [Wb]
  std::array<T, 9> psi_brake;  // braking [Wb]
  SRM_FIELDS(tau_max, psi, psi_brake)

  /// The window for a torque: turned off as the given one, braking at its other end.
  template <int N>
  constexpr Window<T> window(Window<T> given, T tau, T omega_e, T u_dc, bool braking) const {
    if (!(tau_max > T(0))) return given;
    constexpr T stroke = two_pi<T> / T(N);
    const T lead = abs(omega_e) * interpolate(braking ? psi_brake : psi, tau / tau_max) / u_dc;
    if (braking) return {given.theta_on, given.theta_on + stroke + lead};
    return {given.theta_off - stroke - lead, given.theta_off};
  }
};

template <Machine M, int N>
struct Ditc {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  static constexpr int n_phases = N;
  struct State {
    std::array<Leg, N> leg{};
    MeanTorqueFeedback<T> mean;
  };

  M machine;
  Conduction<T> conduction;  // the dwell is at least a stroke
  TurnOn<T> turn_on;
  TorqueBands<T> bands;
  Feasible<T> feasible;
  ReferenceProfile<T> guide;  // flux linkage where the voltage does not suffice for the window [Wb]
  T psi_band;                 // about it a leg is kept, half width [Wb]
  T R;                        // phase resistance [ohm]
  T i_max;                    // [A]
  T T_s;                      // control period [s]
  SRM_FIELDS(machine, conduction, turn_on, bands, feasible, guide, psi_band, R, i_max, T_s)

  constexpr Command<T, N> step(State& x, const Measurement<T, N>& y, T tau_ref) const {
    const bool braking = brakes(y.omega_m, tau_ref);  // the window is entered at its far end
    const T omega_e = static_cast<T>(machine.N_r) * y.omega_m;
    std::array<Magnetics<T>, N> now{};
    T given = T(0);
    for (int k = 0; k < N; ++k) {
      if (!(y.i[k] > T(0))) continue;
      now[k] = machine.at(y.i[k], drive_angle<N>(y.theta_e, k, tau_ref));
      given = given + now[k].tau;
    }
    if constexpr (has_pairs<M>) given = given + pair_torque(machine, y, tau_ref);
    const T asked =
        x.mean.asked(abs(tau_ref), given, omega_e * T_s, braking, guide.first.level_max);
    if (!feasible.at(abs(tau_ref), abs(omega_e), y.u_dc, braking)) {
      follow(x, y, now, asked, tau_ref);
    } else {
      control_torque(x, y, given - asked, tau_ref);
    }
    return per_phase<T, N>([&](int k) { return hold<T>(x.leg[k]); });
  }

 private:
  /// The legs of the rule table. excess: of the torque [N m].
  constexpr void control_torque(State& x, const Measurement<T, N>& y, T excess, T tau_ref) const {
    const bool braking = brakes(y.omega_m, tau_ref);
    Window<T> window = conduction.template window<N>(y.omega_m, tau_ref);
    if (!(abs(y.omega_m) < conduction.omega_start)) {
      const T omega_e = static_cast<T>(machine.N_r) * y.omega_m;
      window = turn_on.template window<N>(window, abs(tau_ref), omega_e, y.u_dc, braking);
    }
    const T dwell = wrap(window.theta_off - window.theta_on);
    std::array<T, N> past_on{};  // angle since turn-on; the newest phase has the least
    T newest = dwell;
    int active = 0;
    for (int k = 0; k < N; ++k) {
      const T theta = drive_angle<N>(y.theta_e, k, tau_ref);
      past_on[k] = wrap(braking ? window.theta_off - theta : theta - window.theta_on);
      if (past_on[k] < dwell) ++active;
      newest = min(newest, past_on[k]);
    }
    for (int k = 0; k < N; ++k) {
      Leg leg = Leg::demagnetize;
      if (past_on[k] < dwell && tau_ref != T(0)) {
        const Role role = active == 1            ? Role::single
                          : past_on[k] == newest ? Role::incoming
                                                 : Role::outgoing;
        leg = bands.leg(role, excess, x.leg[k]);
        if (leg == Leg::magnetize && y.i[k] > i_max) leg = Leg::freewheel;
      }
      x.leg[k] = leg;
    }
  }

  /// The legs that bring each phase to the reference profile by the end of the sample.
  [[gnu::noinline]] constexpr void follow(State& x, const Measurement<T, N>& y,
                                          const std::array<Magnetics<T>, N>& now, T asked,
                                          T tau_ref) const {
    const Profile<T> profile = guide.at(asked, y.omega_m, y.u_dc);
    const T turn = static_cast<T>(machine.N_r) * y.omega_m * T_s;
    for (int k = 0; k < N; ++k) {
      const T goal = followed_flux<M>(phase_profile<M>(profile, k, tau_ref),
                                      drive_angle<N>(y.theta_e, k, tau_ref),
                                      drive_angle<N>(wrap(y.theta_e + turn), k, tau_ref));
      const T i = max(y.i[k], T(0));
      const auto away = [&](Leg leg) {
        const T u = static_cast<T>(static_cast<int>(leg)) * y.u_dc - R * i;
        return abs(max(now[k].psi + u * T_s, T(0)) - goal);
      };
      const bool over = i > i_max;
      Leg best = x.leg[k] == Leg::magnetize && over ? Leg::freewheel : x.leg[k];
      if (away(best) > psi_band) {
        for (Leg leg : {Leg::demagnetize, Leg::freewheel, Leg::magnetize}) {
          if (!(leg == Leg::magnetize && over) && away(leg) < away(best)) best = leg;
        }
      }
      x.leg[k] = best;
    }
  }
};

}  // namespace srm
