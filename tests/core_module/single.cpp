// Machine models and elementary functions, computed in float as on the target.
#include "bindings.hpp"
#include "srm/machine/inverse.hpp"

namespace bound {

namespace {

using Map = srm::Held<srm::FluxMap<double>>;

/// (n, 5): psi, W_c, tau, L_inc, psi_theta.
nb::ndarray<nb::numpy, double> magnetics(const Map& machine, const Array<1>& i,
                                         const Array<1>& theta_e) {
  srm::Tables memory;
  srm::FluxMap<float> m;
  srm::assign(m, machine, memory);
  std::vector<double> rows;
  for (std::size_t j = 0; j < i.shape(0); ++j) {
    const auto y = m.at(float(i.data()[j]), srm::wrap(float(theta_e.data()[j])));
    rows.insert(rows.end(), {y.psi, y.W_c, y.tau, y.L_inc, y.psi_theta});
  }
  return numpy(std::move(rows), {i.shape(0), 5});
}

nb::ndarray<nb::numpy, double> current(const Map& machine, const Array<1>& psi,
                                       const Array<1>& theta_e, double i_max) {
  srm::Tables memory;
  srm::FluxMap<float> m;
  srm::assign(m, machine, memory);
  std::vector<double> values;
  for (std::size_t j = 0; j < psi.shape(0); ++j) {
    const float angle = srm::wrap(float(theta_e.data()[j]));
    values.push_back(srm::current_from_flux(m, float(psi.data()[j]), angle, float(i_max)));
  }
  return numpy(std::move(values), {psi.shape(0)});
}

}  // namespace

void bind_single(nb::module_& m) {
  m.def("magnetics_single", &magnetics, nb::arg("machine"), nb::arg("i"), nb::arg("theta_e"),
        "As reluctance._core.magnetics, computed in float.");
  m.def("current_single", &current, nb::arg("machine"), nb::arg("psi"), nb::arg("theta_e"),
        nb::arg("i_max"), "As FluxMap.current, computed in float.");
  m.def("exp", &srm::exp<double>, nb::arg("x"), "The core's exponential, without libm.");
  m.def("wrap", &srm::wrap<double>, nb::arg("theta"), "theta [rad] brought into [0, 2 pi).");
}

}  // namespace bound
