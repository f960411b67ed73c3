// The closed loop of any machine and phase count, with the tables that it fills.
#pragma once

#include <functional>
#include <tuple>

#include "bindings.hpp"
#include "srm/sim/simulation.hpp"

namespace bound {

using Table = nb::ndarray<nb::numpy, double>;

/// Enough rows that a slice takes some ten milliseconds: a progress bar and Ctrl-C stay lively.
inline constexpr int waveform_rows = 20000;
/// Few, because each of thousands of loops has them: at 40 columns, 20 KB.
inline constexpr int period_rows = 64;

/// What a loop is made of but its controller.
struct SimulationParts {
  AnyMachine machine;
  double R;
  srm::Source source;
  srm::Bridge bridge;
  srm::Shaft shaft;
  AnyCoupling coupling;
  double t_dead;
  srm::Sampling sampling;
  srm::Course reference;
  double theta_m;
  srm::Resolution resolution;
  SRM_FIELDS(machine, R, source, bridge, shaft, coupling, t_dead, sampling, reference, theta_m,
             resolution)

  template <srm::Machine M, int N>
  srm::Plant<M, N> plant(const M& model) const {
    return {model, R, source, bridge, shaft, pairs()};
  }
  srm::Coupling<double> pairs() const {
    return coupling ? coupling->value : srm::Coupling<double>{};
  }

  /// Of the tables of machine and pairs.
  std::shared_ptr<const void> memory() const {
    using Owners = std::array<std::shared_ptr<const void>, 2>;
    const auto of_machine = std::visit([](const auto& held) { return held.memory; }, machine);
    return std::make_shared<Owners>(Owners{of_machine, coupling ? coupling->memory : nullptr});
  }
};

class AnySimulation {
 public:
  using State = std::tuple<std::vector<double>, double, double, double>;

  using Faults = std::vector<srm::BrokenPart>;

  AnySimulation(const AnyController& controller, const SimulationParts& given,
                const Faults& faults);

  double advance(double t_stop) { return advance_(t_stop, *waveforms_, *periods_); }
  long steps() const { return steps_(); }
  State state() const { return state_(); }
  /// Columns of srm::Learned.
  std::vector<double> learned() const {
    const srm::Learned<double> now = learned_();
    std::vector<double> row(srm::columns_of(now));
    srm::write_columns(now, row.data());
    return row;
  }
  void change_R(double to) { change_R_(to); }
  std::vector<double> onsets() const { return onsets_(); }
  void record() { record_(*waveforms_); }
  void close_period() { close_period_(*periods_); }
  Table take_waveforms() { return as_table(taken(*waveforms_), waveforms_->columns()); }
  Table take_periods() { return as_table(taken(*periods_), periods_->columns()); }

  /// The period rows since the last call, one after the other.
  std::vector<double> periods() { return taken(*periods_); }
  int period_columns() const { return periods_->columns(); }

  template <srm::Motor M, int N>
  void make(const srm::Controller<N>& step, const SimulationParts& given, const M& machine,
            const Faults& faults);

 private:
  static std::vector<double> taken(srm::Rows& rows) {
    std::vector<double> values(rows.data(),
                               rows.data() + std::size_t(rows.size()) * rows.columns());
    rows.clear();
    return values;
  }
  static Table as_table(std::vector<double> values, int columns) {
    const std::size_t n_rows = values.size() / columns;
    return numpy(std::move(values), {n_rows, std::size_t(columns)});
  }

  std::function<double(double, srm::Rows&, srm::Rows&)> advance_;
  std::function<void(srm::Rows&)> record_, close_period_;
  std::function<long()> steps_;
  std::function<State()> state_;
  std::function<std::vector<double>()> onsets_;
  std::function<srm::Learned<double>()> learned_;
  std::function<void(double)> change_R_;
  bool follows_ = false;  // the rows of the waveforms have an estimate
  std::unique_ptr<srm::Rows> waveforms_, periods_;
  std::shared_ptr<const void> memory_;  // of the tables of the plant
};

template <srm::Motor M, int N>
void AnySimulation::make(const srm::Controller<N>& step, const SimulationParts& given,
                         const M& machine, const Faults& faults) {
  const bool records = given.resolution.record_every >= 0;
  const int columns =
      follows_ ? srm::columns_of(srm::FollowedWaveform<N>{}) : srm::columns_of(srm::Waveform<N>{});
  waveforms_ = std::make_unique<srm::Rows>(columns, records ? waveform_rows : 1);
  periods_ = std::make_unique<srm::Rows>(srm::columns_of(srm::Period<N>{}), period_rows);
  const srm::Plant<M, N> plant = given.plant<M, N>(machine);
  if (const char* wrong = plant.coupling.fault(N)) throw std::invalid_argument(wrong);
  auto loop = std::make_shared<srm::Simulation<M, N>>(plant, given.t_dead, given.sampling, step,
                                                      given.reference, given.theta_m,
                                                      given.resolution, faults);
  advance_ = [loop](double t, srm::Rows& w, srm::Rows& p) { return loop->advance(t, w, p); };
  record_ = [loop](srm::Rows& w) { loop->record(w); };
  steps_ = [loop] { return loop->steps(); };
  onsets_ = [loop] { return loop->onsets(); };
  learned_ = [loop] { return loop->learned(); };
  change_R_ = [loop](double to) { loop->change([to](auto& changed, auto&) { changed.R = to; }); };
  state_ = [loop] {
    const srm::State<N>& x = loop->state();
    return State{{x.i.begin(), x.i.end()}, x.omega_m, x.theta_m, x.u_dc};
  };
  close_period_ = [loop](srm::Rows& p) { loop->close_period(p); };
}

/// Of a number of phases that is not usual (forms.hpp).
using MakesLoop = void(AnySimulation&, const AnyController&, const SimulationParts&,
                       const AnySimulation::Faults&);
/// The file that adds it.
inline constexpr auto other_loops = "other_loops.cpp";

/// Threads that run many loops; bound together with the loop.
void bind_runs(nb::module_& m);

/// Drives that are stepped together, for learning; likewise.
void bind_environments(nb::module_& m);

/// Commissioning on a simulated bench; likewise.
void bind_bench(nb::module_& m);

}  // namespace bound
