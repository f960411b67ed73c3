// From switching on to running and back: the states of a drive around its control step.
//
//   off --enable--> precharge --u_dc is there--> calibrate --offsets known--> ready
//   ready --fresh command--> run;   run, ready, ... --enable withdrawn--> off
//   any --fault--> fault --clear, without enable and without the cause--> off
//
// The legs switch in `run` only. An under-voltage is a fault there; before, it is what precharge
// waits for. Calibrate averages the currents with all legs off and takes the mean from every later
// reading. A command that does not come for t_command is a fault. The chopper has a hysteresis of
// its own and works in every state.
#pragma once

#include <array>
#include <cstdint>

#include "srm/base/fields.hpp"
#include "srm/control/guard/fault.hpp"
#include "srm/control/interface/interface.hpp"

namespace srm {

/// Numbers are part of the C interface.
enum class Mode : std::int32_t {
  off = 0,
  precharge = 1,
  calibrate = 2,
  ready = 3,
  run = 4,
  fault = 5
};

constexpr const char* describe(Mode mode) {
  constexpr const char* names[] = {"off", "precharge", "calibrate", "ready", "run", "fault"};
  const bool known = mode >= Mode::off && mode <= Mode::fault;
  return known ? names[static_cast<int>(mode)] : "unknown";
}

/// What the drive is asked for. `sequence` changes with each command that arrives.
template <Real T>
struct Request {
  bool enable = false, clear = false;
  bool tripped = false;  // the hardware has tripped by itself
  std::uint32_t sequence = 0;
  T reference{};
};

template <Real T>
struct Sequence {
  T T_s;                    // control period [s]
  T u_ready;                // the dc link is charged from here [V]
  T t_precharge;            // longest wait for it [s]
  int n_settle;             // samples above u_ready before it counts, and after the relay closes
  int n_calibrate;          // samples of the offsets
  T i_offset;               // greatest offset [A]
  T t_command;              // longest time without a command [s]
  T u_chop_on, u_chop_off;  // of the brake chopper [V]
  T reference_max;          // limit of the reference, either sign
  T omega_none;             // no motoring torque from here on, all of it up to 0.95 of it [rad/s]
  SRM_FIELDS(T_s, u_ready, t_precharge, n_settle, n_calibrate, i_offset, t_command, u_chop_on,
             u_chop_off, reference_max, omega_none)

  template <int N>
  struct State {
    Mode mode = Mode::off;
    bool chopper = false;
    std::uint32_t sequence = 0;  // of the last command
    std::uint32_t n = 0;         // samples in this state, or in a row that count
    std::uint32_t waited = 0;    // samples in this state, or since the last command
    std::array<T, N> offset{};   // of the currents [A]
    std::array<T, N> sum{};
    Fault<T> fault;
  };

  /// Takes the offsets from the readings.
  template <int N>
  constexpr void correct(const State<N>& x, Measurement<T, N>& y) const {
    for (int k = 0; k < N; ++k) y.i[k] = y.i[k] - x.offset[k];
  }

  /// Before the control step: the state for this sample. y: corrected.
  template <int N>
  constexpr Mode step(State<N>& x, const Measurement<T, N>& y, const Request<T>& ask) const {
    x.chopper = y.u_dc > (x.chopper ? u_chop_off : u_chop_on);
    const bool fresh = ask.sequence != x.sequence;
    x.sequence = ask.sequence;
    switch (x.mode) {
      case Mode::off:
        if (ask.enable) enter(x, Mode::precharge);
        break;
      case Mode::precharge:
        if (!ask.enable) return enter(x, Mode::off);
        ++x.waited;
        x.n = y.u_dc >= u_ready ? x.n + 1 : 0;
        if (x.n >= static_cast<std::uint32_t>(n_settle)) return enter(x, Mode::calibrate);
        if (time(x) > t_precharge) fail(x, {Status::precharge_timeout, -1, y.u_dc, u_ready});
        break;
      case Mode::calibrate:
        if (!ask.enable) return enter(x, Mode::off);
        calibrate(x, y);
        break;
      case Mode::ready:
        if (!ask.enable) return enter(x, Mode::off);
        if (y.u_dc < u_ready) return enter(x, Mode::precharge);
        if (fresh) enter(x, Mode::run);
        break;
      case Mode::run:
        if (!ask.enable) return enter(x, Mode::off);
        x.waited = fresh ? 0 : x.waited + 1;
        if (time(x) > t_command) fail(x, {Status::command_timeout, -1, time(x), t_command});
        break;
      case Mode::fault:
        ++x.fault.age;
        break;
    }
    return x.mode;
  }

  /// The reference within its limits; one that is no finite number stays, for the protection to
  /// refuse. motors: it is a torque or the sign of one.
  constexpr T limited(const Request<T>& ask, T omega_m, bool motors) const {
    if (!is_finite(ask.reference)) return ask.reference;
    const T asked = clamp(ask.reference, -reference_max, reference_max);
    const T omega = abs(omega_m), omega_full = T(0.95) * omega_none;
    if (!(motors && asked * omega_m > T(0) && omega > omega_full)) return asked;
    return asked * clamp((omega_none - omega) / (omega_none - omega_full), T(0), T(1));
  }

  /// A fault of the control step or of the board.
  template <int N>
  constexpr void fail(State<N>& x, const Fault<T>& fault) const {
    if (x.mode == Mode::fault) return;
    enter(x, Mode::fault);
    x.fault = fault;
  }

  /// Leaves `fault` on request where the cause is gone; false where it stays.
  template <int N>
  constexpr bool clear(State<N>& x, const Request<T>& ask, bool gone) const {
    if (x.mode != Mode::fault || !ask.clear || ask.enable || !gone) return false;
    enter(x, Mode::off);
    x.fault = {};
    return true;
  }

 private:
  template <int N>
  constexpr Mode enter(State<N>& x, Mode mode) const {
    x.mode = mode;
    x.n = 0;
    x.waited = 0;
    return mode;
  }

  /// Waited for [s].
  template <int N>
  constexpr T time(const State<N>& x) const {
    return static_cast<T>(x.waited) * T_s;
  }

  /// Offsets of the last calibration are in y already: the mean of what is left adds to them.
  template <int N>
  constexpr void calibrate(State<N>& x, const Measurement<T, N>& y) const {
    if (x.n == 0) x.sum = {};
    for (int k = 0; k < N; ++k) x.sum[k] = x.sum[k] + y.i[k];
    if (++x.n < static_cast<std::uint32_t>(n_calibrate)) return;
    for (int k = 0; k < N; ++k) {
      const T offset = x.offset[k] + x.sum[k] / static_cast<T>(n_calibrate);
      if (!(abs(offset) <= i_offset)) {
        fail(x, {Status::calibration_failed, static_cast<std::int8_t>(k), offset, i_offset});
        return;
      }
      x.offset[k] = offset;
    }
    enter(x, Mode::ready);
  }
};

}  // namespace srm
