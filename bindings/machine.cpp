// Machine models: parameters, and their magnetics over arrays.
#include "bindings.hpp"
#include "srm/machine/magnetics.hpp"

namespace bound {

namespace {

using Columns = nb::ndarray<nb::numpy, double, nb::ndim<2>>;

/// (n, 5): psi, W_c, tau, L_inc, psi_theta at n pairs of current and angle.
Columns magnetics(const AnyMachine& machine, const Vector& i, const Vector& theta_e) {
  const std::size_t n = i.shape(0);
  if (theta_e.shape(0) != n) throw std::invalid_argument("i and theta_e differ in length");
  auto* values = new double[n * 5];
  nb::capsule owner(values, [](void* p) noexcept { delete[] static_cast<double*>(p); });
  std::visit(
      [&](const auto& m) {
        for (std::size_t j = 0; j < n; ++j) {
          const auto at = m.at(i.data()[j], srm::wrap(theta_e.data()[j]));
          double* row = values + 5 * j;
          for (const double value : {at.psi, at.W_c, at.tau, at.L_inc, at.psi_theta})
            *row++ = value;
        }
      },
      machine);
  return Columns(values, {n, 5}, owner);
}

}  // namespace

void bind_machine(nb::module_& m) {
  nb::class_<srm::LeHuy<double>>(m, "LeHuy",
                                 "Analytic machine of Le-Huy and Brunelle (IECON 2005).")
      .def(nb::new_(&srm::lehuy<double>), nb::kw_only(), nb::arg("N_r"), nb::arg("L_u"),
           nb::arg("L_a"), nb::arg("L_sat"), nb::arg("i_m"), nb::arg("psi_m"),
           "From unaligned and unsaturated aligned inductance, saturated slope [H] and one point "
           "(i_m, psi_m) of the aligned curve [A, Wb].")
      .def_ro("N_r", &srm::LeHuy<double>::N_r)
      .def_ro("L_u", &srm::LeHuy<double>::L_u)
      .def_ro("L_sat", &srm::LeHuy<double>::L_sat)
      .def_ro("A", &srm::LeHuy<double>::A)
      .def_ro("B", &srm::LeHuy<double>::B);
  m.def("magnetics", &magnetics, nb::arg("machine"), nb::arg("i"), nb::arg("theta_e"),
        "Columns psi [Wb], W_c [J], tau [N m], L_inc [H], psi_theta [Wb/rad], shape (n, 5), at n "
        "currents [A] and electrical angles [rad] of one phase.");
  m.def("exp", &srm::exp<double>, nb::arg("x"), "The core's exponential, without libm.");
  m.def("wrap", &srm::wrap<double>, nb::arg("theta"), "theta [rad] brought into [0, 2 pi).");
  m.def("wrap_float", &srm::wrap<float>, nb::arg("theta"), "The same in single precision.");
}

}  // namespace bound
