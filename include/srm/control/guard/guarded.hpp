// A drive's control with its protection: the step, and what goes on while the legs are off.
#pragma once

#include <new>

#include "srm/control/frame/drive_control.hpp"
#include "srm/control/guard/protection.hpp"

namespace srm {

/// The rotor speed that the control uses: the observer's where there is an observer.
template <Uses used, ControlLaw Law, class Y>
auto known_speed(const DriveControl<Law>& control, const typename DriveControl<Law>::State& x,
                 const Y& y) {
  if constexpr (used.observer) {
    if (control.frame.motion == Motion::tracked) {
      return control.frame.tracker.omega_m(x.frame.tracker);
    }
  }
  return y.omega_m;
}

/// The sample as the protection judges it: with that speed.
template <Uses used, ControlLaw Law, class Y>
Y judged(const DriveControl<Law>& control, const typename DriveControl<Law>::State& x, Y y) {
  y.omega_m = known_speed<used>(control, x, y);
  return y;
}

/// A state anew, in place: assigned, a second one would stand on the stack.
// noinline: of five places.
template <class State>
[[gnu::noinline]] void renew(State& x) {
  ::new (&x) State();
}

/// A control that starts anew, with the rotor already followed.
template <ControlLaw Law>
void start(const DriveControl<Law>&, typename DriveControl<Law>::State& x) {
  const auto tracker = x.frame.tracker;
  renew(x);
  x.frame.tracker = tracker;
}

/// Nothing is asked besides the protection.
struct Undiagnosed {
  static constexpr bool on = false;
};

/// A control law and its frame under the protection.
template <Machine M, class Control>
struct Guarded {
  using Scalar = typename M::Scalar;
  using T = Scalar;
  static constexpr int N = Control::n_phases;
  static constexpr int n_phases = N;

  M machine;  // as the controller knows it
  Protection<T> protection;
  Control control;
  SRM_FIELDS(machine, protection, control)

  struct State {
    typename Protection<T>::template State<N> guard;
    typename Control::State law;
  };

  /// What may be another one from step to step (firmware: parameters at run time).
  struct Tuning {
    TripLevels<T> levels;
    srm::Tuning<T> control;
  };
  constexpr Tuning tuning() const { return {protection.levels, control.frame.tuning()}; }

  /// True where the reference is a torque, or the sign of one.
  constexpr bool motors() const {
    return control.frame.outer == Outer::torque || control.frame.outer == Outer::none;
  }

  /// The rotor speed that the control uses [rad/s].
  template <Uses used = Uses{}>
  T speed(const State& x, const Measurement<T, N>& y) const {
    return known_speed<used>(control, x.law, y);
  }

  /// Protection, then the law; all legs off where the protection does not admit the sample.
  /// diagnose: what holds the currents against the voltage instead of the protection.
  template <Uses used = Uses{}, class Diagnose = Undiagnosed>
  [[gnu::always_inline]] Status step(State& x, const Measurement<T, N>& y, T reference,
                                     Command<T, N>& orders, const Tuning& at,
                                     [[maybe_unused]] const Diagnose& diagnose = {}) const {
    const Measurement<T, N> seen = judged<used>(control, x.law, y);
    bool good = protection.template admits<!Diagnose::on, used.observer>(x.guard, machine, seen,
                                                                         reference, at.levels);
    if constexpr (Diagnose::on) good = good && !diagnose.finds(seen);
    if (good) {
      bool runs = true;
      if constexpr (Diagnose::on) runs = !diagnose.tries(y, orders);
      if (runs) {
        ::new (&orders)  // in place: a copy would cost as much as an angle law's arithmetic
            Command<T, N>(control.template step<used>(x.law, y, reference, at.control));
      } else {
        pause<used>(x, y, orders);
      }
      protection.remember(x.guard, machine.N_r, seen, orders, at.levels);
      if constexpr (Diagnose::on) diagnose.remember(orders);
    } else {
      orders = {};
      if constexpr (Diagnose::on) diagnose.explain();
    }
    return x.guard.fault.status;
  }

  /// Other orders than the law's: it starts anew afterwards, and the rotor is followed.
  template <Uses used>
  void pause(State& x, Measurement<T, N> y, Command<T, N>& orders) const {
    renew(x.law.law);
    if constexpr (used.observer) control.frame.follow(x.law.frame, y, T(0));
    if (control.frame.edges.any()) {
      for (PhaseCommand<T>& order : orders) control.frame.edges.apply(order);
    }
  }

  /// The law starts anew, with the rotor already followed.
  void start(State& x) const { srm::start(control, x.law); }

  /// The protection starts anew.
  void forget(State& x) const { renew(x.guard); }

  /// The rotor is not followed: where it turns, and how fast, has to be found again.
  void lose(State& x) const {
    forget(x);
    x.law.frame.tracker = {};
  }

  /// Protection and observer go on while the legs are off; the dc link may still be low.
  template <Uses used = Uses{}>
  void watch(State& x, Measurement<T, N> y, const Tuning& at) const {
    y.u_dc = max(y.u_dc, at.levels.u_dc_min);
    if constexpr (used.observer) control.frame.follow(x.law.frame, y, T(0));
    if (protection.template admits<true, used.observer>(x.guard, machine, y, T(0), at.levels)) {
      protection.remember(x.guard, machine.N_r, y, Command<T, N>{}, at.levels);
    }
  }

  /// The fault of the last sample; `latched` where it stays.
  const Fault<T>& fault(const State& x) const { return x.guard.fault; }
  bool latched(const State& x) const { return x.guard.latched; }
  const auto& law(const State& x) const { return x.law; }
};

}  // namespace srm
