// The closed loop for Python: built once, advanced in slices, its tables emptied in between.
#include "simulation.hpp"

#include <nanobind/stl/tuple.h>

namespace bound {

AnySimulation::AnySimulation(const AnyMachine& machine, int n_phases, double R,
                             const srm::Source& source, const srm::Bridge& bridge,
                             const srm::Shaft& shaft, double t_dead, const srm::Sampling& sampling,
                             const AnyController& controller, const srm::Course& reference,
                             double theta_m, const srm::Resolution& resolution) {
  with_phases(n_phases, [&]<int N>() {
    const auto* step = std::get_if<srm::Controller<N>>(&controller.step);
    if (step == nullptr) throw std::invalid_argument("the controller has another phase count");
    const bool records = resolution.record_every >= 0;
    waveforms_ = std::make_unique<srm::Rows>(srm::columns_of(srm::Waveform<N>{}),
                                             records ? waveform_rows : 1);
    periods_ = std::make_unique<srm::Rows>(srm::columns_of(srm::Period<N>{}), period_rows);
    std::visit(
        [&]<class M>(const srm::Held<M>& model) {
          memory_ = model.memory;
          const srm::Plant<M, N> plant{model.value, R, source, bridge, shaft};
          auto loop = std::make_shared<srm::Simulation<M, N>>(plant, t_dead, sampling, *step,
                                                              reference, theta_m, resolution);
          advance_ = [loop](double t, srm::Rows& w, srm::Rows& p) {
            return loop->advance(t, w, p);
          };
          record_ = [loop](srm::Rows& w) { loop->record(w); };
          steps_ = [loop] { return loop->steps(); };
          learned_ = [loop] { return loop->learned(); };
          change_R_ = [loop](double to) {
            loop->change([to](auto& changed, auto&) { changed.R = to; });
          };
          state_ = [loop] {
            const srm::State<N>& x = loop->state();
            return State{{x.i.begin(), x.i.end()}, x.omega_m, x.theta_m, x.u_dc};
          };
          close_period_ = [loop](srm::Rows& p) { loop->close_period(p); };
        },
        machine);
  });
}

void bind_simulation(nb::module_& m) {
  nb::class_<AnySimulation>(m, "Simulation", "The closed loop. SI units.")
      .def(nb::init<const AnyMachine&, int, double, const srm::Source&, const srm::Bridge&,
                    const srm::Shaft&, double, const srm::Sampling&, const AnyController&,
                    const srm::Course&, double, const srm::Resolution&>(),
           nb::kw_only(), nb::arg("machine"), nb::arg("n_phases"), nb::arg("R"), nb::arg("source"),
           nb::arg("bridge"), nb::arg("shaft"), nb::arg("t_dead"), nb::arg("sampling"),
           nb::arg("controller"), nb::arg("reference"), nb::arg("theta_m"), nb::arg("resolution"))
      .def("advance", &AnySimulation::advance, nb::arg("t_stop"),
           nb::call_guard<nb::gil_scoped_release>(),
           "Runs to t_stop [s], or until a table is full or many steps are taken; returns the time "
           "reached.")
      .def_prop_ro("steps", &AnySimulation::steps, "Integration steps taken so far.")
      .def("state", &AnySimulation::state,
           "Currents of the phases [A], speed [rad/s], rotor angle [rad], dc-link voltage [V].")
      .def("learned", &AnySimulation::learned,
           "What the controller has learned of its machine, with the columns of learned_columns.")
      .def("change_R", &AnySimulation::change_R, nb::arg("R"),
           "The windings have another resistance from now on [ohm].")
      .def("record", &AnySimulation::record, "Adds the present instant to the waveforms.")
      .def("close_period", &AnySimulation::close_period,
           "Adds the integrals so far to the periods.")
      .def("take_waveforms", &AnySimulation::take_waveforms,
           "Rows recorded since the last call, with the columns of waveform_columns.")
      .def("take_periods", &AnySimulation::take_periods,
           "Rows at the ends of electrical periods since the last call, with the columns of "
           "period_columns.");
  m.def(
      "waveform_columns",
      [](int n_phases) {
        return with_phases(n_phases, []<int N>() { return srm::column_names(srm::Waveform<N>{}); });
      },
      nb::arg("n_phases"), "Names of the columns of a waveform row.");
  m.def(
      "period_columns",
      [](int n_phases) {
        return with_phases(n_phases, []<int N>() { return srm::column_names(srm::Period<N>{}); });
      },
      nb::arg("n_phases"), "Names of the columns of a period row.");
  m.attr("learned_columns") = nb::cast(srm::column_names(srm::Learned<double>{}));
  bind_runs(m);
  bind_environments(m);
  bind_bench(m);
}

}  // namespace bound
