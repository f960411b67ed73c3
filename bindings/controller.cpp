// A controller by itself: sampled from Python, made of a Python function.
#include "measurement.hpp"
#include "srm/sim/columns.hpp"

namespace bound {

namespace {

using Order = srm::PhaseCommand<double>;

const int order_columns = srm::columns_of(Order{});

std::vector<double> step(AnyController& controller, const Measurement& y, double reference) {
  return std::visit(
      [&]<int N>(srm::Controller<N>& sampled) {
        const srm::Orders<N> orders = sampled(y.in_core<N>(), reference);
        std::vector<double> rows(N * order_columns + 1);
        *srm::write_columns(orders.command, rows.data()) = orders.tau_ref;
        return rows;
      },
      controller.step);
}

AnyController from_function(int n_phases, nb::callable function) {
  return with_phases(n_phases, [&]<int N>() -> AnyController {
    const srm::Controller<N> sampled = [owner = guarded(std::move(function))](
                                           const srm::Measurement<double, N>& y, double reference) {
      const nb::gil_scoped_acquire lock;
      const auto rows = nb::cast<std::vector<double>>((*owner)(Measurement::of(y), reference));
      if (int(rows.size()) != N * order_columns + 1) {
        throw std::invalid_argument(
            "need the order columns of each phase and the torque reference");
      }
      srm::Orders<N> orders;
      orders.tau_ref = *srm::read_columns(orders.command, rows.data());
      return orders;
    };
    return {sampled};
  });
}

}  // namespace

void bind_controller(nb::module_& m) {
  m.attr("ORDER_COLUMNS") = nb::cast(srm::column_names(Order{}));
  m.def("step", &step, nb::arg("controller"), nb::arg("y"), nb::arg("reference"),
        "One sample of a controller: a measurement and the reference [N m or rad/s] to orders. "
        "ORDER_COLUMNS for each phase, last the torque reference worked to [N m].");
  m.def("controller_from", &from_function, nb::arg("n_phases"), nb::arg("function"),
        "A controller that calls function(measurement, reference) at every sample and takes the "
        "orders from it, in the form that `step` returns.");
  m.def("wrap_float", &srm::wrap<float>, nb::arg("theta"),
        "theta [rad] brought into [0, 2 pi), in single precision.");
}

}  // namespace bound
