// A controller that is a C function, for runs of minutes: no sample goes through Python.
#include <cstdint>

#include "bindings.hpp"
#include "srm/sim/columns.hpp"

namespace bound {

namespace {

/// sample: phase currents, theta_e, omega_m, u_dc, i_source, reference. row: the orders as the
/// columns of a phase's order, phase by phase.
using Step = void (*)(const double* sample, double* row);

AnyController c_controller(int n_phases, std::uintptr_t address) {
  const auto step = reinterpret_cast<Step>(address);
  return with_phases(n_phases, [&]<int N>() -> AnyController {
    const srm::Controller<N> sampled = [step](const srm::Measurement<double, N>& y,
                                              double reference) {
      std::array<double, N + 5> sample;
      *srm::write_columns(y, sample.data()) = reference;
      srm::Orders<N> orders;
      std::vector<double> row(srm::columns_of(orders.command));
      step(sample.data(), row.data());
      srm::read_columns(orders.command, row.data());
      return orders;
    };
    return {sampled, {}};
  });
}

}  // namespace

void bind_c_controller(nb::module_& m) {
  m.def("c_controller", &c_controller, nb::arg("n_phases"), nb::arg("address"),
        "The controller at an address: void step(const double* sample, double* row).");
}

}  // namespace bound
