// A supervised drive on the desk: when it is enabled and cleared, one fault, and the step of the
// core (control/guard/supervised.hpp) with them.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "srm/control/guard/guarded.hpp"
#include "srm/control/guard/supervised.hpp"
#include "srm/plant/course.hpp"
#include "srm/sim/controller.hpp"
#include "srm/sim/event.hpp"
#include "srm/sim/tables.hpp"

namespace srm {

/// What goes wrong: readings, commands or the board's own trip. Numbers are part of the C
/// interface.
enum class Trouble : std::int8_t {
  none = 0,
  over_current = 1,           // a channel shows `level`
  over_voltage = 2,           // the dc-link voltage does
  under_voltage = 3,          // likewise
  dead_current_sensor = 4,    // a channel shows 0
  frozen_current_sensor = 5,  // a channel shows what it last showed
  lost_encoder = 6,           // the angle does
  no_command = 7,             // no more commands arrive
  hardware_trip = 8           // the board has tripped by itself
};

/// Courses are 1 or 0 over time.
struct Supervision {
  double T_s;            // control period [s]
  Course enable, clear;  // of the request
  Course troubled;       // while the trouble lasts
  Trouble trouble;
  int phase;     // of the channel
  double level;  // that is shown [A or V]
  SRM_FIELDS(T_s, enable, clear, troubled, trouble, phase, level)
};

/// A drive with its states, and when it is enabled and cleared.
template <class Drive>
struct SupervisedDrive {
  using Scalar = typename Drive::T;
  static constexpr int n_phases = Drive::N;

  Drive drive;
  Supervision supervision;
  SRM_FIELDS(drive, supervision)

  /// What changes from sample to sample: a plain value where the state of the law is one.
  struct State {
    typename Drive::State drive;
    Measurement<double, n_phases> shown;  // at the last sample
    std::uint32_t samples = 0, commands = 0;
    Outputs outputs{};
  };
};

/// The readings of one sample, as they are shown. last: those of the sample before.
template <int N>
void spoil(const Supervision& s, Measurement<double, N>& y, const Measurement<double, N>& last) {
  switch (s.trouble) {
    case Trouble::over_current:
      y.i[s.phase] = s.level;
      break;
    case Trouble::over_voltage:
    case Trouble::under_voltage:
      y.u_dc = s.level;
      break;
    case Trouble::dead_current_sensor:
      y.i[s.phase] = 0;
      break;
    case Trouble::frozen_current_sensor:
      y.i[s.phase] = last.i[s.phase];
      break;
    case Trouble::lost_encoder:
      y.theta_e = last.theta_e;
      break;
    default:
      break;
  }
}

/// One sample of a supervised drive on the desk. Measurement and orders change precision here, as
/// they would at the target's sensors and timers.
template <class Drive>
Orders<Drive::N> step_on_desk(const SupervisedDrive<Drive>& given,
                              typename SupervisedDrive<Drive>::State& x,
                              Measurement<double, Drive::N> y, double reference) {
  const Drive& drive = given.drive;
  const Supervision& s = given.supervision;
  using T = typename Drive::T;
  constexpr int N = Drive::N;
  const double t = s.T_s * x.samples++;
  const bool troubled = s.trouble != Trouble::none && s.troubled.at(t) > 0.5;
  if (troubled) spoil(s, y, x.shown);
  x.shown = y;
  const bool silent = troubled && s.trouble == Trouble::no_command;
  if (!silent) ++x.commands;
  Measurement<T, N> seen;
  assign(seen, y);
  seen.theta_e = wrap(seen.theta_e);
  Command<T, N> ordered;
  x.outputs = drive.step(x.drive, seen,
                         {.enable = s.enable.at(t) > 0.5,
                          .clear = s.clear.at(t) > 0.5,
                          .tripped = troubled && s.trouble == Trouble::hardware_trip,
                          .sequence = x.commands,
                          .reference = static_cast<T>(reference)},
                         ordered);
  Orders<N> orders;
  assign(orders.command, ordered);
  orders.at_once = !x.outputs.gate_enable;
  const auto& law = drive.control.law(x.drive.control);
  orders.tau_ref = orders.at_once ? 0.0 : double(law.frame.tau_ref);
  if constexpr (requires { law.law.learned; }) assign(orders.learned, law.law.learned);
  if constexpr (requires { drive.control.estimate(x.drive.control); }) {
    assign(orders.estimate, drive.control.estimate(x.drive.control));
  }
  return orders;
}

/// The state of a drive at its last sample, and its fault.
template <class Drive>
Event event_of(const SupervisedDrive<Drive>& given,
               const typename SupervisedDrive<Drive>::State& x) {
  Event event{.t = x.samples == 0 ? 0.0 : given.supervision.T_s * (x.samples - 1),
              .mode = static_cast<double>(x.outputs.mode)};
  if (x.outputs.mode == Mode::fault) {
    const auto& fault = given.drive.fault(x.drive);
    event.status = static_cast<double>(fault.status);
    event.phase = fault.phase;
    event.value = fault.value;
    event.limit = fault.limit;
  }
  return event;
}

}  // namespace srm
