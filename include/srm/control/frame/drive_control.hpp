// The whole controller: angle tracker, speed or voltage loop or torque reference, the control law,
// its comparators where the board has none, and what makes up for the converter's dead time.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/frame/angle_tracker.hpp"
#include "srm/control/frame/comparator.hpp"
#include "srm/control/frame/dead_time_compensation.hpp"
#include "srm/control/frame/edge_limits.hpp"
#include "srm/control/frame/interface.hpp"
#include "srm/control/frame/pv_control.hpp"
#include "srm/control/frame/speed_pi.hpp"
#include "srm/control/frame/speed_ramp.hpp"
#include "srm/control/frame/user_limits.hpp"

namespace srm {

/// What the reference means. none: the law has a current of its own, and the reference only says
/// 1 to motor, -1 to brake, 0 off. pv: as fast as the array allows, up to the reference.
enum class Outer : std::int8_t { torque, speed, none, pv };

/// Where angle and speed come from: as measured, or tracked on the measured angle.
enum class Motion : std::int8_t { measured, tracked };

/// What holds the load torque in the speed loop: the integral, or the observer's estimate.
enum class LoadTorque : std::int8_t { integral, observer };

/// What a controller uses; what it does not is left out of a target's code.
struct Uses {
  bool pv = true, speed = true, observer = true;
};

/// What may be another one from step to step (firmware: parameters at run time).
template <Real T>
struct Tuning {
  SpeedPi<T> speed;
  SpeedRamp<T> ramp;
  UserLimits<T> limits;
};

template <ControlLaw Law>
struct DriveControl {
  using Scalar = typename Law::Scalar;
  using T = Scalar;
  static constexpr int n_phases = Law::n_phases;

  Law law;
  Outer outer;
  SpeedPi<T> speed;   // used with Outer::speed and pv
  SpeedRamp<T> ramp;  // used with Outer::speed
  LoadTorque load;    // used with Outer::speed
  PvControl<T> pv;    // used with Outer::pv
  Motion motion;
  AngleTracker<T> tracker;  // used with Motion::tracked and LoadTorque::observer
  int delay;                // samples from measurement to effect, 0 or 1
  Comparators comparators;
  T t_dead;  // of the converter: dead_time_compensation.hpp [s]
  EdgeLimits<T> edges;
  T u_brake_full, u_brake_none;  // braking torque: all of it up to, none from this dc voltage [V]
  UserLimits<T> limits;
  SRM_FIELDS(law, outer, speed, ramp, load, pv, motion, tracker, delay, comparators, t_dead, edges,
             u_brake_full, u_brake_none, limits)

  struct State {
    typename Law::State law;
    typename SpeedPi<T>::State speed;
    typename SpeedRamp<T>::State ramp;
    typename PvControl<T>::template State<n_phases> pv;
    typename AngleTracker<T>::State tracker;
    T tau_ref{};     // the torque reference of the last step; 0 where there is none [N m]
    T tau_before{};  // and of the one before it [N m]
    std::array<Leg, n_phases> leg = all_demagnetized<n_phases>();  // ordered last
  };

  /// What these parameters use.
  constexpr Uses uses() const {
    return {.pv = outer == Outer::pv,
            .speed = outer == Outer::speed,
            .observer = motion == Motion::tracked || load == LoadTorque::observer};
  }

  constexpr Tuning<T> tuning() const { return {speed, ramp, limits}; }

  /// reference: as `outer` says; torque [N m] or speed [rad/s].
  template <Uses used = Uses{}>
  Command<T, n_phases> step(State& state, const Measurement<T, n_phases>& y, T reference) const {
    return step<used>(state, y, reference, tuning());
  }

