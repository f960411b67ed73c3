// The states of a drive, each left at the edge of its limit; chopper and limits of the reference.
#include <array>
#include <limits>
#include <string_view>

#include "errors.hpp"
#include "srm/control/guard/sequence.hpp"
#include "within.hpp"

using namespace srm;

namespace {

Sequence<double> sequence() {
  return {.T_s = 0.25,
          .u_ready = 100,
          .t_precharge = 2,
          .n_settle = 3,
          .n_calibrate = 4,
          .i_offset = 2,
          .t_command = 1,
          .u_chop_on = 300,
          .u_chop_off = 290,
          .reference_max = 10,
          .omega_none = 100};
}

/// Every state is left at its own sample, at the edge of its limit.
double states() {
  const Sequence<double> s = sequence();
  Sequence<double>::State<3> x;
  Request<double> ask{.enable = true};
  Measurement<double, 3> y{.i = {0.5, -2, 2}, .u_dc = 100};
  const auto samples_in = [&](Mode mode, bool commands = false) {
    int n = 0;
    while (x.mode == mode && n < 50) {
      ask.sequence += commands;
      s.step(x, y, ask);
      ++n;
    }
    return n;
  };
  double worst = worst_of({off(samples_in(Mode::off), 1), off(samples_in(Mode::precharge), 3)});
  worst = worst_of({worst, off(samples_in(Mode::calibrate), 4), unless(x.mode == Mode::ready),
                    off(x.offset[0], 0.5), off(x.offset[1], -2), off(x.offset[2], 2)});
  s.correct(x, y);
  worst = worst_of({worst, off(y.i[1], 0)});
  y.u_dc = 99.9;
  worst = worst_of({worst, off(samples_in(Mode::ready), 1), unless(x.mode == Mode::precharge),
                    off(samples_in(Mode::precharge), 9), unless(x.mode == Mode::fault),
                    unless(x.fault.status == Status::precharge_timeout), off(x.fault.value, 99.9)});
  s.step(x, y, ask);
  worst = worst_of({worst, off(x.fault.age, 1)});
  ask.clear = true;
  const bool enabled = s.clear(x, ask, true);
  ask.enable = false;
  const bool stays = s.clear(x, ask, false);
  worst = worst_of({worst, unless(!enabled && !stays && s.clear(x, ask, true)),
                    unless(x.mode == Mode::off && x.fault.status == Status::ok),
                    unless(!s.clear(x, ask, true))});
  ask = {.enable = true};
  y.u_dc = 100;
  for (const Mode mode : {Mode::off, Mode::precharge, Mode::calibrate}) samples_in(mode);
  worst = worst_of({worst, off(x.offset[1], -2), off(samples_in(Mode::ready), 50)});
  ++ask.sequence;
  worst = worst_of({worst, off(samples_in(Mode::ready), 1), unless(x.mode == Mode::run)});
  ++ask.sequence;
  s.step(x, y, ask);
  worst = worst_of({worst, off(samples_in(Mode::run), 5),
                    unless(x.fault.status == Status::command_timeout), off(x.fault.value, 1.25),
                    off(x.fault.limit, 1)});
  s.fail(x, {Status::hardware_trip});
  worst = worst_of({worst, unless(x.fault.status == Status::command_timeout)});
  for (const Mode mode : {Mode::precharge, Mode::calibrate, Mode::ready, Mode::run}) {
    x.mode = mode;
    s.step(x, y, {});
    worst = worst_of({worst, unless(x.mode == Mode::off)});
  }
  x = {};
  x.mode = Mode::calibrate;
  y.i[1] = 2.001;
  return worst_of({worst, off(samples_in(Mode::calibrate), 4), unless(x.mode == Mode::fault),
                   unless(x.fault.status == Status::calibration_failed), off(x.fault.phase, 1)});
}

/// The chopper holds between its two voltages; no motoring torque at the greatest speed.
double limits() {
  const Sequence<double> s = sequence();
  Sequence<double>::State<3> x;
  Measurement<double, 3> y{};
  double worst = 0;
  const auto chops = [&](double u, bool is) {
    y.u_dc = u;
    s.step(x, y, {});
    worst = worst_of({worst, unless(x.chopper == is)});
  };
  constexpr std::array names{"off", "precharge", "calibrate", "ready", "run", "fault"};
  for (int n = 0; n < 6; ++n) {
    worst = worst_of({worst, unless(std::string_view(describe(static_cast<Mode>(n))) == names[n])});
  }
  for (int n : {-1, 6}) {
    worst =
        worst_of({worst, unless(std::string_view(describe(static_cast<Mode>(n))) == "unknown")});
  }
  chops(300, false);
  chops(300.1, true);
  chops(290.1, true);
  chops(290, false);
  chops(299, false);
  const auto gives = [&](double reference, double omega, bool motors, double expected) {
    y.omega_m = omega;
    worst =
        worst_of({worst, off(s.limited({.reference = reference}, y.omega_m, motors), expected)});
  };
  gives(12, 0, true, 10);
  gives(-12, 0, true, -10);
  gives(8, 95, true, 8);
  gives(8, 97.5, true, 4);
  gives(8, 100, true, 0);
  gives(8, 120, true, 0);
  gives(-8, -99, true, -1.6);
  gives(-8, 99, true, -8);
  gives(8, -99, true, 8);
  gives(8, 99, false, 8);
  constexpr double infinite = std::numeric_limits<double>::infinity();
  for (const double reference : {std::nan(""), infinite, -infinite}) {
    for (const double omega : {0.0, 97.5, -120.0}) {
      const double kept = s.limited({.reference = reference}, omega, true);
      worst = worst_of({worst, unless(!is_finite(kept))});
    }
  }
  return worst;
}

}  // namespace

int main() {
  check("states of a drive", states(), 1e-15);
  check("chopper and limits of the reference", limits(), 1e-12);
  return failures == 0 ? 0 : 1;
}
