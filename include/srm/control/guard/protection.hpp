// Protection: each sample is judged before the control law sees it. A fault switches all legs off
// (demagnetize) in the same step.
//
// Readings out of range are known within the sample. One such sample may be a disturbance: the legs
// are off until the next good sample. A second one within 16 samples is latched. The other faults
// are contradictions that have built up over several samples, and are latched at once. A latched
// fault keeps its cause and lasts until an explicit reset.
//
// Stuck angle. It has to advance as a rotor can turn (advance.hpp).
//
// Currents. flux_bounds.hpp keeps the flux linkage that each phase can have, from the voltage that
// was ordered. A reading that means less or more contradicts it. A phase that reads zero is at most
// at i_zero: a sensor that dies in a current that u_dc cannot remove in a sample is found at the
// next sample; one that was dead before, once the voltage must have driven the current past i_zero.
// A phase of which the current does not fall with both switches off has a shorted switch. Where
// noise moves every reading, equal ones in a row come from a frozen converter. Whether it does is
// seen while a phase is off: a board that is quieter than the simulated one shows equal readings in
// good health.
#pragma once

#include <type_traits>

#include "srm/base/fields.hpp"
#include "srm/control/guard/advance.hpp"
#include "srm/control/guard/fault.hpp"
#include "srm/control/guard/flux_bounds.hpp"

namespace srm {

/// Levels that may be others from sample to sample (firmware: parameters at run time).
template <Real T>
struct TripLevels {
  T i_trip;              // over-current [A]
  T u_dc_min, u_dc_max;  // [V]
  T omega_max;           // either direction [rad/s]
  T angle_slack;         // by which two angles may be wrong, one more than the other [rad]
  SRM_FIELDS(i_trip, u_dc_min, u_dc_max, omega_max, angle_slack)
};

template <Real T>
struct Protection {
  FluxBounds<T> flux;
  TripLevels<T> levels;
  Advance<T> advance;
  T i_zero;    // readings up to this are zero; below -i_zero they are out of range [A]
  int delay;   // samples from measurement to effect, 0 or 1
  int frozen;  // so many equal readings in a row are a fault; 0: none are
  SRM_FIELDS(flux, levels, advance, i_zero, delay, frozen)

  template <int N>
  struct State {
    Fault<T> fault;
    bool latched = false;
    bool has_last = false;
    std::uint8_t doubt = 0;  // 16 after a sample out of range, one less after each good one
    T theta_e{}, omega_m{};  // of the last sample
    typename Advance<T>::State advance{};
    std::array<T, N> i{};  // of the last sample [A]
    std::array<typename FluxBounds<T>::State, N> flux{};
    std::array<Expected<T>, N> acting{}, pending{};  // over the next sample, and the one after it
    std::array<std::uint8_t, N> same{};              // equal readings in a row
    std::array<std::uint8_t, N> off{};               // samples of a phase without current, up to 16
    std::array<bool, N> noisy{};                     // its readings differed then
  };

  /// True where the law may run on this sample. machine: as the controller knows it; at: the
  /// levels, its own or others. by_flux: the currents are held against the voltage; counted: the
  /// speed may come from the angle.
  template <bool by_flux = true, bool counted = true, Machine M, int N>
  constexpr bool admits(State<N>& x, const M& machine, const Measurement<T, N>& y, T reference,
                        const TripLevels<T>& at) const {
    if (x.latched) {
      if (x.fault.age + 1 != 0) ++x.fault.age;
      return false;
    }
    if (!in_range(y, reference, at)) {
      x.fault = cause(y, reference, at);
      x.latched = x.doubt > 0;
      x.doubt = 16;
      x.has_last = false;
      return false;
    }
    if (x.doubt > 0) --x.doubt;
    x.fault.status = Status::ok;
    if (x.has_last && !(follows<counted>(x, machine.N_r, y, at.angle_slack) &&
                        plausible<by_flux>(x, machine, y))) {
      x.latched = true;
      return false;
    }
    return true;
  }

  /// Keeps what the judgement of the next sample needs.
  template <int N>
  constexpr void remember(State<N>& x, int N_r, const Measurement<T, N>& y,
                          const std::type_identity_t<Command<T, N>>& command,
                          const TripLevels<T>& at) const {
    const T ahead = static_cast<T>(N_r) * y.omega_m * flux.T_s * static_cast<T>(1 + delay);
    if (!x.has_last) x.advance.kept = 0;
    for (int k = 0; k < N; ++k) {
      const Expected<T> order = expected(command[k], phase_angle_in_turn<N>(y.theta_e, k), ahead,
                                         at.angle_slack, flux.i_error, flux.T_s);
      if (!x.has_last) {
        x.flux[k] = {};
        x.pending[k] = {T(-1), T(1), never<T>, -never<T>};
        x.same[k] = 0;
      }
      x.acting[k] = delay > 0 ? x.pending[k] : order;
      x.pending[k] = order;
    }
    x.has_last = true;
    x.theta_e = y.theta_e;
    x.omega_m = y.omega_m;
    x.i = y.i;
  }

