// What a run leaves behind: waveform rows, and one summary row per electrical period. The fields of
// the two structs are the columns of the tables.
#pragma once

#include <vector>

#include "srm/control/frame/flux_angle.hpp"
#include "srm/sim/columns.hpp"
#include "srm/sim/guard.hpp"

namespace srm {

/// A table of doubles with a fixed number of rows, filled row by row and emptied by the caller: the
/// loop itself never allocates.
class Rows {
 public:
  Rows(int columns, int capacity)
      : columns_(columns), capacity_(capacity), values_(std::size_t(columns) * capacity) {}

  bool full() const { return size_ == capacity_; }
  int size() const { return size_; }
  int columns() const { return columns_; }
  const double* data() const { return values_.data(); }
  void clear() { size_ = 0; }
  /// A row as the struct that it was.
  template <class S>
  S row(int j) const {
    S s;
    read_columns(s, &values_[std::size_t(columns_) * j]);
    return s;
  }
  /// Adds a struct of as many columns.
  template <class S>
  void add(const S& row) {
    write_columns(row, &values_[std::size_t(columns_) * size_++]);
  }

 private:
  int columns_, capacity_, size_ = 0;
  std::vector<double> values_;
};

/// One instant of the waveforms; per phase the machine's answers as well.
template <int N>
struct Waveform {
  double t{};                      // [s]
  double theta_m{};                // rotor angle [rad]
  double omega_m{};                // rotor speed [rad/s]
  double u_dc{};                   // dc-link voltage [V]
  double tau_ref{};                // torque reference; 0 where the law has none [N m]
  double tau{};                    // machine torque [N m]
  std::array<double, N> i{};       // phase currents [A]
  std::array<double, N> i_ref{};   // current references [A]
  std::array<double, N> leg{};     // what the windings see: 1, 0, -1
  std::array<double, N> u{};       // winding voltages [V]; 0 where the diodes block
  std::array<double, N> psi{};     // flux linkages [Wb]
  std::array<double, N> tau_ph{};  // phase torques [N m]
  SRM_FIELDS(t, theta_m, omega_m, u_dc, tau_ref, tau, i, i_ref, leg, u, psi, tau_ph)
};

/// The same of a control that follows the rotor by the flux linkages.
template <int N>
struct FollowedWaveform {
  Waveform<N> waveform;
  FluxEstimate<double> estimate;
  SRM_FIELDS(waveform, estimate)
};

/// Extremes within one electrical period.
struct Extremes {
  double tau_min = 1e300, tau_max = -1e300;      // [N m]
  double omega_min = 1e300, omega_max = -1e300;  // [rad/s]
  double u_min = 1e300, u_max = -1e300;          // dc-link voltage [V]
  double i_peak = 0;                             // [A]
  SRM_FIELDS(tau_min, tau_max, omega_min, omega_max, u_min, u_max, i_peak)

  /// A step of length h from a to b: its start, and what lies between.
  template <int N>
  void include(const Rates<N>& a, const Rates<N>& b, double h) {
    span(tau_min, tau_max, a.tau, b.tau, h);
    span(omega_min, omega_max, a.omega_m, b.omega_m, h);
    span(u_min, u_max, a.u_dc, b.u_dc, h);
    for (int k = 0; k < N; ++k) include(a.i[k], b.i[k], h);
  }

  /// Speed and voltage of an instant.
  template <class S>
  void include_held(const S& at) {
    omega_min = min(omega_min, at.omega_m);
    omega_max = max(omega_max, at.omega_m);
    u_min = min(u_min, at.u_dc);
    u_max = max(u_max, at.u_dc);
  }

  /// An instant, as a step that ends there leaves it out.
  template <int N>
  void include(const Waveform<N>& row) {
    include_held(row);
    tau_min = min(tau_min, row.tau);
    tau_max = max(tau_max, row.tau);
    for (const double i : row.i) i_peak = max(i_peak, i);
  }

  /// The torque from a to b in a time h.
  void include_torque(const Moving& a, const Moving& b, double h) {
    span(tau_min, tau_max, a, b, h);
  }

  /// A current.
  void include(const Moving& a, const Moving& b, double h) {
    i_peak = max(i_peak, a.now);
    if (a.rate > 0 && b.rate < 0) i_peak = max(i_peak, extreme(a, b, h));
  }

 private:
  static void span(double& least, double& most, const Moving& a, const Moving& b, double h) {
    least = min(least, a.now);
    most = max(most, a.now);
    if (a.rate * b.rate < 0) {
      const double turn = extreme(a, b, h);
      least = min(least, turn);
      most = max(most, turn);
    }
  }
};

/// The end of an electrical period: extremes within it; integrals and switchings since the start.
template <int N>
struct Period {
  double t{};        // [s]
  double theta_m{};  // [rad]
  double omega_m{};  // [rad/s]
  double W_f{};      // field energy [J]
  double W_dc{};     // energy of the dc link [J]
  Switchings switchings;
  Extremes extremes;
  Integrals<N> integrals;
  SRM_FIELDS(t, theta_m, omega_m, W_f, W_dc, switchings, extremes, integrals)
};

}  // namespace srm
