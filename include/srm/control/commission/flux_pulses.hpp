// Voltage pulses of one phase at a clamped rotor, from which the flux linkage follows:
// psi = integral of (u - R i) dt.
//
// The phase rests, magnetizes until its current is i_top, demagnetizes until it is nearly gone, and
// waits until it is. PWM of a small duty spreads a pulse over so many samples that the steps of
// the current stay small where the iron saturates. Each sample is a row of the recording: the mean
// voltage of the period that it ends, less the thresholds of the devices, the current, the angle.
//
// A second phase may be held at a current meanwhile. What the pulsed phase's current changes of its
// flux linkage is what the two add to each other: it shows in the voltage that holds the current.
#pragma once

#include "srm/control/commission/current_hold.hpp"
#include "srm/control/commission/finding.hpp"

namespace srm {

/// A row of the recording. pulse: below 0 while a held current settles, and the row is none.
template <Real T>
struct PulseRow {
  std::int32_t pulse = 0, sample = 0;  // sample: since the rest before the pulse
  T u_mean{};                          // since the row before [V]
  T i{};                               // [A]
  T theta_e{};                         // where the rotor is clamped [rad]
  T u_held{}, i_held{};                // of the held phase, likewise; 0 where none is
};

template <Real T>
struct FluxPulses {
  T duty;               // of the pulses [1]
  T i_top;              // [A]
  T i_beside;           // in its place beside a held phase [A]
  T i_end;              // below it a pulse has ended [A]
  T slack;              // electrical: the rotor is clamped as long as it stays within [rad]
  T v_switch, v_diode;  // thresholds of the devices [V]
  int n_rest;           // recorded before a pulse [samples]
  int n_pulse;          // longest rise or fall [samples]
  int delay;            // samples from an order to its effect
  CurrentHold<T> hold;  // of the held phase
  T duty_dead;          // of a dead time: demagnetizing for less takes longer than ordered [1]
  int n_settle;         // samples until its current is at rest
  SRM_FIELDS(duty, i_top, i_beside, i_end, slack, v_switch, v_diode, n_rest, n_pulse, delay, hold,
             duty_dead, n_settle)

  /// settle: of the held current. decay: until the remaining current is gone, as long as the pulse
  /// was.
  enum class Part : std::int8_t { rest, rise, fall, decay, settle };

  /// The duty cycle in effect, and the one ordered [1].
  struct Ordered {
    T duty{}, next{};
    constexpr void order(T ordered, int samples) {
      duty = samples > 0 ? next : ordered;
      next = ordered;
    }
  };

  struct State {
    Finding finding = Finding::running;
    Part part = Part::rest;
    int k = 0, count = 1;   // phase, and pulses in all
    int n = 0, length = 0;  // samples of this part, and of the pulse
    bool found = false;     // the angle at the start is known
    T theta_e{};            // [rad]
    Ordered pulsed;
    T u_dc{};  // at the sample before [V]
    PulseRow<T> row;
    int held = -1;  // phase; below 0: none
    T i_held{};     // its reference [A]
    typename CurrentHold<T>::State current;
    Ordered beside;
    constexpr T progress() const {
      return row.pulse < 0 ? T(0) : static_cast<T>(row.pulse) / static_cast<T>(count);
    }
  };

  /// Pulses of phase k, with another phase at a current > 0 if that is asked for.
  template <int N>
  constexpr void start(State& x, int k, int count, int held, T i_held) const {
    x.k = k < 0 || k >= N ? 0 : k;
    x.count = count < 1 ? 1 : count;
    if (held < 0 || held >= N || held == x.k || !is_positive(i_held)) return;
    x.held = held;
    x.i_held = i_held;
    x.part = Part::settle;
    x.row.pulse = -1;
  }

  template <int N>
  constexpr Command<T, N> step(State& x, const Measurement<T, N>& y, T T_s) const {
    if (!x.found) x.theta_e = y.theta_e;
    x.found = true;
    record(x, y.i[x.k], y.u_dc);
    if (x.held >= 0) x.row.u_held = mean(x.beside.duty, x.u_dc, y.u_dc);
    if (x.held >= 0) x.row.i_held = y.i[x.held];
    advance(x, y.i[x.k]);
    if (abs(wrap(y.theta_e - x.theta_e + pi<T>) - pi<T>) > slack) x.finding = Finding::rotor_moved;
    const T ordered = x.part == Part::rise ? duty : x.part == Part::fall ? -duty : T(0);
    Command<T, N> orders = drive_one<T, N>(x.k, ordered == T(0) ? T(-1) : ordered, T_s);
    x.pulsed.order(ordered, delay);
    if (x.held >= 0) {
      T beside = hold.step(x.current, x.i_held, y.i[x.held], y.u_dc, -hold.duty_max);
      if (beside < T(0) && beside > -duty_dead) beside = T(0);
      orders[x.held] = modulate(beside, T_s);
      x.beside.order(beside, delay);
    }
    x.u_dc = y.u_dc;
    return orders;
  }

 private:
  constexpr void record(State& x, T i, T u_dc) const {
    x.row.u_mean = x.pulsed.duty == T(0) ? T(0) : mean(x.pulsed.duty, x.u_dc, u_dc);
    x.row.i = i;
    x.row.theta_e = x.theta_e;  // of the start: an encoder may toggle between two counts
    ++x.row.sample;
  }

  /// Voltage over a period of a winding that carries current.
  constexpr T mean(T ordered, T before, T now) const {
    return ordered * (before + now) / T(2) - (v_switch + v_diode + ordered * (v_switch - v_diode));
  }

  constexpr void advance(State& x, T i) const {
    ++x.n;
    switch (x.part) {
      case Part::settle:
        if (x.n <= n_settle) return;
        if (abs(x.row.i_held - x.i_held) > x.i_held / T(4)) x.finding = Finding::no_current;
        x.row.pulse = x.row.sample = 0;
        return enter(x, Part::rest);
      case Part::rest:
        if (x.n > n_rest) enter(x, Part::rise);
        return;
      case Part::rise:
        ++x.length;
        if (i >= (x.held < 0 ? i_top : i_beside)) return enter(x, Part::fall);
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