 private:
  /// Written so that NaN fails.
  template <int N>
  constexpr bool in_range(const Measurement<T, N>& y, T reference, const TripLevels<T>& at) const {
    bool good = y.theta_e >= T(0) && y.theta_e < two_pi<T> && abs(y.omega_m) <= at.omega_max &&
                y.u_dc >= at.u_dc_min && y.u_dc <= at.u_dc_max && is_finite(reference);
    for (int k = 0; k < N; ++k) good = good && y.i[k] >= -i_zero && y.i[k] <= at.i_trip;
    return good;
  }

  template <int N>
  [[gnu::cold, gnu::noinline]] constexpr Fault<T> cause(const Measurement<T, N>& y, T reference,
                                                        TripLevels<T> at) const {
    if (!is_finite(reference)) return {Status::not_a_number, -1, reference, T(0)};
    for (const T value : {y.theta_e, y.omega_m, y.u_dc}) {
      if (!is_finite(value)) return {Status::not_a_number, -1, value, T(0)};
    }
    for (int k = 0; k < N; ++k) {
      if (!is_finite(y.i[k])) return {Status::not_a_number, std::int8_t(k), y.i[k], T(0)};
    }
    for (int k = 0; k < N; ++k) {
      if (y.i[k] > at.i_trip) {
        return {Status::over_current, std::int8_t(k), y.i[k], at.i_trip};
      }
    }
    if (y.u_dc > at.u_dc_max) return {Status::over_voltage, -1, y.u_dc, at.u_dc_max};
    if (y.u_dc < at.u_dc_min) return {Status::under_voltage, -1, y.u_dc, at.u_dc_min};
    if (abs(y.omega_m) > at.omega_max) {
      return {Status::over_speed, -1, y.omega_m, at.omega_max};
    }
    for (int k = 0; k < N; ++k) {
      if (y.i[k] < -i_zero) {
        return {Status::sensor_out_of_range, std::int8_t(k), y.i[k], -i_zero};
      }
    }
    return {Status::sensor_out_of_range, -1, y.theta_e, two_pi<T>};
  }

  template <bool counted, int N>
  constexpr bool follows(State<N>& x, int N_r, const Measurement<T, N>& y, T slack) const {
    const T turned = (y.omega_m + x.omega_m) * (static_cast<T>(N_r) * flux.T_s / T(2));
    const T beyond =
        advance.template beyond<counted>(x.advance, x.theta_e, y.theta_e, turned, slack);
    if (beyond == T(0)) return true;
    x.fault = {Status::stuck_angle, -1, beyond, advance.most(slack)};
    return false;
  }

  template <bool by_flux, Machine M, int N>
  constexpr bool plausible(State<N>& x, const M& machine, const Measurement<T, N>& y) const {
    for (int k = 0; k < N; ++k) {
      typename FluxBounds<T>::State& bounds = x.flux[k];
      const T i = y.i[k];
      if constexpr (by_flux) flux.advance(bounds, x.acting[k], x.i[k], i, y.u_dc);
      if (i > i_zero) {
        if (frozen > 0) x.off[k] = 0;
        if constexpr (by_flux) {
          const T psi = machine.at(i, phase_angle_in_turn<N>(y.theta_e, k)).psi;
          const int side = flux.narrow(bounds, i, psi);
          if (side < 0) x.fault = {Status::current_too_low, std::int8_t(k), psi, bounds.least};
          if (side > 0) x.fault = {Status::current_too_high, std::int8_t(k), psi, bounds.most};
          if (side != 0) return false;
        }
        x.same[k] = i == x.i[k] ? static_cast<std::uint8_t>(x.same[k] + 1) : std::uint8_t(0);
        if (frozen > 0 && x.noisy[k] && x.same[k] >= frozen) {
          x.fault = {Status::frozen_current_sensor, std::int8_t(k), i, static_cast<T>(frozen)};
          return false;
        }
      } else {
        if (frozen > 0) listen(x, k, i);
        if (!by_flux || !(bounds.least > T(0))) continue;
        const T most = machine.at(i_zero + flux.i_error, phase_angle_in_turn<N>(y.theta_e, k)).psi;
        if (bounds.least > most) {
          x.fault = {Status::dead_current_sensor, std::int8_t(k), bounds.least, most};
          return false;
        }
      }
    }
    return true;
  }

  /// Whether noise moves the readings of a phase that has demagnetized at a reading of zero for 16
  /// samples: by then the voltage has taken what flux linkage a current below i_zero has.
  template <int N>
  constexpr void listen(State<N>& x, int k, T i) const {
    if (x.acting[k].most > T(-1)) {
      x.off[k] = 0;
    } else if (x.off[k] < 16) {
      ++x.off[k];
    } else if (i != x.i[k]) {
      x.noisy[k] = true;
    }
  }
};

}  // namespace srm
