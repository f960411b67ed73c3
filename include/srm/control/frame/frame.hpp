// What stands around any control law: angle tracker, speed or voltage loop or torque reference
// before it; limits, sampled comparators, dead-time compensation and edge limits after it.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/frame/angle_tracker.hpp"
#include "srm/control/frame/comparator.hpp"
#include "srm/control/frame/dead_time_compensation.hpp"
#include "srm/control/frame/edge_limits.hpp"
#include "srm/control/frame/pv_control.hpp"
#include "srm/control/frame/speed_pi.hpp"
#include "srm/control/frame/speed_ramp.hpp"
#include "srm/control/frame/user_limits.hpp"
#include "srm/control/interface/interface.hpp"

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
  bool pv = true, speed = true, observer = true, pairs = true;
  bool learned_pairs = true;  // of a law that learns its machine
};

/// What may be another one from step to step (firmware: parameters at run time).
template <Real T>
struct Tuning {
  SpeedPi<T> speed;
  SpeedRamp<T> ramp;
  UserLimits<T> limits;
};

/// By default nothing but the law: a torque reference, measured angle and speed, no limits.
template <Real T>
struct Frame {
  Outer outer = Outer::torque;
  SpeedPi<T> speed{};                      // used with Outer::speed and pv
  SpeedRamp<T> ramp{};                     // used with Outer::speed
  LoadTorque load = LoadTorque::integral;  // used with Outer::speed
  PvControl<T> pv{};                       // used with Outer::pv
  Motion motion = Motion::measured;
  AngleTracker<T> tracker{};  // used with Motion::tracked and LoadTorque::observer
  int delay = 0;              // samples from measurement to effect, 0 or 1
  Comparators comparators = Comparators::analog;
  T t_dead{};  // of the converter: dead_time_compensation.hpp [s]
  EdgeLimits<T> edges{};
  // Braking torque: all of it up to, none from this dc voltage [V].
  T u_brake_full = never<T>, u_brake_none = T(2) * never<T>;
  UserLimits<T> limits{never<T>, never<T>};
  SRM_FIELDS(outer, speed, ramp, load, pv, motion, tracker, delay, comparators, t_dead, edges,
             u_brake_full, u_brake_none, limits)

  template <int N>
  struct State {
    typename SpeedPi<T>::State speed;
    typename SpeedRamp<T>::State ramp;
    typename PvControl<T>::template State<N> pv;
    typename AngleTracker<T>::State tracker;
    T tau_ref{};     // the torque reference of the last step; 0 where there is none [N m]
    T tau_before{};  // and of the one before it [N m]
    std::array<Leg, N> leg = all_demagnetized<N>();  // ordered last
  };

  /// What these parameters use.
  constexpr Uses uses() const {
    return {.pv = outer == Outer::pv,
            .speed = outer == Outer::speed,
            .observer = motion == Motion::tracked || load == LoadTorque::observer,
            .pairs = false};
  }

  constexpr Tuning<T> tuning() const { return {speed, ramp, limits}; }

  /// Before the law: the sample becomes the one that the law sees. Returns what is asked of it, a
  /// torque [N m] but with Outer::none. reference: as `outer` says; torque [N m] or speed [rad/s].
  template <Uses used, int N>
  T before(State<N>& state, Measurement<T, N>& y, T reference, const Tuning<T>& tuned) const {
    for (T& i : y.i) i = max(i, T(0));  // noise and offset: a phase current is never negative
    if constexpr (used.observer) {
      follow(state, y, delay > 0 ? state.tau_before : state.tau_ref);
    }
    if (motion == Motion::tracked) y.theta_e = state.tracker.theta_e;
    const T asked = folded(asked_torque<used>(state, y, reference, tuned), y);
    if constexpr (used.observer) state.tau_before = state.tau_ref;
    state.tau_ref = outer == Outer::none ? T(0) : asked;
    return asked;
  }

  /// After the law: its orders become those for timers and comparators. y: as the law saw it.
  template <Uses used, int N>
  void after(State<N>& state, const Measurement<T, N>& y, Command<T, N>& orders,
             const Tuning<T>& tuned) const {
    tuned.limits.template apply<N>(orders, y, comparators);
    if (comparators == Comparators::sampled) compare_now<T, N>(orders, y, state.leg);
    if constexpr (used.pv) {
      if (outer == Outer::pv) pv.template remember<N>(state.pv, y, orders);
    }
    if (t_dead > T(0)) lead_turn_on<T, N>(orders, t_dead);
    if (edges.any()) {
      for (PhaseCommand<T>& order : orders) edges.apply(order);
    }
  }

  /// The observer goes on, also while the law does not run. tau: torque since the last sample [N
  /// m]. The speed in y becomes the one that control and protection use.
  template <int N>
  void follow(State<N>& state, Measurement<T, N>& y, T tau) const {
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
  template <int N>
  constexpr T folded(T asked, const Measurement<T, N>& y) const {
    if (!(y.u_dc > u_brake_full && asked * y.omega_m < T(0))) return asked;
    return asked * clamp((u_brake_none - y.u_dc) / (u_brake_none - u_brake_full), T(0), T(1));
  }

  template <Uses used, int N>
  T asked_torque(State<N>& state, const Measurement<T, N>& y, T reference,
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

  template <int N>
  T speed_torque(State<N>& x, T omega_m, T omega_asked, const Tuning<T>& tuned) const {
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
