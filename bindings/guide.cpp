// Python view of the guide of the predictive laws.
#include "guide.hpp"

#include <algorithm>
#include <functional>

namespace bound {

namespace {

using Cube = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

Guide guide(const Cube& values, double tau_max, const std::vector<double>& omega_m, double u_dc,
            double drop) {
  if (values.shape(0) != omega_m.size() || omega_m.empty() || omega_m.front() < 0 ||
      std::adjacent_find(omega_m.begin(), omega_m.end(), std::greater_equal{}) != omega_m.end()) {
    throw std::invalid_argument("need a speed >= 0 for each table, increasing");
  }
  if (!(drop >= 0 && drop < u_dc)) throw std::invalid_argument("need 0 <= drop < u_dc");
  if (values.shape(1) < 2) throw std::invalid_argument("need two levels, zero and tau_max");
  return {.values = {values.data(), values.data() + values.size()},
          .n_levels = int(values.shape(1)),
          .n_angles = int(values.shape(2)),
          .tau_max = tau_max,
          .omega = omega_m,
          .u_dc = u_dc,
          .drop = drop};
}

}  // namespace

void bind_guide(nb::module_& m) {
  nb::class_<Guide>(m, "Guide", "Profiles over torque, electrical angle and speed.")
      .def(
          "__init__",
          [](Guide* self, const Cube& values, double tau_max, const std::vector<double>& omega_m,
             double u_dc,
             double drop) { new (self) Guide(guide(values, tau_max, omega_m, u_dc, drop)); },
          nb::arg("values"), nb::kw_only(), nb::arg("tau_max"), nb::arg("omega_m"), nb::arg("u_dc"),
          nb::arg("drop") = 0.0,
          "values: (n_speeds, n_levels, n_angles), for the speeds omega_m [rad/s], increasing, the "
          "torques tau_max (j/(n_levels - 1))^2 [N m] and one electrical period, at u_dc [V]; "
          "drop: R i at their peak [V].")
      .def(
          "at",
          [](const Guide& self, double tau, double theta_e, double omega_m, double u_dc) {
            return GuideTables<double>(self).view().at(tau, omega_m, u_dc).at(srm::wrap(theta_e));
          },
          nb::arg("tau"), nb::arg("theta_e"), nb::kw_only(), nb::arg("omega_m"), nb::arg("u_dc"),
          "The value at a torque [N m], electrical angle [rad], speed [rad/s] and voltage [V].");
}

}  // namespace bound
