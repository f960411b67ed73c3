// The guide of the predictive laws, from Python to the precision of the law.
#pragma once

#include "bindings.hpp"
#include "srm/control/guide.hpp"

namespace bound {

struct Guide {
  std::vector<double> values;  // (n_speeds, n_levels, n_angles)
  int n_levels, n_angles;
  double tau_max;             // of the highest level [N m]
  std::vector<double> omega;  // of each speed [rad/s]
  double u_dc, drop;          // of the profiles, and R i at their peak [V]
};

/// A guide in the law's precision, and the law's numbers at each of its speeds. The law points into
/// them, so they live as long as the controller that holds them.
template <srm::Real T>
class GuideTables {
 public:
  explicit GuideTables(const Guide& guide)
      : n_speeds_(guide.omega.size()),
        view_{{keep(guide.values), guide.n_levels, guide.n_angles, T(guide.tau_max)},
              keep(guide.omega),
              int(guide.omega.size()),
              T(guide.u_dc),
              T(guide.drop)} {}

  const srm::Guide<T>& view() const { return view_; }

  const T* per_speed(const std::vector<double>& values) {
    if (values.size() != n_speeds_) throw std::invalid_argument("need a value for each speed");
    return keep(values);
  }

  std::shared_ptr<void> memory() const { return held_; }

 private:
  const T* keep(const std::vector<double>& values) {
    held_->emplace_back(values.begin(), values.end());
    return held_->back().data();
  }

  std::shared_ptr<std::vector<std::vector<T>>> held_ =
      std::make_shared<std::vector<std::vector<T>>>();
  std::size_t n_speeds_;
  srm::Guide<T> view_;
};

}  // namespace bound