  /// The same with another tuning than the one that it was built with.
  template <Uses used = Uses{}>
  Command<T, n_phases> step(State& state, Measurement<T, n_phases> y, T reference,
                            const Tuning<T>& tuned) const {
    for (T& i : y.i) i = max(i, T(0));  // noise and offset: a phase current is never negative
    if constexpr (used.observer) {
      follow(state, y, delay > 0 ? state.tau_before : state.tau_ref);
    }
    if (motion == Motion::tracked) y.theta_e = state.tracker.theta_e;
    const T asked = folded(asked_torque<used>(state, y, reference, tuned), y);
    if constexpr (used.observer) state.tau_before = state.tau_ref;
    state.tau_ref = outer == Outer::none ? T(0) : asked;
    Command<T, n_phases> orders = law.step(state.law, y, asked);
    tuned.limits.template apply<n_phases>(orders, y, comparators);
    if (comparators == Comparators::sampled) compare_now<T, n_phases>(orders, y, state.leg);
    if constexpr (used.pv) {
      if (outer == Outer::pv) pv.template remember<n_phases>(state.pv, y, orders);
    }
    if (t_dead > T(0)) lead_turn_on<T, n_phases>(orders, t_dead);
    if (edges.any()) {
      for (PhaseCommand<T>& order : orders) edges.apply(order);
    }
    return orders;
  }

  /// The observer goes on, also while the law does not run. tau: torque since the last sample [N
  /// m]. The speed in y becomes the one that control and protection use.
  void follow(State& state, Measurement<T, n_phases>& y, T tau) const {
    if (motion == Motion::tracked) {
      tracker.step(state.tracker, y.theta_e, tau);
      y.omega_m = tracker.omega_m(state.tracker);
    } else if (load == LoadTorque::observer) {
      if (state.tracker.found) {
        tracker.step(state.tracker, y.theta_e, tau);
      } else {
        tracker.start(state.tracker, y.theta_e, y.omega_m);
      }
    }
  }

 private:
  /// Braking feeds the dc link: less of it, the higher the voltage already is.
  constexpr T folded(T asked, const Measurement<T, n_phases>& y) const {
    if (!(y.u_dc > u_brake_full && asked * y.omega_m < T(0))) return asked;
    return asked * clamp((u_brake_none - y.u_dc) / (u_brake_none - u_brake_full), T(0), T(1));
  }

  template <Uses used>
  T asked_torque(State& state, const Measurement<T, n_phases>& y, T reference,
                 const Tuning<T>& tuned) const {
    if constexpr (used.pv) {
      if (outer == Outer::pv) {
        return pv.step(state.pv, y, limited(tuned), state.speed, reference);
      }
    }
    if constexpr (used.speed) {
      if (outer == Outer::speed) return speed_torque(state, y.omega_m, reference, tuned);
    }
    return outer == Outer::none ? reference : tuned.limits.cut(reference);
  }

  /// The speed loop within the limit of the torque, so that its integral stops there.
  static constexpr SpeedPi<T> limited(const Tuning<T>& tuned) {
    SpeedPi<T> loop = tuned.speed;
    loop.tau_min = max(loop.tau_min, -tuned.limits.tau);
    loop.tau_max = min(loop.tau_max, tuned.limits.tau);
    return loop;
  }

  T speed_torque(State& x, T omega_m, T omega_asked, const Tuning<T>& tuned) const {
    const bool observed = load == LoadTorque::observer;
    if (observed && !x.tracker.found) x.ramp.running = false;  // the speed is not known yet
    const T tau_load = observed ? x.tracker.tau_load : x.speed.tau_integral;
    SpeedRamp<T> rises = tuned.ramp;
    rises.tau = min(rises.tau, ramp_part * tuned.limits.tau);
    const T tau_ramp = rises.step(x.ramp, omega_asked, omega_m, tau_load);
    const T tau_ahead = observed ? tau_ramp + tau_load : tau_ramp;
    return limited(tuned).step(x.speed, x.ramp.omega_ref, omega_m, tau_ahead);
  }

  static constexpr T ramp_part = T(0.95);  // of the torque limit: the rest holds the speed
};

}  // namespace srm
