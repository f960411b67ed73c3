// Protection: each sample is judged before the control law sees it. A fault switches all legs off
// (demagnetize) in the same step, is latched with its cause, and lasts until an explicit reset.
//
// Ranges are known within the sample. The two sensor faults are contradictions between sensors, and
// are found as soon as one exists:
//
// Stuck angle. The angle has to advance by N_r omega_m T_s a sample. What it does not is the slip;
// it is summed, and forgotten by 1/64 a sample, so that a speed error of 1 % never adds up to one
// sample's advance. The fault is |slip| > angle_slack: one sample after the angle freezes where a
// sample turns the rotor further than that, ceil(angle_slack/advance) samples when slower, never
// below angle_slack/64 a sample. The slack has to cover the steps of the encoder. It takes a speed
// that does not come from the same angle within the same sample: another sensor, or an observer
// that forgets slowly against the sample.
//
// Dead current sensor. While the reading is zero, the flux linkage that the phase has at least is
// kept: the model's at the last reading above zero, less what the dc link can remove, plus what it
// must have added in every sample that magnetized the phase from end to end. The fault is a flux
// above the model's at i_zero. A sensor that dies in a current that u_dc cannot remove in a sample
// is found at the next sample. One that was dead before is found at the first sample at which the
// current, by the model and 80 % of the voltage, has passed i_zero: near the unaligned angle that
// is one sample of magnetization, at the aligned one several, with less than 1.25 i_zero flowing.
// Current references below 1.25 i_zero tell nothing, and delay it by as long as they last.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/frame/interface.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

/// Numbers are part of the C interface.
enum class Status : std::int8_t {
  ok = 0,
  not_a_number = 1,
  over_current = 2,
  over_voltage = 3,
  under_voltage = 4,
  over_speed = 5,
  sensor_out_of_range = 6,
  stuck_angle = 7,
  dead_current_sensor = 8
};

constexpr const char* describe(Status status) {
  switch (status) {
    case Status::ok:
      return "ok";
    case Status::not_a_number:
      return "a measurement or the reference is not a finite number";
    case Status::over_current:
      return "a phase current is above its trip level";
    case Status::over_voltage:
      return "the dc-link voltage is above its limit";
    case Status::under_voltage:
      return "the dc-link voltage is below its limit";
    case Status::over_speed:
      return "the speed is above its limit";
    case Status::sensor_out_of_range:
      return "a current is negative, or the angle is outside [0, 2 pi)";
    case Status::stuck_angle:
      return "the angle does not advance as the speed says";
    case Status::dead_current_sensor:
      return "a magnetized phase shows no current";
  }
  return "unknown";
}

/// Every leg off.
template <Real T, int N>
constexpr Command<T, N> all_off() {
  Command<T, N> command;
  for (PhaseCommand<T>& phase : command) phase = hold<T>(Leg::demagnetize);
  return command;
}

template <Machine M, int N>
struct Protection {
  using T = typename M::Scalar;

  M machine;
  T R;                   // phase resistance [ohm]
  T i_trip;              // over-current [A]
  T i_zero;              // readings up to this are zero; below -i_zero they are out of range [A]
  T u_dc_min, u_dc_max;  // [V]
  T omega_max;           // either direction [rad/s]
  T angle_slack;  // what the angle may differ from the integral of the speed, electrical [rad]
  T T_s;          // control period [s]
  int delay;      // samples from measurement to effect, 0 or 1
  int settle;     // samples before the speed can judge the angle: an observer has to find it first
  SRM_FIELDS(machine, R, i_trip, i_zero, u_dc_min, u_dc_max, omega_max, angle_slack, T_s, delay,
             settle)

  struct State {
    Status status = Status::ok;
    bool has_last = false;               // the fields below hold a sample
    T theta_e{}, omega_m{};              // of the last sample
    T slip{};                            // [rad]
    int age = 0;                         // samples seen, up to `settle`
    std::array<T, N> i{};                // of the last sample [A]
    std::array<T, N> psi{};              // least flux of a phase that reads zero [Wb]
    std::array<std::uint8_t, N> sure{};  // bit 0: the orders of the last sample magnetize all
                                         // through; bit 1: of the one before
  };

  /// True where the law may run on this sample.
  constexpr bool admits(State& x, const Measurement<T, N>& y, T reference) const {
    if (x.status != Status::ok) return false;
    if (!in_range(y, reference)) {
      x.status = cause(y, reference);
    } else if (x.has_last) {
      if (settle > 0 && x.age < settle) {
        ++x.age;
      } else if (!follows(x, y)) {
        x.status = Status::stuck_angle;
      }
      for (int k = 0; k < N; ++k) {
        if (y.i[k] <= i_zero && !may_be_zero(x, y, k)) x.status = Status::dead_current_sensor;
      }
    }
    return x.status == Status::ok;
  }

