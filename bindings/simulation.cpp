// The closed loop for Python: built once, advanced in slices, its tables emptied in between.
#include "srm/sim/simulation.hpp"

#include <functional>

#include "bindings.hpp"

namespace bound {

namespace {

using Table = nb::ndarray<nb::numpy, double, nb::ndim<2>>;

/// Enough rows that a slice takes some ten milliseconds: a progress bar and Ctrl-C stay lively.
constexpr int waveform_rows = 20000;
constexpr int period_rows = 1000;

class AnySimulation {
 public:
  AnySimulation(const AnyMachine& machine, int n_phases, double R, const srm::Converter& converter,
                const srm::Mechanics& mechanics, const srm::Sampling& sampling,
                const AnyController& controller, const srm::Reference& reference, double omega_m,
                double theta_m, const srm::Resolution& resolution) {
    with_phases(n_phases, [&]<int N>() {
      const auto* step = std::get_if<srm::Controller<N>>(&controller.step);
      if (step == nullptr) throw std::invalid_argument("the controller has another phase count");
      waveforms_ = std::make_unique<srm::Rows>(srm::waveform_columns<N>, waveform_rows);
      periods_ = std::make_unique<srm::Rows>(srm::period_columns<N>, period_rows);
      std::visit(
          [&](const auto& model) {
            using M = std::decay_t<decltype(model)>;
            const srm::Plant<M, N> plant{model, R, converter, mechanics};
            const srm::State<N> start{.i = {}, .omega_m = omega_m, .theta_m = theta_m};
            auto loop = std::make_shared<srm::Simulation<M, N>>(plant, sampling, *step, reference,
                                                                start, resolution);
            advance_ = [loop](double t, srm::Rows& w, srm::Rows& p) {
              return loop->advance(t, w, p);
            };
            record_ = [loop](srm::Rows& w) { loop->record(w); };
            close_period_ = [loop](srm::Rows& p) { loop->close_period(p); };
          },
          machine);
    });
  }

  double advance(double t_stop) { return advance_(t_stop, *waveforms_, *periods_); }
  void record() { record_(*waveforms_); }
  void close_period() { close_period_(*periods_); }
  Table take_waveforms() { return take(*waveforms_); }
  Table take_periods() { return take(*periods_); }

 private:
  static Table take(srm::Rows& rows) {
    const std::size_t n = std::size_t(rows.size()) * rows.columns();
    auto* values = new double[n];
    std::copy_n(rows.data(), n, values);
    nb::capsule owner(values, [](void* p) noexcept { delete[] static_cast<double*>(p); });
    const Table table(values, {std::size_t(rows.size()), std::size_t(rows.columns())}, owner);
    rows.clear();
    return table;
  }

  std::function<double(double, srm::Rows&, srm::Rows&)> advance_;
  std::function<void(srm::Rows&)> record_, close_period_;
  std::unique_ptr<srm::Rows> waveforms_, periods_;
};

}  // namespace

void bind_simulation(nb::module_& m) {
  nb::enum_<srm::Shaft>(m, "Shaft")
      .value("locked", srm::Shaft::locked)
      .value("turning", srm::Shaft::turning);
  nb::enum_<srm::Outer>(m, "Outer")
      .value("torque", srm::Outer::torque)
      .value("speed", srm::Outer::speed);
  nb::enum_<srm::Comparators>(m, "Comparators")
      .value("analog", srm::Comparators::analog)
      .value("sampled", srm::Comparators::sampled);
  nb::class_<AnyController>(m, "Controller", "A complete controller, ready to be sampled.");
  nb::class_<Setting>(m, "Setting", "What every control law is given beside its own parameters.")
      .def(
          "__init__",
          [](Setting* self, const AnyMachine& machine, int n_phases, bool single, srm::Outer outer,
             double K_p, double K_i, double tau_min, double tau_max, double T_s,
             double tracker_bandwidth, srm::Comparators comparators, double t_dead) {
            new (self) Setting{
                machine,           n_phases,    single, outer, {K_p, K_i, tau_min, tau_max, T_s},
                tracker_bandwidth, comparators, t_dead};
          },
          nb::kw_only(), nb::arg("machine"), nb::arg("n_phases"), nb::arg("single"),
          nb::arg("outer"), nb::arg("K_p"), nb::arg("K_i"), nb::arg("tau_min"), nb::arg("tau_max"),
          nb::arg("T_s"), nb::arg("tracker_bandwidth") = 0.0,
          nb::arg("comparators") = srm::Comparators::analog, nb::arg("t_dead") = 0.0);
  nb::class_<AnySimulation>(m, "Simulation", "The closed loop. SI units.")
      .def(
          "__init__",
          [](AnySimulation* self, const AnyMachine& machine, int n_phases, double R, double u_dc,
             double v_switch, double R_switch, double v_diode, double R_diode, double t_dead,
             srm::Shaft shaft, double J, double B, double k_pump, double tau_load, double T_s,
             int delay, int adc_bits, double i_range, int encoder_counts,
             const AnyController& controller, const std::vector<double>& t_ref,
             const std::vector<double>& ref, double omega_m, double theta_m, double dt_max,
             double i_scale, double record_every) {
            new (self) AnySimulation(
                machine, n_phases, R, {u_dc, v_switch, R_switch, v_diode, R_diode, t_dead},
                {shaft, J, B, k_pump, tau_load}, {T_s, delay, adc_bits, i_range, encoder_counts},
                controller, {t_ref, ref}, omega_m, theta_m, {dt_max, i_scale, record_every});
          },
          nb::kw_only(), nb::arg("machine"), nb::arg("n_phases"), nb::arg("R"), nb::arg("u_dc"),
          nb::arg("v_switch"), nb::arg("R_switch"), nb::arg("v_diode"), nb::arg("R_diode"),
          nb::arg("t_dead") = 0.0, nb::arg("shaft"), nb::arg("J"), nb::arg("B"), nb::arg("k_pump"),
          nb::arg("tau_load"), nb::arg("T_s"), nb::arg("delay"), nb::arg("adc_bits"),
          nb::arg("i_range"), nb::arg("encoder_counts"), nb::arg("controller"), nb::arg("t_ref"),
          nb::arg("ref"), nb::arg("omega_m"), nb::arg("theta_m"), nb::arg("dt_max"),
          nb::arg("i_scale") = 100.0, nb::arg("record_every"))
      .def("advance", &AnySimulation::advance, nb::arg("t_stop"),
           nb::call_guard<nb::gil_scoped_release>(),
           "Runs to t_stop [s] or until a table is full; returns the time reached.")
      .def("record", &AnySimulation::record, "Adds the present instant to the waveforms.")
      .def("close_period", &AnySimulation::close_period,
           "Adds the integrals so far to the periods.")
      .def("take_waveforms", &AnySimulation::take_waveforms,
           "Rows recorded since the last call: t, theta_m, omega_m, tau_ref, then i, leg, i_ref "
           "of each phase.")
      .def("take_periods", &AnySimulation::take_periods,
           "Rows at the ends of electrical periods since the last call: t, theta_m, omega_m, W_f, "
           "turn_ons, S_on, S_off, tau_min, tau_max, omega_min, omega_max, i_peak, integrals of "
           "p_dc, p_winding, p_mech, tau, tau^2, (tau - tau_ref)^2, i^2 per phase, tau_ref.");
}

}  // namespace bound
