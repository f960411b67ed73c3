// What the plant remembers, and arithmetic on it: x + h dx is written here once, for any struct of
// numbers with a field list.
#pragma once

#include <array>
#include <tuple>

#include "srm/base/fields.hpp"

namespace srm {

/// The state (eq. 2.4 of the paper, and the dc-link voltage).
template <int N>
struct State {
  std::array<double, N> i{};  // phase currents [A], never negative
  double omega_m{};           // rotor speed [rad/s]
  double theta_m{};           // rotor angle [rad], grows without wrapping
  double u_dc{};              // dc-link voltage [V]
  SRM_FIELDS(i, omega_m, theta_m, u_dc)
};

/// Field number n of a struct.
template <std::size_t n, class S>
constexpr auto& field(S& s) {
  return fields_of(
      s, [](auto... f) -> auto& { return std::get<n>(std::forward_as_tuple(f.value...)); });
}

/// to = f(from...), number by number, for structs of the same kind.
template <class F, class S, class... V>
constexpr void each(const F& f, S& to, const V&... from) {
  if constexpr (Listed<S>) {
    const auto nth = [&]<std::size_t n>() { each(f, field<n>(to), field<n>(from)...); };
    fields_of(to, [&]<class... W>(Field<W>...) {
      [&]<std::size_t... n>(std::index_sequence<n...>) { (nth.template operator()<n>(), ...); }
      (std::index_sequence_for<W...>());
    });
  } else if constexpr (requires { to[0]; }) {
    for (std::size_t j = 0; j < to.size(); ++j) each(f, to[j], from[j]...);
  } else {
    to = f(from...);
  }
}

/// x + h dx.
template <class S>
constexpr S moved(const S& x, const S& dx, double h) {
  S y;
  each([h](double a, double d) { return a + h * d; }, y, x, dx);
  return y;
}

}  // namespace srm
