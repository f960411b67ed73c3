// Control of a drive on a photovoltaic array: the dc-link voltage follows a reference that seeks
// the maximum power point, and the torque or the speed is what moves it.
//
// A speed reference draws constant power, and left of the maximum power point constant power is
// unstable: the link collapses. Voltage control is stable on both sides. Around it: a start ramp
// and a limit of the speed, torque that folds back while the voltage is low, never a negative
// torque (a capacitor cannot take the energy of braking), sleep at night, and a stop when the pump
// runs dry.
#pragma once

#include <cstdint>

#include "srm/base/fields.hpp"
#include "srm/control/frame/drawn_current.hpp"
#include "srm/control/frame/limited_pi.hpp"
#include "srm/control/frame/power_tracker.hpp"
#include "srm/control/frame/speed_pi.hpp"
#include "srm/control/frame/stroke_ripple.hpp"
#include "srm/control/frame/whole_periods.hpp"
#include "srm/control/interface/interface.hpp"

namespace srm {

/// What the voltage controller moves: the torque, or the reference of the speed loop.
enum class Actuator : std::int8_t { torque, speed };

/// Where the current of the array comes from: a sensor, or the phase currents and legs.
enum class ArrayCurrent : std::int8_t { sensor, legs };

/// dry: the pump took too little torque, and rests.
enum class PvMode : std::int8_t { asleep, running, dry };

template <Real T>
struct PvControl {
  Actuator actuator;
  ArrayCurrent current;
  LimitedPi<T> link;  // volts to newton metres, or to radians per second
  PowerTracker<T> tracker;
  WholePeriods<T> mean;
  StrokeRipple<T> ripple;
  T C;                 // of the dc link; used with ArrayCurrent::legs [F]
  int delay;           // samples from measurement to effect, 0 or 1
  T acceleration;      // of the start ramp [rad/s^2]
  T omega_lead;        // the ramp is never further ahead of the speed [rad/s]
  T u_stop, u_full;    // torque is limited to none at u_stop, to all of tau_max from u_full [V]
  T u_wake, t_wake;    // starts after so long above this voltage [V], [s]
  T p_sleep, t_sleep;  // stops after so long below this power [W], [s]
  T k_dry, omega_dry;  // dry where tau < k_dry omega^2 above this speed [N m s^2], [rad/s]
  T t_dry, t_rest;     // for so long; then the pump rests [s]
  SRM_FIELDS(actuator, current, link, tracker, mean, ripple, C, delay, acceleration, omega_lead,
             u_stop, u_full, u_wake, t_wake, p_sleep, t_sleep, k_dry, omega_dry, t_dry, t_rest)

  template <int N>
  struct State {
    PvMode mode = PvMode::asleep;
    T t{};               // asleep: above u_wake; dry: at rest [s]
    T t_low{}, t_dry{};  // running: below p_sleep, below k_dry [s]
    T link{};            // integral of the voltage controller
    T omega_ramp{};      // [rad/s]
    T tau{};             // of the last sample [N m]
    typename PowerTracker<T>::State tracker;
    typename WholePeriods<T>::State mean;
    typename StrokeRipple<T>::State ripple;
    DrawnCurrent<T, N> drawn;
  };

  /// Torque reference [N m]. omega_most: greatest speed; 0 stops the pump [rad/s].
  // noinline: inlined into the law, it doubles the code on the target.
  template <int N>
  [[gnu::noinline]] constexpr T step(State<N>& x, const Measurement<T, N>& y,
                                     const SpeedPi<T>& speed,
                                     typename SpeedPi<T>::State& speed_state, T omega_most) const {
    if (x.mode == PvMode::running) observe(x, y);
    if (x.mode != PvMode::running) {
      wait(x, y);
      speed_state = {};
      return x.tau = T(0);
    }
    const T ramp = min(x.omega_ramp + acceleration * mean.T_s, y.omega_m + omega_lead);
    x.omega_ramp = clamp(ramp, T(0), max(omega_most, T(0)));
    SpeedPi<T> limited = speed;
    limited.tau_min = T(0);
    limited.tau_max = speed.tau_max * clamp((y.u_dc - u_stop) / (u_full - u_stop), T(0), T(1));
    const T error =
        ripple.template without<N>(x.ripple, y.u_dc - x.tracker.u_ref, y.theta_e, y.omega_m);
    if (actuator == Actuator::speed) {
      const T omega_ref = link.step(x.link, error, T(0), x.omega_ramp);
      return x.tau = limited.step(speed_state, omega_ref, y.omega_m);
    }
    const T most = link.step(x.link, error, T(0), limited.tau_max);
    limited.tau_max = most;
    x.tau = limited.step(speed_state, x.omega_ramp, y.omega_m);
    if (x.tau < most) x.link = min(x.link, x.tau);  // ready for when the voltage falls
    return x.tau;
  }

  /// What the next sample needs of this one's orders.
  template <int N>
  constexpr void remember(State<N>& x, const Measurement<T, N>& y,
                          const Command<T, N>& orders) const {
    if (current == ArrayCurrent::legs) x.drawn.remember(y, orders, mean.T_s, delay);
  }

 private:
  template <int N>
  constexpr void wait(State<N>& x, const Measurement<T, N>& y) const {
    const bool counts = x.mode == PvMode::dry || y.u_dc > u_wake;
    x.t = counts ? x.t + mean.T_s : T(0);
    if (x.t < (x.mode == PvMode::dry ? t_rest : t_wake)) return;
    const bool wakes = x.mode == PvMode::asleep;
    const DrawnCurrent<T, N> drawn = x.drawn;
    x = {};
    x.drawn = drawn;
    if (!wakes) return;
    x.mode = PvMode::running;
    x.omega_ramp = max(y.omega_m, T(0));
    tracker.start(x.tracker);
  }

  /// Sums a sample; at the end of a mean judges power and torque, and moves the reference.
  template <int N>
  constexpr void observe(State<N>& x, const Measurement<T, N>& y) const {
    const T i = current == ArrayCurrent::sensor ? y.i_source : x.drawn.mean(y);
    if (!mean.add(x.mean, y.u_dc, i, x.tau, y.theta_e)) return;
    auto m = mean.means(x.mean, y.u_dc);
    if (current == ArrayCurrent::legs) {  // what charged the capacitor came from the array too
      const T charging = C * m.rise / m.t;
      m.i = m.i + charging;
      m.p = m.p + charging * m.u;
    }
    const T t = x.mean.t;
    x.mean = {};
    x.t_low = m.p < p_sleep ? x.t_low + t : T(0);
    const bool unloaded = y.omega_m > omega_dry && m.tau < k_dry * y.omega_m * y.omega_m;
    x.t_dry = unloaded ? x.t_dry + t : T(0);
    if (x.t_low >= t_sleep) x.mode = PvMode::asleep;
    if (x.t_dry >= t_dry) x.mode = PvMode::dry;
    // Where something else limits the torque, the voltage tells nothing about the maximum.
    if (abs(m.u - x.tracker.u_ref) <= T(2) * tracker.step) {
      tracker.advance(x.tracker, m.u, m.i, m.p);
    } else {
      x.tracker.has_last = false;
    }
  }
};

}  // namespace srm
