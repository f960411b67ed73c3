// The closed loop for Python: built once, advanced in slices, its tables emptied in between.
#include "simulation.hpp"

#include <nanobind/stl/tuple.h>

#include <algorithm>

#include "bind_struct.hpp"
#include "other_forms.hpp"

namespace bound {

AnySimulation::AnySimulation(const AnyController& controller, const SimulationParts& given,
                             const Faults& faults) {
  if (faults.size() > srm::most_faults) throw std::invalid_argument("too many faults");
  std::visit(
      [&]<int N, class M>(const srm::Controller<N>& step, const srm::Held<M>& model) {
        for (const srm::BrokenPart& part : faults) {
          if (std::min(part.phase, part.other) < 0 || std::max(part.phase, part.other) >= N) {
            throw std::invalid_argument("a fault of a phase that is not there");
          }
        }
        memory_ = given.memory();
        follows_ = controller.follows;
        if constexpr (has_form<Forms::usual, double, N>) {
          make(step, given, model.value, faults);
        } else {
          other_form<MakesLoop>("loop", other_loops)(*this, controller, given, faults);
        }
      },
      controller.step, given.machine);
}

void bind_simulation(nb::module_& m) {
  bind_struct<SimulationParts>(m, "SimulationParts",
                               "All of a closed loop but its controller. SI units.");
  nb::class_<AnySimulation>(m, "Simulation", "The closed loop. SI units.")
      .def(nb::init<const AnyController&, const SimulationParts&, const AnySimulation::Faults&>(),
           nb::arg("controller"), nb::arg("loop"), nb::arg("faults") = AnySimulation::Faults{})
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
           "Rows recorded since the last call, with the columns of waveform_columns; with those of "
           "flux_estimate_columns behind them where the controller follows the rotor.")
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
  m.attr("flux_estimate_columns") = nb::cast(srm::column_names(srm::FluxEstimate<double>{}));
  m.attr("learned_columns") = nb::cast(srm::column_names(srm::Learned<double>{}));
  bind_runs(m);
  bind_environments(m);
  bind_bench(m);
}

}  // namespace bound
