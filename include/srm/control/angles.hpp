// Conduction angles with hysteresis current control: the classic SRM drive.
//
// Between turn-on and turn-off the current is held in a band by the comparator; soft chopping
// freewheels above the band, hard chopping demagnetizes. A current reference that is never reached
// is single-pulse operation. T. J. E. Miller, Switched Reluctance Motors and Their Control, Oxford
// 1993, ch. 4; R. Krishnan, Switched Reluctance Motor Drives, CRC 2001, ch. 4.
#pragma once

#include "srm/control/conduction.hpp"
#include "srm/control/interface.hpp"
#include "srm/control/mean_torque.hpp"
#include "srm/control/mirror.hpp"

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

  constexpr Command<T, N> step(State&, const Measurement<T, N>& y, T tau_ref) const {
    const Window<T> window = conduction.template window<N>(y.omega_m, tau_ref);
    const PhaseCommand<T> on = regulate(reference.current(tau_ref), i_band, chop);
    Command<T, N> command;
    for (int k = 0; k < N; ++k) {
      switch (watch) {
        case AngleWatch::compare:
          command[k] = on;
          command[k].gate = Gate::window;
          command[k].theta_on = wrap(tau_ref < T(0) ? -window.theta_off : window.theta_on);
          command[k].theta_off = wrap(tau_ref < T(0) ? -window.theta_on : window.theta_off);
          break;
        case AngleWatch::sampled:
          if (conducts(drive_angle<N>(y.theta_e, k, tau_ref), window.theta_on, window.theta_off)) {
            command[k] = on;
          }
          break;
      }
    }
    return command;
  }
};

}  // namespace srm
