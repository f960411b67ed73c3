// The states of a drive around its control: one step a control period, from precharge to a fault
// and back. The same step runs on a target, on the desk, in a unit and in the studio.
//
// Control steps in the state `run`. What it offers:
//
//   step(x, y, reference, orders, tuning)   the orders of this sample
//   start(x)                        `run` begins
//   watch(x, y, tuning)             a sample in `ready` or `fault`, with all legs off
//   forget(x)                       what it knows of earlier samples no longer holds
//   lose(x)                         and where the rotor is: a sample in which it is not followed
//   fault(x), latched(x)            the fault of the last sample; true where it ends the run
//   motors()                        the reference is a torque, or the sign of one
//   speed(x, y)                     of the rotor, as the control has it
#pragma once

#include "srm/control/guard/sequence.hpp"

namespace srm {

/// What the board does besides the legs.
struct Outputs {
  Mode mode;
  bool gate_enable;  // the gate drivers may switch
  bool precharged;   // the precharge resistor is bridged
  bool chopper;      // the brake chopper is on
};

template <class Control>
struct Supervised {
  using Scalar = typename Control::Scalar;
  using T = Scalar;
  static constexpr int N = Control::n_phases;

  Sequence<T> sequence;
  Control control;
  SRM_FIELDS(sequence, control)

  struct State {
    typename Sequence<T>::template State<N> states;
    typename Control::State control;
  };

  /// One control period. y: as the sensors show it; orders: into a buffer that timers may read
  /// afterwards. at, tuning: the parameters of this step.
  Outputs step(State& x, Measurement<T, N> y, const Request<T>& ask, Command<T, N>& orders,
               const Sequence<T>& at, const typename Control::Tuning& tuning) const {
    at.correct(x.states, y);
    const Mode before = x.states.mode;
    const Mode mode = at.step(x.states, y, ask);
    if (mode == Mode::run) {
      if (before != mode) control.start(x.control);
      const T reference = at.limited(ask, control.speed(x.control, y), control.motors());
      control.step(x.control, y, reference, orders, tuning);
    } else if (mode == Mode::ready) {
      if (before != mode) control.forget(x.control);
      control.watch(x.control, y, tuning);
    } else if (mode == Mode::fault) {
      control.forget(x.control);  // judges this sample alone
      control.watch(x.control, y, tuning);
      at.clear(x.states, ask, control.fault(x.control).status == Status::ok);
    } else {
      control.lose(x.control);
    }
    if (control.latched(x.control)) at.fail(x.states, control.fault(x.control));
    if (ask.tripped) at.fail(x.states, {Status::hardware_trip, -1, T(0), T(0), 0});
    if (x.states.mode != Mode::run) orders = Command<T, N>{};
    const Mode now = x.states.mode;
    return {now, now == Mode::run, now >= Mode::calibrate && now <= Mode::run, x.states.chopper};
  }

  /// The same with the parameters that it was built with.
  Outputs step(State& x, const Measurement<T, N>& y, const Request<T>& ask,
               Command<T, N>& orders) const {
    return step(x, y, ask, orders, sequence, control.tuning());
  }

  /// The fault that ended the run, or that of the last sample.
  const Fault<T>& fault(const State& x) const {
    return x.states.mode == Mode::fault ? x.states.fault : control.fault(x.control);
  }
};

}  // namespace srm
