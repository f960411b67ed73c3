// What is found out before a drive turns for the first time: one routine at a time, with the checks
// that no routine goes without. The order in which a maker runs them: wiring, resistance,
// alignment, and pulses with a clamped rotor.
#pragma once

#include <cstdint>

#include "srm/base/fields.hpp"
#include "srm/base/real.hpp"
#include "srm/control/commission/alignment.hpp"
#include "srm/control/commission/finding.hpp"
#include "srm/control/commission/flux_pulses.hpp"
#include "srm/control/commission/resistance.hpp"
#include "srm/control/commission/wiring.hpp"
#include "srm/control/frame/dead_time_compensation.hpp"
#include "srm/control/guard/fault.hpp"

namespace srm {

/// Numbers are part of the C interface.
enum class Routine : std::int32_t {
  none = 0,
  wiring = 1,
  resistance = 2,
  alignment = 3,
  pulses = 4
};

template <Real T>
struct Commission {
  T T_s;                 // control period [s]
  T t_dead;              // of the converter [s]
  T i_trip;              // of any current, either sign [A]
  T u_dc_min, u_dc_max;  // [V]
  T t_max;               // of a routine [s]
  Wiring<T> wiring;
  Resistance<T> resistance;
  Alignment<T> alignment;
  FluxPulses<T> pulses;
  SRM_FIELDS(T_s, t_dead, i_trip, u_dc_min, u_dc_max, t_max, wiring, resistance, alignment, pulses)

  template <int N>
  struct State {
    Routine routine = Routine::none;
    Finding finding = Finding::idle;
    T progress{};  // [1]
    std::uint32_t samples = 0;
    typename Wiring<T>::template State<N> wiring;
    typename Resistance<T>::template State<N> resistance;
    typename Alignment<T>::template State<N> alignment;
    typename FluxPulses<T>::State pulses;
  };

  /// Begins a routine. phase, count: of the pulses; held, i_held: phase that has a current [A]
  /// meanwhile, none below 0.
  template <int N>
  constexpr void start(State<N>& x, Routine asked, int phase = 0, int count = 1, int held = -1,
                       T i_held = T(0)) const {
    x = {};
    x.routine = asked;
    x.finding = asked == Routine::none ? Finding::idle : Finding::running;
    pulses.template start<N>(x.pulses, phase, count, held, i_held);
  }

  /// Once a control period. All legs are off where no routine runs.
  template <int N>
  constexpr Command<T, N> step(State<N>& x, const Measurement<T, N>& y) const {
    if (x.finding == Finding::running) check(x, y);
    if (x.finding != Finding::running) return Command<T, N>{};
    Command<T, N> orders = run(x, y);
    if (x.finding != Finding::running) return Command<T, N>{};
    if (t_dead > T(0)) lead_turn_on<T, N>(orders, t_dead);
    return orders;
  }

 private:
  template <int N>
  constexpr void check(State<N>& x, const Measurement<T, N>& y) const {
    ++x.samples;
    if (static_cast<T>(x.samples) * T_s > t_max) x.finding = Finding::too_long;
    if (!(y.u_dc >= u_dc_min && y.u_dc <= u_dc_max)) x.finding = Finding::wrong_voltage;
    for (const T i : y.i) {
      if (!(abs(i) <= i_trip)) x.finding = Finding::over_current;
      if (!is_finite(i)) x.finding = Finding::not_a_number;
    }
    if (!is_finite(y.theta_e) || !is_finite(y.u_dc)) x.finding = Finding::not_a_number;
  }

  template <int N>
  constexpr Command<T, N> run(State<N>& x, const Measurement<T, N>& y) const {
    const auto one = [&](const auto& routine, auto& state) {
      const Command<T, N> orders = routine.template step<N>(state, y, T_s);
      x.finding = state.finding;
      x.progress = state.finding == Finding::done ? T(1) : state.progress();
      return orders;
    };
    switch (x.routine) {
      case Routine::wiring:
        return one(wiring, x.wiring);
      case Routine::resistance:
        return one(resistance, x.resistance);
      case Routine::alignment:
        return one(alignment, x.alignment);
      case Routine::pulses:
        return one(pulses, x.pulses);
      case Routine::none:
        break;
    }
    return Command<T, N>{};
  }
};

/// The routines as the control of a supervised drive (guard/supervised.hpp): a finding that is a
/// fault ends the run.
template <Real T, int N>
struct Commissioning {
  using Scalar = T;
  static constexpr int n_phases = N;

  Commission<T> routines;

  struct State {
    typename Commission<T>::template State<N> routine;
    Fault<T> fault;
  };
  struct Tuning {};
  constexpr Tuning tuning() const { return {}; }
  constexpr bool motors() const { return false; }
  T speed(const State&, const Measurement<T, N>& y) const { return y.omega_m; }

  void step(State& x, const Measurement<T, N>& y, T, Command<T, N>& orders, Tuning) const {
    orders = routines.step(x.routine, y);
    x.fault = found(x.routine.finding, y.u_dc);
  }
  void start(State&) const {}
  void watch(State&, const Measurement<T, N>&, Tuning) const {}
  void forget(State& x) const { x.fault = {}; }
  void lose(State& x) const { forget(x); }
  const Fault<T>& fault(const State& x) const { return x.fault; }
  bool latched(const State& x) const { return x.fault.status != Status::ok; }

 private:
  constexpr Fault<T> found(Finding finding, T u_dc) const {
    switch (finding) {
      case Finding::over_current:
        return {Status::over_current, -1, T(0), routines.i_trip, 0};
      case Finding::wrong_voltage:
        if (u_dc > routines.u_dc_max) return {Status::over_voltage, -1, u_dc, routines.u_dc_max, 0};
        return {Status::under_voltage, -1, u_dc, routines.u_dc_min, 0};
      case Finding::not_a_number:
        return {Status::not_a_number, -1, T(0), T(0), 0};
      default:
        return {};
    }
  }
};

}  // namespace srm
