// At which angles a current can have a flux linkage: an arc, the end of which is searched by
// halving.
//
// The map is monotone from unaligned to aligned. So a phase that has at least a flux linkage with
// its current is within an arc around aligned, one that has at most so much within an arc around
// unaligned.
#pragma once

#include <cstdint>

#include "srm/base/angle.hpp"
#include "srm/machine/magnetics.hpp"

namespace srm {

template <Real T>
struct AngleSearch {
  static constexpr int most = 8;  // evaluations of the map: to 1.4 deg

  T psi{}, i{};        // of the sample where it began [Wb], [A]
  T theta_e{};         // shown then [rad]
  T low{}, high{};     // between which the end is, from unaligned [rad]
  int turn = 0;        // two for each phase: at least, and at most
  int steps = 0;       // evaluations to go
  bool found = false;  // an arc, or one that is searched

  constexpr bool least() const { return turn % 2 == 0; }
  constexpr int phase() const { return turn / 2; }
  constexpr bool ends() const { return steps == 0; }

  /// For the angles at which current i_now has flux linkage psi_now, at least or at most.
  constexpr void begin(T psi_now, T i_now, T shown) {
    psi = psi_now;
    i = i_now;
    theta_e = shown;
    low = T(0);
    high = pi<T>;
    steps = most;
    found = true;
  }

  /// Two evaluations of the map. False where there is no such angle; the search ends.
  template <Machine M>
  constexpr bool step(const M& machine) {
    if (steps == most) {
      const T extreme = machine.at(i, least() ? high : low).psi;
      if (least() ? extreme < psi : extreme > psi) {
        steps = 0;
        found = false;
        return false;
      }
    } else {
      halve(machine);
    }
    halve(machine);
    steps -= 2;
    return true;
  }

  /// The whole numbers of n on a circle that are in the arc of the phase, of N, each with half a
  /// step and error [rad] around it: a bit each. offset: added to the angle shown; reversed: less
  /// the angle shown.
  template <int n, int N>
  constexpr void narrow(std::uint32_t& offset, std::uint32_t& reversed, T error) const {
    constexpr T step = two_pi<T> / T(n);
    const T reach = (least() ? pi<T> - low : high) + error + step / T(2);
    const T from = (least() ? pi<T> : T(0)) + static_cast<T>(phase()) * two_pi<T> / T(N);
    offset &= arc<n>((from - theta_e) / step, reach / step);
    reversed &= arc<n>((from + theta_e) / step, reach / step);
  }

 private:
  template <Machine M>
  constexpr void halve(const M& machine) {
    const T half = (low + high) / T(2);
    T& end = machine.at(i, half).psi < psi ? low : high;
    end = half;
  }

  /// The whole numbers not further than reach, 1/2 or more, from a middle, on a circle: a bit each.
  template <int n>
  static constexpr std::uint32_t arc(T middle, T reach) {
    constexpr std::uint32_t all = (1U << n) - 1;
    const int first = -static_cast<int>(floor(reach - middle));
    const int count = static_cast<int>(floor(middle + reach)) - first + 1;
    if (count >= n) return all;
    const std::uint32_t bits = (1U << count) - 1;
    const int turned = (first % n + n) % n;
    return (bits << turned | bits >> (n - turned)) & all;
  }
};

}  // namespace srm
