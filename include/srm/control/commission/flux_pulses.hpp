// Voltage pulses of one phase at a clamped rotor, from which the flux linkage follows:
// psi = integral of (u - R i) dt.
//
// The phase rests, magnetizes until its current is i_top, demagnetizes until it is nearly gone, and
// waits until it is. PWM of a small duty spreads a pulse over so many samples that the steps of
// the current stay small where the iron saturates. Each sample is a row of the recording: the mean
// voltage of the period that it ends, less the thresholds of the devices, the current, the angle.
#pragma once

#include "srm/control/commission/current_hold.hpp"
#include "srm/control/commission/finding.hpp"

namespace srm {

/// A row of the recording.
template <Real T>
struct PulseRow {
  std::int32_t pulse = 0, sample = 0;  // sample: since the rest before the pulse
  T u_mean{};                          // since the row before [V]
  T i{};                               // [A]
  T theta_e{};                         // where the rotor is clamped [rad]
};

template <Real T>
struct FluxPulses {
  T duty;               // of the pulses [1]
  T i_top;              // [A]
  T i_end;              // below it a pulse has ended [A]
  T slack;              // electrical: the rotor is clamped as long as it stays within [rad]
  T v_switch, v_diode;  // thresholds of the devices [V]
  int n_rest;           // recorded before a pulse [samples]
  int n_pulse;          // longest rise or fall [samples]
  int delay;            // samples from an order to its effect
  SRM_FIELDS(duty, i_top, i_end, slack, v_switch, v_diode, n_rest, n_pulse, delay)

  /// decay: until the remaining current is gone, as long as the pulse was.
  enum class Part : std::int8_t { rest, rise, fall, decay };

  struct State {
    Finding finding = Finding::running;
    Part part = Part::rest;
    int k = 0, count = 1;   // phase, and pulses in all
    int n = 0, length = 0;  // samples of this part, and of the pulse
    bool found = false;     // the angle at the start is known
    T theta_e{};            // [rad]
    T duty{}, next{};       // in effect, and ordered [1]
    T u_dc{};               // at the sample before [V]
    PulseRow<T> row;
    constexpr T progress() const { return static_cast<T>(row.pulse) / static_cast<T>(count); }
  };

  template <int N>
  constexpr Command<T, N> step(State& x, const Measurement<T, N>& y, T T_s) const {
    if (!x.found) x.theta_e = y.theta_e;
    x.found = true;
    record(x, y.i[x.k], y.u_dc);
    advance(x, y.i[x.k]);
    if (abs(wrap(y.theta_e - x.theta_e + pi<T>) - pi<T>) > slack) x.finding = Finding::rotor_moved;
    const T ordered = x.part == Part::rise ? duty : x.part == Part::fall ? -duty : T(0);
    x.duty = delay > 0 ? x.next : ordered;
    x.next = ordered;
    x.u_dc = y.u_dc;
    return drive_one<T, N>(x.k, ordered == T(0) ? T(-1) : ordered, T_s);
  }

 private:
  constexpr void record(State& x, T i, T u_dc) const {
    const T drop = v_switch + v_diode + x.duty * (v_switch - v_diode);
    x.row.u_mean = x.duty == T(0) ? T(0) : x.duty * (x.u_dc + u_dc) / T(2) - drop;
    x.row.i = i;
    x.row.theta_e = x.theta_e;  // of the start: an encoder may toggle between two counts
    ++x.row.sample;
  }

  constexpr void advance(State& x, T i) const {
    ++x.n;
    switch (x.part) {
      case Part::rest:
        if (x.n > n_rest) enter(x, Part::rise);
        return;
      case Part::rise:
        ++x.length;
        if (i >= i_top) return enter(x, Part::fall);
        break;
      case Part::fall:
        ++x.length;
        if (i < i_end) return enter(x, Part::decay);
        break;
      case Part::decay:
        if (x.n <= x.length) return;
        x.length = 0;
        x.row.sample = 0;
        if (++x.row.pulse == x.count) x.finding = Finding::done;
        return enter(x, Part::rest);
    }
    if (x.n > n_pulse) x.finding = Finding::no_current;
  }

  static constexpr void enter(State& x, Part part) {
    x.part = part;
    x.n = 0;
  }
};

}  // namespace srm
