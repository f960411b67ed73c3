// A controller by itself: sampled from Python, made of a Python function, described for export.
#include "bindings.hpp"

namespace bound {

namespace {

/// Phase commands as rows of numbers: gate, legs, chop, edges, then currents and angles.
constexpr int command_columns = 7 + 2 * srm::max_edges;

void write(const srm::PhaseCommand<double>& c, double* row) {
  *row++ = double(c.gate);
  for (const srm::Leg leg : c.leg) *row++ = double(leg);
  *row++ = double(c.chop);
  for (const double t : c.t_edge) *row++ = t;
  for (const double value : {c.i_ref, c.i_band, c.theta_on, c.theta_off}) *row++ = value;
}

srm::PhaseCommand<double> read(const double* row) {
  srm::PhaseCommand<double> c;
  c.gate = srm::Gate(int(*row++));
  for (srm::Leg& leg : c.leg) leg = srm::Leg(int(*row++));
  c.chop = srm::Leg(int(*row++));
  for (double& t : c.t_edge) t = *row++;
  for (double* value : {&c.i_ref, &c.i_band, &c.theta_on, &c.theta_off}) *value = *row++;
  return c;
}

std::vector<double> step(AnyController& controller, const std::vector<double>& i, double theta_e,
                         double omega_m, double u_dc, double reference) {
  return std::visit(
      [&]<int N>(srm::Controller<N>& sampled) {
        if (int(i.size()) != N) throw std::invalid_argument("i has another phase count");
        srm::Measurement<double, N> y{.theta_e = theta_e, .omega_m = omega_m, .u_dc = u_dc};
        for (int k = 0; k < N; ++k) y.i[k] = i[k];
        const srm::Orders<N> orders = sampled(y, reference);
        std::vector<double> rows(N * command_columns + 1);
        for (int k = 0; k < N; ++k) write(orders.command[k], &rows[k * command_columns]);
        rows.back() = orders.tau_ref;
        return rows;
      },
      controller.step);
}

/// The simulation runs without the interpreter lock; each sample takes it back. The owner sees to
/// it that the function is released under the lock too.
AnyController from_function(int n_phases, nb::callable function) {
  const std::shared_ptr<nb::callable> owner(new nb::callable(std::move(function)), [](auto* f) {
    const nb::gil_scoped_acquire lock;
    delete f;
  });
  return with_phases(n_phases, [&]<int N>() -> AnyController {
    const srm::Controller<N> sampled = [owner](const srm::Measurement<double, N>& y,
                                               double reference) {
      const nb::gil_scoped_acquire lock;
      const std::vector<double> i(y.i.begin(), y.i.end());
      const auto rows =
          nb::cast<std::vector<double>>((*owner)(i, y.theta_e, y.omega_m, y.u_dc, reference));
      if (int(rows.size()) != N * command_columns + 1) {
        throw std::invalid_argument("need 15 numbers a phase and the torque reference");
      }
      srm::Orders<N> orders;
      for (int k = 0; k < N; ++k) orders.command[k] = read(&rows[k * command_columns]);
      orders.tau_ref = rows.back();
      return orders;
    };
    return {sampled, {}};
  });
}

nb::object description_of(const AnyController& controller) {
  return controller.description ? controller.description() : nb::none();
}

}  // namespace

void bind_controller(nb::module_& m) {
  m.attr("COMMAND_COLUMNS") = command_columns;
  m.def("step", &step, nb::arg("controller"), nb::arg("i"), nb::kw_only(), nb::arg("theta_e"),
        nb::arg("omega_m"), nb::arg("u_dc"), nb::arg("reference"),
        "One sample of a controller: phase currents [A], angle [rad], speed [rad/s], dc-link "
        "voltage [V], reference [N m or rad/s] to commands. Per phase 15 numbers: gate, five legs, "
        "chop, four edges [s], i_ref, i_band [A], theta_on, theta_off [rad]; last the torque "
        "reference worked to [N m].");
  m.def("controller_from", &from_function, nb::arg("n_phases"), nb::arg("function"),
        "A controller that calls function(i, theta_e, omega_m, u_dc, reference) at every sample "
        "and takes the commands from it, in the form that `step` returns.");
  m.def("described", &description_of, nb::arg("controller"),
        nb::sig("def described(controller: Controller) -> dict[str, typing.Any] | None"),
        "The controller's law, speed loop and machine as a tree of names and numbers, for export; "
        "None where it has no such form.");
}

}  // namespace bound
