// What feeds the dc link. Its voltage is a state of the plant; a source says how it changes.
//
// To add one: a struct with `about` and these five functions, and its name in `Source` at the end.
#pragma once

#include <cmath>
#include <variant>

#include "srm/plant/course.hpp"
#include "srm/plant/feed.hpp"
#include "srm/plant/pv_array.hpp"

namespace srm {

/// A dc link that holds its voltage whatever it is asked for; the voltage may follow a course. The
/// source gives the mean of i_dc, the capacitor what is left.
struct StiffSource {
  static constexpr const char* about = "A dc link that holds its voltage [V].";
  Course u_dc;  // [V]
  SRM_FIELDS(u_dc)

  double start() const { return u_dc.at(0); }
  Feed feed(double u, const Moving& i_dc, Moment m) const {
    const double du = u_dc.rate(m.start);
    return {du, i_dc, -i_dc, Moving{u, du} * i_dc, 0};
  }
  double stored(double) const { return 0; }
  double next(double t) const { return u_dc.next(t); }
  double forced(double, double t) const { return u_dc.at(t); }
};

/// A battery or rectifier as a voltage behind a resistance, with a dc-link capacitor:
///   C du/dt = (E - u)/R - i_dc
struct Battery {
  static constexpr const char* about =
      "Open-circuit voltage [V] behind R [ohm], dc-link capacitor C [F].";
  Course E;              // open-circuit voltage [V]
  double R;              // of battery and cable [ohm]
  double C;              // of the dc link [F]
  bool one_way = false;  // a rectifier feeds, and never takes back
  SRM_FIELDS(E, R, C, one_way)

  double start() const { return E.at(0); }
  Feed feed(double u, const Moving& i_dc, Moment m) const {
    const Moving e = E.moving(m);
    const bool blocks = one_way && u > e.now;
    const double i_now = blocks ? 0 : (e.now - u) / R;
    const double du = (i_now - i_dc.now) / C;
    const Moving i = blocks ? Moving{} : Moving{i_now, (e.rate - du) / R};
    return {1 / C * (i - i_dc), i, i - i_dc, e * i, R * i * i};
  }
  double stored(double u) const { return C * u * u / 2; }
  double next(double t) const { return E.next(t); }
  double forced(double u, double) const { return u; }
};

using Source = std::variant<StiffSource, Battery, PvArray>;

inline double start(const Source& s) {
  return std::visit([](const auto& source) { return source.start(); }, s);
}

/// At dc-link voltage u [V] and the current i_dc that the bridge draws [A].
inline Feed feed(const Source& s, double u, const Moving& i_dc, Moment m) {
  return std::visit([&](const auto& source) { return source.feed(u, i_dc, m); }, s);
}

/// Energy stored in the dc link [J].
inline double stored(const Source& s, double u) {
  return std::visit([&](const auto& source) { return source.stored(u); }, s);
}

/// When the source changes its course next [s].
inline double next_change(const Source& s, double t) {
  return std::visit([&](const auto& source) { return source.next(t); }, s);
}

/// The dc-link voltage at t where the source imposes it; else u.
inline double forced(const Source& s, double u, double t) {
  return std::visit([&](const auto& source) { return source.forced(u, t); }, s);
}

}  // namespace srm
