// Conduction angles with hysteresis current control: the classic SRM drive.
//
// Between turn-on and turn-off the current is held in a band by the comparator; soft chopping
// freewheels above the band, hard chopping demagnetizes. Braking always chops hard: the EMF raises
// the current of a phase that freewheels. A current reference that is never reached is single-pulse
// operation. With a table, angles and current of motoring follow speed and torque; braking and the
// window for starting stay as they are. T. J. E. Miller, Switched Reluctance Motors and Their
// Control, Oxford 1993, ch. 4; R. Krishnan, Switched Reluctance Motor Drives, CRC 2001, ch. 4.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/part/conduction.hpp"
#include "srm/control/part/mean_torque.hpp"
#include "srm/control/part/mirror.hpp"
#include "srm/control/part/per_phase.hpp"
#include "srm/control/part/pulse_table.hpp"

namespace srm {

/// Who watches the rotor angle: a position compare unit, to the instant, or the control, once a
/// sample.
enum class AngleWatch : std::int8_t { compare, sampled };

template <Real T, int N>
struct Angles {
  using Scalar = T;
  static constexpr int n_phases = N;
  struct State {};

  Conduction<T> conduction;
  MeanTorque<T> reference;
  T i_band;                   // half width of the current band [A]
  Leg chop = Leg::freewheel;  // freewheel: soft; demagnetize: hard
  AngleWatch watch = AngleWatch::compare;
  PulseTable<T> table = {};  // of motoring; empty: fixed angles
  SRM_FIELDS(conduction, reference, i_band, chop, watch, table)

  constexpr Command<T, N> step(State&, const Measurement<T, N>& y, T tau_ref) const {
    Window<T> window = conduction.template window<N>(y.omega_m, tau_ref);
    const bool braking = brakes(y.omega_m, tau_ref);
    T i_ref = reference.current(tau_ref, braking);
    if (table.is_there() && follows_table(y.omega_m, tau_ref)) {
      const Pulse<T> pulse = table.at(abs(y.omega_m), abs(tau_ref));
      window = pulse.window;
      i_ref = pulse.i_ref;
    }
    return per_phase<T, N>([&](int k) {
      PhaseCommand<T> command = regulate(i_ref, i_band, braking ? Leg::demagnetize : chop);
      switch (watch) {
        case AngleWatch::compare:
          command.gate = Gate::window;
          command.theta_on = wrap(tau_ref < T(0) ? -window.theta_off : window.theta_on);
          command.theta_off = wrap(tau_ref < T(0) ? -window.theta_on : window.theta_off);
          break;
        case AngleWatch::sampled:
          const T theta = drive_angle<N>(y.theta_e, k, tau_ref);
          if (!conducts(theta, window.theta_on, window.theta_off)) command.i_ref = T(0);
          break;
      }
      return command;
    });
  }

 private:
  /// Motoring above the window for starting, with a torque to give.
  constexpr bool follows_table(T omega_m, T tau_ref) const {
    return abs(omega_m) >= conduction.omega_start && omega_m * tau_ref > T(0);
  }
};

}  // namespace srm
