// Whether one phase is unlike the others, by more than phases differ in a sound drive.
//
// What is wrong with the resistance, the map, the voltage and the zero of the angle is wrong in all
// phases alike. So the flux linkage that its voltage gives a phase is summed over a window of 30
// deg, electrical, and divided by what the map means at its readings. In good health these ratios
// differ between phases by what each may have of its own: the spread of the phases, noise and
// offset of the sensor, flux linkage of the others; and, where the strokes were unlike, by the
// common errors times the difference of what they act on:
//
//   |r_a - r_b| <= own_a + own_b + R_error |q_a - q_b| + u_error |t_a - t_b| + 2 map_error d
//
// q, t: what the resistance took and the time at full voltage, over the flux linkage; d: by how
// much the mean flux linkages differ, over the greater one, as far as which the error of the map
// may have changed. A phase that differs from all others is suspected. It is found when the next
// one, in a window in which it did, differs from it alone: an angle that drifts would make each
// phase differ from those before.
//
// Comparators leave the voltage open, and the sums with it: nothing is found there.
#pragma once

#include <array>
#include <cstdint>

#include "srm/base/fields.hpp"
#include "srm/base/real.hpp"

namespace srm {

template <Real T>
struct Likeness {
  T spread;     // by which a phase differs from the mean of all: flux linkage, resistance [1]
  T i_gain;     // of a reading [1]
  T i_noise;    // most noise of a reading [A]
  T i_offset;   // and what does not change with time [A]
  T u_noise;    // most noise of the voltage over a sample [Wb]
  T psi_error;  // flux linkage of the other phases [Wb]
  T R_error;    // common to all phases [1]
  T u_error;    // the same, over u_dc [1]
  T map_error;  // [1]
  int recent;   // samples after which a ratio is forgotten
  SRM_FIELDS(spread, i_gain, i_noise, i_offset, u_noise, psi_error, R_error, u_error, map_error,
             recent)

  static constexpr int windows = 12;  // of an electrical period

  /// One sample of a phase that conducts.
  struct Sample {
    T theta_e, i;
    T psi;    // by its voltage [Wb]
    T map;    // by its reading [Wb]
    T taken;  // by the resistance, since it had no flux linkage [Wb]
    T left;   // by which psi may be wrong besides [Wb]
    int age;  // samples since then
  };

  struct Sums {
    int n = 0, window = 0, age = 0;
    T psi{}, map{}, taken{}, left{}, i{};
  };

  struct Ratio {
    T is{}, own{}, R{}, u{}, map{};
    std::uint32_t at = 0;  // when it was found; 0: never
  };

  template <int N>
  struct State {
    std::array<Sums, N> sums{};
    std::array<std::array<Ratio, N>, windows> ratio{};
    int suspect = -1;
    std::uint32_t beyond = 0;  // the windows in which it differed from all others
    std::uint32_t now = 0;     // samples
  };

  /// All that was heard is forgotten.
  template <int N>
  constexpr void forget(State<N>& x) const {
    x.now += static_cast<std::uint32_t>(recent) + 1;
    x.suspect = -1;
    for (Sums& sum : x.sums) sum.n = 0;
  }

  /// Adds a sample of phase k.
  template <int N>
  constexpr void hears(State<N>& x, int k, const Sample& s) const {
    Sums& sum = x.sums[k];
    const int window = window_of(s.theta_e);
    if (window != sum.window) sum.n = 0;
    if (sum.n == 0) sum = {.window = window};
    ++sum.n;
    sum.age += s.age;
    sum.psi = sum.psi + s.psi;
    sum.map = sum.map + s.map;
    sum.taken = sum.taken + s.taken;
    sum.left = sum.left + s.left;
    sum.i = sum.i + s.i;
  }

  /// Whether phase k has left the window that its sums are of.
  template <int N>
  constexpr bool ends(const State<N>& x, int k, T theta_e) const {
    return N > 2 && x.sums[k].n >= 3 && window_of(theta_e) != x.sums[k].window;
  }

  /// Then: the phase that is unlike the others; less than 0 where none is known to be. u:
  /// volt-seconds of the dc link over a sample.
  template <int N>
  constexpr int concludes(State<N>& x, int k, T u) const {
    const int found = conclude(x, k, u);
    x.sums[k].n = 0;
    return found;
  }

 private:
  static constexpr int window_of(T theta_e) {
    return static_cast<int>(theta_e * (T(windows) / two_pi<T>));
  }

  template <int N>
  [[gnu::noinline]] constexpr int conclude(State<N>& x, int k, T u) const {
    const Sums& sum = x.sums[k];
    std::array<Ratio, N>& all = x.ratio[sum.window];
    const T n = static_cast<T>(sum.n), age = static_cast<T>(sum.age);
    const T part = T(1) / sum.map, R = sum.taken * part, offset = i_offset * n / sum.i;
    const T once = sqrt(n), noise = i_noise * once / sum.i;
    Ratio& r = all[k];
    r.is = sum.psi * part;
    r.own = (spread + i_gain + offset) * (T(1) + R) + noise +
            (psi_error * n + sum.left + u_noise * sqrt(age) * once) * part;
    r.R = R_error * R;
    r.u = u_error * u * age * part;
    r.map = sum.map / n;
    r.at = x.now;
    int beyond = 0, last = -1, higher = 0;
    for (int j = 0; j < N; ++j) {
      if (j == k) continue;
      const Ratio& other = all[j];
      if (other.at == 0 || x.now - other.at > static_cast<std::uint32_t>(recent)) return -1;
      const T far = T(2) * map_error * abs(r.map - other.map) / max(r.map, other.map);
      const T most = r.own + other.own + abs(r.R - other.R) + abs(r.u - other.u) + far;
      const T apart = r.is - other.is;
      if (!(abs(apart) > most)) continue;
      ++beyond;
      last = j;
      if (apart > T(0)) ++higher;
    }
    if (beyond == N - 1 && (higher == 0 || higher == beyond)) {
      x.beyond = (x.suspect == k ? x.beyond : 0U) | 1U << sum.window;
      x.suspect = k;
      return -1;
    }
    if (x.suspect < 0 || (x.beyond >> sum.window & 1) == 0) return -1;
    if (beyond == 1 && last == x.suspect) return last;
    x.suspect = -1;
    return -1;
  }
};

}  // namespace srm
