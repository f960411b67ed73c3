// Machine models: parameters, and their magnetics over arrays.
#include "bindings.hpp"
#include "srm/machine/inverse.hpp"
#include "srm/sim/flux_map_table.hpp"

namespace bound {

namespace {

using LeHuy = srm::Held<srm::LeHuy<double>>;
using Map = srm::Held<srm::FluxMap<double>>;
using Values = nb::ndarray<nb::numpy, double>;

/// (n, 5): psi, W_c, tau, L_inc, psi_theta at n pairs of current and angle.
Values magnetics(const AnyMachine& machine, const Array<1>& i, const Array<1>& theta_e) {
  const std::size_t n = i.shape(0);
  if (theta_e.shape(0) != n) throw std::invalid_argument("i and theta_e differ in length");
  std::vector<double> rows;
  rows.reserve(5 * n);
  std::visit(
      [&](const auto& m) {
        for (std::size_t j = 0; j < n; ++j) {
          const auto at = m.value.at(i.data()[j], srm::wrap(theta_e.data()[j]));
          rows.insert(rows.end(), {at.psi, at.W_c, at.tau, at.L_inc, at.psi_theta});
        }
      },
      machine);
  return numpy(std::move(rows), {n, 5});
}

Values current(const Map& machine, const Array<1>& psi, const Array<1>& theta_e, double i_max) {
  const std::size_t n = psi.shape(0);
  if (theta_e.shape(0) != n) throw std::invalid_argument("psi and theta_e differ in length");
  std::vector<double> values(n);
  for (std::size_t j = 0; j < n; ++j) {
    const double angle = srm::wrap(theta_e.data()[j]);
    values[j] = srm::current_from_flux(machine.value, psi.data()[j], angle, i_max);
  }
  return numpy(std::move(values), {n});
}

Map flux_map(int N_r, const Array<1>& knot, const Array<3>& coefficient, double theta_span) {
  if (coefficient.shape(0) != knot.shape(0) || coefficient.shape(2) != 5) {
    throw std::invalid_argument("coefficients need the shape (n_i, n_theta + 3, 5)");
  }
  return srm::flux_map(N_r, {knot.data(), knot.data() + knot.size()},
                       {coefficient.data(), coefficient.data() + coefficient.size()}, theta_span);
}

constexpr const char* columns =
    "Columns psi [Wb], W_c [J], tau [N m], L_inc [H], psi_theta [Wb/rad], shape (n, 5), at n "
    "currents [A] and electrical angles [rad] of one phase.";

template <class V>
std::vector<V> copied(const srm::View<V>& view) {
  return {view.data, view.data + view.size};
}

}  // namespace

void bind_machine(nb::module_& m) {
  auto lehuy =
      nb::class_<LeHuy>(m, "LeHuy", "Analytic machine of Le-Huy and Brunelle (IECON 2005).");
  lehuy
      .def(nb::new_([](int N_r, double L_u, double L_a, double L_sat, double i_m, double psi_m) {
             return LeHuy{srm::lehuy<double>(N_r, L_u, L_a, L_sat, i_m, psi_m), nullptr};
           }),
           nb::kw_only(), nb::arg("N_r"), nb::arg("L_u"), nb::arg("L_a"), nb::arg("L_sat"),
           nb::arg("i_m"), nb::arg("psi_m"),
           "From unaligned and unsaturated aligned inductance, saturated slope [H] and one point "
           "(i_m, psi_m) of the aligned curve [A, Wb].")
      .def_prop_ro("N_r", [](const LeHuy& m) { return m.value.N_r; })
      .def_prop_ro("L_u", [](const LeHuy& m) { return m.value.L_u; })
      .def_prop_ro("L_sat", [](const LeHuy& m) { return m.value.L_sat; })
      .def_prop_ro("A", [](const LeHuy& m) { return m.value.A; })
      .def_prop_ro("B", [](const LeHuy& m) { return m.value.B; })
      .def("magnetics", &magnetics, nb::arg("i"), nb::arg("theta_e"), columns);
  nb::class_<Map>(m, "FluxMap",
                  "Measured or computed machine: one co-energy spline over current and angle.")
      .def(nb::new_(&flux_map), nb::kw_only(), nb::arg("N_r"), nb::arg("knots"),
           nb::arg("coefficients"), nb::arg("theta_span"),
           "From knots (n_i) [A], co-energy coefficients (n_i, n_theta + 3, 5) [J/A^p] and the "
           "angle they span, pi or 2 pi. Raises ValueError unless the flux provably rises with "
           "current.")
      .def_prop_ro("N_r", [](const Map& m) { return m.value.N_r; })
      .def_prop_ro(
          "i_last", [](const Map& m) { return srm::i_last(m.value); },
          "Last current of the table [A]; beyond it the flux keeps its last slope.")
      .def_prop_ro("theta_span", [](const Map& m) { return m.value.theta_span; })
      .def_prop_ro(
          "inductance_bound", [](const Map& m) { return srm::inductance_bound(m.value); },
          "Proven lower bound of the incremental inductance [H].")
      .def_prop_ro(
          "knots",
          [](const Map& m) {
            return numpy(copied(m.value.knot), {std::size_t(m.value.knot.size)});
          },
          nb::rv_policy::move, "Start of each current piece, shape (n_i,) [A].")
      .def_prop_ro(
          "coefficients",
          [](const Map& m) {
            return numpy(copied(m.value.coefficient),
                         {std::size_t(m.value.n_i), std::size_t(m.value.n_theta + 3), 5});
          },
          nb::rv_policy::move, "Shape (n_i, n_theta + 3, 5) [J/A^p].")
      .def_prop_ro(
          "pieces", [](const Map& m) { return nb::bytes(m.value.piece.data, m.value.piece.size); },
          "Piece of each current slot, one byte a slot.")
      .def("magnetics", &magnetics, nb::arg("i"), nb::arg("theta_e"), columns)
      .def("current", &current, nb::arg("psi"), nb::arg("theta_e"), nb::arg("i_max"),
           "Current in [0, i_max] at flux psi and angle theta_e, shape (n,) [A].");
  m.def("magnetics", &magnetics, nb::arg("machine"), nb::arg("i"), nb::arg("theta_e"), columns);
}

}  // namespace bound
