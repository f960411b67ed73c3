// What a run leaves behind: waveform rows, and one summary row per electrical period.
#pragma once

#include <vector>

#include "srm/sim/step.hpp"

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
  double* next() { return &values_[std::size_t(columns_) * size_++]; }

 private:
  int columns_, capacity_, size_ = 0;
  std::vector<double> values_;
};

/// Columns of a waveform row: t, theta_m, omega_m, tau_ref, then per phase i, leg, i_ref.
template <int N>
inline constexpr int waveform_columns = 4 + 3 * N;

/// Extremes within one electrical period; the integrals at its end stand beside them.
template <int N>
struct Extremes {
  double tau_min = 1e300, tau_max = -1e300;  // [N m]
  double omega_min = 1e300, omega_max = -1e300;
  double i_peak = 0;

  void include(const State<N>& x, double tau) {
    tau_min = min(tau_min, tau);
    tau_max = max(tau_max, tau);
    omega_min = min(omega_min, x.omega_m);
    omega_max = max(omega_max, x.omega_m);
    for (int k = 0; k < N; ++k) i_peak = max(i_peak, x.i[k]);
  }
};

/// What the switches have done so far. A switching loss that is linear in current and voltage needs
/// no more than the sums of u_dc i over the instants.
struct Switchings {
  double turn_ons = 0;  // of all switches
  double S_on = 0;      // sum of u_dc i over turn-ons [VA]
  double S_off = 0;     // over turn-offs

  /// A leg that rises by `levels` turns so many of its switches on; one that falls, off.
  void count(int levels, double u_dc, double i) {
    const double S = levels * u_dc * i;
    if (levels > 0) {
      turn_ons += levels;
      S_on += S;
    } else {
      S_off -= S;
    }
  }
};

/// Columns of a period row: t, theta_m, omega_m, W_f, turn_ons, S_on, S_off, tau_min, tau_max,
/// omega_min, omega_max, i_peak, then the integrals E_dc, E_winding, E_mech, tau, tau_squared,
/// error_squared, i_squared per phase, and tau_ref.
template <int N>
inline constexpr int period_columns = 19 + N;

template <int N>
void write_period(double* row, double t, const Point<N>& at, double W_f, const Switchings& s,
                  const Extremes<N>& e) {
  for (const double value :
       {t, at.x.theta_m, at.x.omega_m, W_f, s.turn_ons, s.S_on, s.S_off, e.tau_min, e.tau_max,
        e.omega_min, e.omega_max, e.i_peak, at.q.E_dc, at.q.E_winding, at.q.E_mech, at.q.tau,
        at.q.tau_squared, at.q.error_squared}) {
    *row++ = value;
  }
  for (int k = 0; k < N; ++k) *row++ = at.q.i_squared[k];
  *row = at.q.tau_ref;
}

}  // namespace srm
