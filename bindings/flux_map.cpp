// Measured machines: the flux map from its tables, evaluated and inverted over arrays.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include "flux_map_table.hpp"
#include "srm/machine/inverse.hpp"

namespace bound {

namespace nb = nanobind;

namespace {

using Map = FluxMapTable<double>;
using Values = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Cube = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Output = nb::ndarray<nb::numpy, double>;

Output output(double* values, std::initializer_list<std::size_t> shape) {
  nb::capsule owner(values, [](void* p) noexcept { delete[] static_cast<double*>(p); });
  return Output(values, shape, owner);
}

std::size_t common_length(const Values& a, const Values& b) {
  if (a.shape(0) != b.shape(0)) throw std::invalid_argument("the two arrays differ in length");
  return a.shape(0);
}

/// (n, 5): psi, W_c, tau, L_inc, psi_theta, computed in precision T.
template <srm::Real T>
Output magnetics(const Map& machine, const Values& i, const Values& theta_e) {
  const std::size_t n = common_length(i, theta_e);
  const FluxMapTable<T> m = in_precision<T>(machine);
  auto* values = new double[n * 5];
  for (std::size_t j = 0; j < n; ++j) {
    const srm::Magnetics<T> y = m.at(T(i.data()[j]), srm::wrap(T(theta_e.data()[j])));
    double* row = values + 5 * j;
    for (const T value : {y.psi, y.W_c, y.tau, y.L_inc, y.psi_theta}) *row++ = double(value);
  }
  return output(values, {n, 5});
}

template <srm::Real T>
Output current(const Map& machine, const Values& psi, const Values& theta_e, double i_max) {
  const std::size_t n = common_length(psi, theta_e);
  const FluxMapTable<T> m = in_precision<T>(machine);
  auto* values = new double[n];
  for (std::size_t j = 0; j < n; ++j) {
    const T angle = srm::wrap(T(theta_e.data()[j]));
    values[j] = double(srm::current_from_flux(m, T(psi.data()[j]), angle, T(i_max)));
  }
  return output(values, {n});
}

Output knots(const Map& m) {
  auto* values = new double[m.tables->knot.size()];
  std::copy(m.tables->knot.begin(), m.tables->knot.end(), values);
  return output(values, {m.tables->knot.size()});
}

Output coefficients(const Map& m) {
  const std::vector<double>& c = m.tables->coefficient;
  auto* values = new double[c.size()];
  std::copy(c.begin(), c.end(), values);
  return output(values, {std::size_t(m.map.n_i), std::size_t(m.map.n_theta + 3), 5});
}

}  // namespace

void bind_flux_map(nb::module_& module) {
  nb::class_<Map>(module, "FluxMap",
                  "Measured or computed machine: one co-energy spline over current and angle.")
      .def(nb::new_([](int N_r, const Values& knot, const Cube& coefficient, double theta_span) {
             if (coefficient.shape(0) != knot.shape(0) || coefficient.shape(2) != 5) {
               throw std::invalid_argument("coefficients need the shape (n_i, n_theta + 3, 5)");
             }
             return flux_map_table<double>(
                 N_r, {knot.data(), knot.data() + knot.size()},
                 {coefficient.data(), coefficient.data() + coefficient.size()}, theta_span);
           }),
           nb::kw_only(), nb::arg("N_r"), nb::arg("knots"), nb::arg("coefficients"),
           nb::arg("theta_span"),
           "From knots (n_i) [A], co-energy coefficients (n_i, n_theta + 3, 5) [J/A^p] and the "
           "angle "
           "they span, pi or 2 pi. Raises ValueError unless the flux provably rises with current.")
      .def_ro("N_r", &Map::N_r)
      .def_prop_ro(
          "i_last", [](const Map& m) { return srm::i_last(m.map); },
          "Last current of the table [A]; beyond it the flux keeps its last slope.")
      .def_prop_ro("theta_span", [](const Map& m) { return m.map.theta_span; })
      .def_prop_ro(
          "inductance_bound", [](const Map& m) { return srm::inductance_bound(m.map); },
          "Proven lower bound of the incremental inductance [H].")
      .def_prop_ro("knots", &knots, nb::rv_policy::move,
                   "Start of each current piece, shape (n_i,) [A].")
      .def_prop_ro("coefficients", &coefficients, nb::rv_policy::move,
                   "Shape (n_i, n_theta + 3, 5) [J/A^p].")
      .def_prop_ro(
          "pieces",
          [](const Map& m) { return nb::bytes(m.tables->piece.data(), m.tables->piece.size()); },
          "Piece of each current slot, one byte a slot.")
      .def("magnetics", &magnetics<double>, nb::arg("i"), nb::arg("theta_e"),
           "Columns psi [Wb], W_c [J], tau [N m], L_inc [H], psi_theta [Wb/rad], shape (n, 5).")
      .def("magnetics_single", &magnetics<float>, nb::arg("i"), nb::arg("theta_e"),
           "As magnetics, computed in float as on the target.")
      .def("current", &current<double>, nb::arg("psi"), nb::arg("theta_e"), nb::arg("i_max"),
           "Current in [0, i_max] at flux psi and angle theta_e, shape (n,) [A].")
      .def("current_single", &current<float>, nb::arg("psi"), nb::arg("theta_e"), nb::arg("i_max"),
           "As current, computed in float as on the target.");
}

}  // namespace bound