  /// Keeps what the judgement of the next sample needs.
  constexpr void remember(State& x, const Measurement<T, N>& y,
                          const Command<T, N>& command) const {
    x.has_last = true;
    x.theta_e = y.theta_e;
    x.omega_m = y.omega_m;
    const T ahead = static_cast<T>(machine.N_r) * y.omega_m * T_s * static_cast<T>(1 + delay);
    for (int k = 0; k < N; ++k) {
      x.i[k] = y.i[k];
      const bool sure = y.i[k] <= i_zero && magnetizes(command[k], y.theta_e, ahead, k);
      const int older = delay > 0 ? x.sure[k] << 1 : 0;
      x.sure[k] = static_cast<std::uint8_t>(older | (sure ? 1 : 0));
    }
  }

 private:
  /// Written so that NaN fails.
  constexpr bool in_range(const Measurement<T, N>& y, T reference) const {
    bool good = y.theta_e >= T(0) && y.theta_e < two_pi<T> && abs(y.omega_m) <= omega_max &&
                y.u_dc >= u_dc_min && y.u_dc <= u_dc_max && is_finite(reference);
    for (int k = 0; k < N; ++k) good = good && y.i[k] >= -i_zero && y.i[k] <= i_trip;
    return good;
  }

  [[gnu::cold, gnu::noinline]] constexpr Status cause(const Measurement<T, N>& y,
                                                      T reference) const {
    bool finite =
        is_finite(y.theta_e) && is_finite(y.omega_m) && is_finite(y.u_dc) && is_finite(reference);
    for (int k = 0; k < N; ++k) finite = finite && is_finite(y.i[k]);
    if (!finite) return Status::not_a_number;
    for (int k = 0; k < N; ++k) {
      if (y.i[k] > i_trip) return Status::over_current;
    }
    if (y.u_dc > u_dc_max) return Status::over_voltage;
    if (y.u_dc < u_dc_min) return Status::under_voltage;
    if (abs(y.omega_m) > omega_max) return Status::over_speed;
    return Status::sensor_out_of_range;
  }

  constexpr bool follows(State& x, const Measurement<T, N>& y) const {
    T advance = y.theta_e - x.theta_e;
    if (advance > pi<T>) advance = advance - two_pi<T>;
    if (advance < -pi<T>) advance = advance + two_pi<T>;
    const T expected = (y.omega_m + x.omega_m) * (static_cast<T>(machine.N_r) * T_s / T(2));
    x.slip = x.slip * T(63.0 / 64) + (advance - expected);
    return abs(x.slip) <= angle_slack;
  }

  /// wrap(), for angles within a turn of [0, 2 pi) and where 2 pi itself does no harm.
  static constexpr T one_turn(T theta) { return theta < T(0) ? theta + two_pi<T> : theta; }

  static constexpr T phase(T theta_e, int k) {
    return one_turn(theta_e - static_cast<T>(k) * (two_pi<T> / static_cast<T>(N)));
  }

  constexpr bool may_be_zero(State& x, const Measurement<T, N>& y, int k) const {
    const bool sure = (x.sure[k] >> delay & 1) != 0;
    const T i = x.i[k];
    T least = x.psi[k];
    if (i > i_zero) {
      const T u = T(1.2) * y.u_dc + R * i;  // a fifth for the diodes and for sensor errors
      least = machine.at(i, phase(x.theta_e, k)).psi - T_s * u;
    } else if (sure) {
      least = least + T_s * (T(0.8) * y.u_dc);
    } else if (least > T(0)) {
      least = least - T_s * (T(1.2) * y.u_dc);
    }
    x.psi[k] = max(least, T(0));
    return !(least > T(0)) || least <= machine.at(i_zero, phase(y.theta_e, k)).psi;
  }

  /// True where the orders magnetize a phase that reads zero until it has travelled `ahead`.
  constexpr bool magnetizes(const PhaseCommand<T>& c, T theta_e, T ahead, int k) const {
    if (c.gate == Gate::timer) {
      for (const Leg leg : c.leg) {
        if (leg != Leg::magnetize) return false;
      }
      return true;
    }
    if (!(c.i_ref > T(0) && c.i_ref - min(c.i_band, c.i_ref / T(2)) > T(1.25) * i_zero)) {
      return false;  // a phase held there may well read zero
    }
    if (c.gate == Gate::comparator) return true;
    const T past = one_turn(phase(theta_e, k) - c.theta_on);
    const T dwell = one_turn(c.theta_off - c.theta_on);
    return past < dwell && past + ahead >= T(0) && past + ahead < dwell;
  }
};

}  // namespace srm
