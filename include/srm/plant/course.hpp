// A quantity over time: linear between given points, constant outside them.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "srm/base/fields.hpp"
#include "srm/plant/moving.hpp"

namespace srm {

/// An instant within an integration step that begins at `start`: a step never crosses a point of a
/// course, so the piece that holds at its start holds throughout.
struct Moment {
  double t, start;  // [s]
};

struct Course {
  std::vector<double> t;      // [s], not decreasing; two points at the same time make a step
  std::vector<double> value;  // as many
  SRM_FIELDS(t, value)

  double at(double time) const { return at(Moment{time, time}); }

  double at(Moment m) const {
    if (t.size() == 1) return value.front();
    const auto j = piece(m.start);
    if (j == 0) return value.front();
    if (j == t.size()) return value.back();
    return value[j - 1] + slope(j) * (m.t - t[j - 1]);
  }

  Moving moving(Moment m) const { return {at(m), rate(m.start)}; }

  /// Rate of change just after this time.
  double rate(double time) const {
    if (t.size() == 1) return 0;
    const auto j = piece(time);
    return j == 0 || j == t.size() ? 0 : slope(j);
  }

  /// The next point after this time; infinity where there is none.
  double next(double time) const {
    const auto j = piece(time);
    return j == t.size() ? std::numeric_limits<double>::infinity() : t[j];
  }

 private:
  /// Index of the first point after this time.
  std::size_t piece(double time) const {
    return std::size_t(std::upper_bound(t.begin(), t.end(), time) - t.begin());
  }
  double slope(std::size_t j) const { return (value[j] - value[j - 1]) / (t[j] - t[j - 1]); }
};

/// The same value at any time.
inline Course constant(double value) { return {{0}, {value}}; }

}  // namespace srm
