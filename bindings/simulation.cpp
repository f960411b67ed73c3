// The closed loop for Python: built once, advanced in slices, its tables emptied in between.
#include "simulation.hpp"

#include <nanobind/stl/tuple.h>

#include <algorithm>

namespace bound {

AnySimulation::AnySimulation(const SimulationParts& given) {
  with_phases(given.n_phases, [&]<int N>() {
    std::visit(
        [&]<class M>(const srm::Held<M>& model) {
          memory_ = model.memory;
          if constexpr (has_form<Forms::usual, double, N>) {
            make<M, N>(given, model.value);
          } else {
            make_other(given);
          }
        },
        given.machine);
  });
}

void bind_simulation(nb::module_& m) {
  nb::class_<AnySimulation>(m, "Simulation", "The closed loop. SI units.")
      .def(
          "__init__",
          [](AnySimulation* self, const AnyMachine& machine, int n_phases, double R,
             const srm::Source& source, const srm::Bridge& bridge, const srm::Shaft& shaft,
             double t_dead, const srm::Sampling& sampling, const AnyController& controller,
             const srm::Course& reference, double theta_m, const srm::Resolution& resolution,
             const std::vector<srm::BrokenPart>& faults) {
            for (const srm::BrokenPart& part : faults) {
              if (std::min(part.phase, part.other) < 0 ||
                  std::max(part.phase, part.other) >= n_phases) {
                throw std::invalid_argument("a fault of a phase that is not there");
              }
            }
            if (faults.size() > srm::most_faults) throw std::invalid_argument("too many faults");
            new (self) AnySimulation({machine, n_phases, R, source, bridge, shaft, t_dead, sampling,
                                      controller, reference, theta_m, resolution, faults});
          },
          nb::kw_only(), nb::arg("machine"), nb::arg("n_phases"), nb::arg("R"), nb::arg("source"),
          nb::arg("bridge"), nb::arg("shaft"), nb::arg("t_dead"), nb::arg("sampling"),
          nb::arg("controller"), nb::arg("reference"), nb::arg("theta_m"), nb::arg("resolution"),
          nb::arg("faults") = std::vector<srm::BrokenPart>{})
      .def("advance", &AnySimulation::advance, nb::arg("t_stop"),
           nb::call_guard<nb::gil_scoped_release>(),
           "Runs to t_stop [s], or until a table is full or many steps are taken; returns the time "
           "reached.")
      .def_prop_ro("steps", &AnySimulation::steps, "Integration steps taken so far.")
      .def("state", &AnySimulation::state,
           "Currents of the phases [A], speed [rad/s], rotor angle [rad], dc-link voltage [V].")
      .def("learned", &AnySimulation::learned,
           "What the controller has learned of its machine, with the columns of learned_columns.")
      .def("onsets", &AnySimulation::onsets,
           "When the faults of the list have begun [s]; infinity where one has not.")
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
