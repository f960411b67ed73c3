// Python view of the reference profile (guide) of the predictive laws, and the weight that follows
// from it.
#include <nanobind/stl/optional.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "bindings.hpp"
#include "srm/control/part/switching_weight.hpp"

namespace bound {

namespace {

using Profiles = srm::Held<srm::ReferenceProfile<double>>;

Profiles profiles_of(const Array<4>& values, double tau_max, const std::vector<double>& omega_m,
                     double u_dc, double drop, const std::optional<Array<4>>& mutual,
                     const std::vector<int>& mirrored) {
  if (values.shape(1) != omega_m.size() || omega_m.empty() || omega_m.front() < 0 ||
      std::adjacent_find(omega_m.begin(), omega_m.end(), std::greater_equal{}) != omega_m.end()) {
    throw std::invalid_argument("need a speed >= 0 for each table, increasing");
  }
  if (!(drop >= 0 && drop < u_dc)) throw std::invalid_argument("need 0 <= drop < u_dc");
  if (values.shape(2) < 2) throw std::invalid_argument("need two levels, zero and tau_max");
  srm::Tables memory;
  const auto kept = [&](const Array<4>& table) {
    return memory.keep<double>(std::vector<double>(table.data(), table.data() + table.size()));
  };
  if (mutual && mutual->size() != values.size()) {
    throw std::invalid_argument("mutual and values differ in size");
  }
  const auto is_set = [&](int set) { return set >= 0 && std::size_t(set) < values.shape(0); };
  const bool sets = mirrored.empty() ? values.shape(0) == 1
                                     : mutual && values.shape(0) >= mirrored.size() &&
                                           std::all_of(mirrored.begin(), mirrored.end(), is_set);
  if (!sets) throw std::invalid_argument("need profiles for all, or of each phase with mutual");
  const srm::ReferenceProfile<double> view{
      .first = {.values = kept(values),
                .rows = int(values.shape(2)),
                .columns = int(values.shape(3)),
                .level_max = tau_max},
      .omega = memory.keep<double>(omega_m),
      .u_dc = u_dc,
      .drop = drop,
      .mutual = mutual ? kept(*mutual) : srm::View<double>{},
      .mirrored =
          memory.keep<std::uint8_t>(std::vector<std::uint8_t>(mirrored.begin(), mirrored.end()))};
  return {view, memory.owner()};
}

double switching_weight(const AnyMachine& machine, const Profiles& guide, double R, double tau_ref,
                        double omega_m, double u_dc, double i_max, double f_switch) {
  const srm::Profile<double> profile = guide.value.at(tau_ref, omega_m, u_dc);
  return std::visit(
      [&](const auto& m) {
        return srm::switching_weight(m.value, profile, R, omega_m, u_dc, i_max, f_switch);
      },
      machine);
}

}  // namespace

void bind_reference_profile(nb::module_& m) {
  nb::class_<Profiles>(m, "ReferenceProfile", "Profiles over torque, electrical angle and speed.")
      .def(
          nb::new_(&profiles_of), nb::arg("values"), nb::kw_only(), nb::arg("tau_max"),
          nb::arg("omega_m"), nb::arg("u_dc"), nb::arg("drop") = 0.0,
          nb::arg("mutual") = nb::none(), nb::arg("mirrored") = std::vector<int>{},
          "values: (1 or n_phases or more, n_speeds, n_levels, n_angles), for the speeds omega_m "
          "[rad/s], "
          "increasing, the torques tau_max (j/(n_levels - 1))^2 [N m] and one electrical period, "
          "at u_dc [V]; drop: R i at their peak [V]; mutual: flux linkage that neighbouring phases "
          "add [Wb], of the same shape, where phases couple; mirrored: (n_phases), which of them a "
          "phase has at a torque of the other sense, where each has its own.")
      .def(
          "at",
          [](const Profiles& self, double tau, double theta_e, double omega_m, double u_dc) {
            return self.value.at(tau, omega_m, u_dc).at(srm::wrap(theta_e));
          },
          nb::arg("tau"), nb::arg("theta_e"), nb::kw_only(), nb::arg("omega_m"), nb::arg("u_dc"),
          "The value at a torque [N m], electrical angle [rad], speed [rad/s] and voltage [V].");
  m.def("switching_weight", &switching_weight, nb::arg("machine"), nb::kw_only(), nb::arg("guide"),
        nb::arg("R"), nb::arg("tau_ref"), nb::arg("omega_m"), nb::arg("u_dc"), nb::arg("i_max"),
        nb::arg("f_switch"),
        "Cost of a turn-on [N^2 m^2 s] that makes about f_switch [Hz] per switch.");
}

}  // namespace bound
