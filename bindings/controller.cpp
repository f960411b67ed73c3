// A controller by itself: sampled from Python, made of a Python function, described for export.
#include "bind_struct.hpp"
#include "srm/sim/columns.hpp"

namespace bound {

namespace {

using Order = srm::PhaseCommand<double>;

const int order_columns = srm::columns_of(Order{});

std::vector<double> step(AnyController& controller, const std::vector<double>& i, double theta_e,
                         double omega_m, double u_dc, double reference, double i_source) {
  return std::visit(
      [&]<int N>(srm::Controller<N>& sampled) {
        if (int(i.size()) != N) throw std::invalid_argument("i has another phase count");
        srm::Measurement<double, N> y{
            .theta_e = theta_e, .omega_m = omega_m, .u_dc = u_dc, .i_source = i_source};
        for (int k = 0; k < N; ++k) y.i[k] = i[k];
        const srm::Orders<N> orders = sampled(y, reference);
        std::vector<double> rows(N * order_columns + 1);
        *srm::write_columns(orders.command, rows.data()) = orders.tau_ref;
        return rows;
      },
      controller.step);
}

/// The simulation runs without the interpreter lock; each sample takes it back. The deleter ensures
/// that the function is released under the lock too.
std::shared_ptr<nb::callable> guarded(nb::callable function) {
  return {new nb::callable(std::move(function)), [](auto* f) {
            const nb::gil_scoped_acquire lock;
            delete f;
          }};
}

AnyController from_function(int n_phases, nb::callable function) {
  return with_phases(n_phases, [&]<int N>() -> AnyController {
    const srm::Controller<N> sampled = [owner = guarded(std::move(function))](
                                           const srm::Measurement<double, N>& y, double reference) {
      const nb::gil_scoped_acquire lock;
      const std::vector<double> i(y.i.begin(), y.i.end());
      const auto rows = nb::cast<std::vector<double>>(
          (*owner)(i, y.theta_e, y.omega_m, y.u_dc, reference, y.i_source));
      if (int(rows.size()) != N * order_columns + 1) {
        throw std::invalid_argument(
            "need the order columns of each phase and the torque reference");
      }
      srm::Orders<N> orders;
      orders.tau_ref = *srm::read_columns(orders.command, rows.data());
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
  bind_struct<srm::LimitedPi<double>>(m, "LimitedPi",
                                      "Output per error, and per error and control period.");
  bind_struct<srm::PowerTracker<double>>(
      m, "PowerTracker", "Maximum power point tracking on a voltage reference [V].");
  bind_struct<srm::WholePeriods<double>>(m, "WholePeriods",
                                         "Means over whole electrical periods [s].");
  bind_struct<srm::StrokeRipple<double>>(m, "StrokeRipple",
                                         "Adaptive notch filter at the stroke frequency [s].");
  bind_struct<srm::PvControl<double>>(m, "PvControl",
                                      "Voltage control and tracking of a drive on a photovoltaic "
                                      "array. SI units.");
  bind_struct<srm::SpeedRamp<double>>(m, "SpeedRamp",
                                      "The speed reference that the torque can follow. SI units.");
  bind_struct<srm::TrackerGains<double>>(m, "TrackerGains",
                                         "Of angle [1], speed [1/s] and load torque [N m/rad].");
  bind_struct<srm::AngleTracker<double>>(
      m, "AngleTracker", "Observer of angle, speed and load torque on the angle. SI units.");
  nb::class_<AnyController>(m, "Controller", "A complete controller, ready to be sampled.");
  nb::class_<Setting>(m, "Setting", "What every control law is given beside its own parameters.")
      .def(
          "__init__",
          [](Setting* self, const AnyMachine& machine, int n_phases, bool single, srm::Outer outer,
             double K_p, double K_i, double tau_min, double tau_max, double T_s,
             const std::optional<srm::SpeedRamp<double>>& ramp, srm::LoadTorque load,
             srm::Motion motion, const std::optional<srm::AngleTracker<double>>& tracker, int delay,
             srm::Comparators comparators, double t_dead,
             const std::optional<srm::PvControl<double>>& pv, double t_min, double t_blank,
             double u_brake_full, double u_brake_none, double tau_limit, double i_limit) {
            if (outer == srm::Outer::pv && !pv) throw std::invalid_argument("Outer.pv needs pv");
            new (self) Setting{machine,
                               n_phases,
                               single,
                               outer,
                               {K_p, K_i, tau_min, tau_max, T_s},
                               ramp.value_or(srm::SpeedRamp<double>{}),
                               load,
                               motion,
                               tracker.value_or(srm::AngleTracker<double>{}),
                               delay,
                               comparators,
                               t_dead,
                               pv.value_or(srm::PvControl<double>{}),
                               {t_min, t_blank, T_s},
                               u_brake_full,
                               u_brake_none,
                               {tau_limit, i_limit}};
          },
          nb::kw_only(), nb::arg("machine"), nb::arg("n_phases"), nb::arg("single"),
          nb::arg("outer"), nb::arg("K_p"), nb::arg("K_i"), nb::arg("tau_min"), nb::arg("tau_max"),
          nb::arg("T_s"), nb::arg("ramp") = nb::none(), nb::arg("load") = srm::LoadTorque::integral,
          nb::arg("motion") = srm::Motion::measured, nb::arg("tracker") = nb::none(),
          nb::arg("delay") = 0, nb::arg("comparators") = srm::Comparators::analog,
          nb::arg("t_dead") = 0.0, nb::arg("pv") = nb::none(), nb::arg("t_min") = 0.0,
          nb::arg("t_blank") = 0.0, nb::arg("u_brake_full") = srm::never<double>,
          nb::arg("u_brake_none") = 2 * srm::never<double>,
          nb::arg("tau_limit") = srm::never<double>, nb::arg("i_limit") = srm::never<double>);
  m.attr("ORDER_COLUMNS") = nb::cast(srm::column_names(Order{}));
  m.def("step", &step, nb::arg("controller"), nb::arg("i"), nb::kw_only(), nb::arg("theta_e"),
        nb::arg("omega_m"), nb::arg("u_dc"), nb::arg("reference"), nb::arg("i_source") = 0.0,
        "One sample of a controller: phase currents [A], angle [rad], speed [rad/s], dc-link "
        "voltage [V], reference [N m or rad/s], current of the source [A] to orders. ORDER_COLUMNS "
        "for each phase, last the "
        "torque reference worked to [N m].");
  m.def("controller_from", &from_function, nb::arg("n_phases"), nb::arg("function"),
        "A controller that calls function(i, theta_e, omega_m, u_dc, reference, i_source) at every "
        "sample and takes the orders from it, in the form that `step` returns.");
  m.def("described", &description_of, nb::arg("controller"),
        nb::sig("def described(controller: Controller) -> dict[str, typing.Any] | None"),
        "The controller's law, speed loop and machine as a tree of names and numbers, for export; "
        "None where it has no such form.");
  m.def("wrap_float", &srm::wrap<float>, nb::arg("theta"),
        "theta [rad] brought into [0, 2 pi), in single precision.");
}

}  // namespace bound
