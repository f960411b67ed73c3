// Commissioning on a simulated bench, from Python.
#include "srm/sim/bench.hpp"

#include <nanobind/stl/array.h>

#include "bind_struct.hpp"
#include "simulation.hpp"
#include "trees.hpp"

namespace bound {

namespace {

/// One routine on one bench, whatever the number of phases.
class AnyBench {
 public:
  AnyBench(const srm::Commission<double>& routines, const std::vector<int>& phase,
           const std::vector<int>& sensor, const std::vector<int>& sign, int direction, double zero,
           srm::Routine routine, int pulsed, int count, int held, double i_held) {
    with_phases(int(phase.size()), [&]<int N>() {
      auto bench = std::make_shared<srm::Bench<N>>();
      srm::assign(bench->routines, routines);
      if (int(sensor.size()) != N || int(sign.size()) != N) {
        throw std::invalid_argument("phase, sensor and sign need as many entries");
      }
      for (int k = 0; k < N; ++k) {
        if (phase[k] < 0 || phase[k] >= N || sensor[k] < 0 || sensor[k] >= N) {
          throw std::invalid_argument("phase and sensor need numbers of phases");
        }
        bench->wires.phase[k] = phase[k];
        bench->wires.sensor[k] = sensor[k];
        bench->wires.sign[k] = sign[k] < 0 ? -1 : 1;
      }
      bench->wires.direction = direction < 0 ? -1 : 1;
      bench->wires.zero = zero;
      bench->routines.template start<N>(bench->state, routine, pulsed, count, held,
                                        static_cast<float>(i_held));
      controller.step = srm::Controller<N>(
          [bench](const srm::Measurement<double, N>& y, double) { return bench->step(y); });
      found_ = [bench] { return found_on(*bench); };
      rows_ = [bench] { return table(bench->rows); };
      finding_ = [bench] { return bench->state.finding; };
    });
  }

  srm::Finding finding() const { return finding_(); }
  nb::dict found() const { return found_(); }
  nb::ndarray<nb::numpy, double> rows() const { return rows_(); }

  AnyController controller;

 private:
  template <int N>
  static nb::dict found_on(const srm::Bench<N>& b) {
    const auto& x = b.state;
    nb::dict all;
    all["progress"] = x.progress;
    all["samples"] = x.samples;
    all["sensor"] = x.wiring.sensor;
    all["sign"] = x.wiring.sign;
    all["R"] = x.resistance.R;
    all["place"] = x.alignment.place;
    all["direction"] = x.alignment.direction;
    all["zero"] = x.alignment.zero;
    all["spread"] = x.alignment.spread;
    return all;
  }

  static nb::ndarray<nb::numpy, double> table(const std::vector<srm::PulseRow<float>>& rows) {
    std::vector<double> values;
    for (const srm::PulseRow<float>& row : rows) {
      for (const double value :
           {double(row.pulse), double(row.sample), double(row.u_mean), double(row.i),
            double(row.theta_e), double(row.u_held), double(row.i_held)}) {
        values.push_back(value);
      }
    }
    return numpy(std::move(values), {rows.size(), 7});
  }

  std::function<nb::dict()> found_;
  std::function<nb::ndarray<nb::numpy, double>()> rows_;
  std::function<srm::Finding()> finding_;
};

}  // namespace

void bind_bench(nb::module_& m) {
  nb::enum_<srm::Routine>(m, "Routine", "A commissioning routine.")
      .value("wiring", srm::Routine::wiring)
      .value("resistance", srm::Routine::resistance)
      .value("alignment", srm::Routine::alignment)
      .value("pulses", srm::Routine::pulses);
  bind_struct<srm::CurrentHold<double>>(m, "CurrentHold", "PI controller of a held current.");
  bind_struct<srm::Wiring<double>>(m, "Wiring", "A short pulse of each leg. SI units.");
  bind_struct<srm::Resistance<double>>(m, "Resistance", "Two currents of each phase. SI units.");
  bind_struct<srm::Alignment<double>>(m, "Alignment", "Rests of a free rotor. SI units.");
  bind_struct<srm::FluxPulses<double>>(m, "FluxPulses",
                                       "Voltage pulses at a clamped rotor. SI units.");
  bind_struct<srm::Commission<double>>(m, "Commission",
                                       "The commissioning routines, and the checks around them.");
  m.def(
      "described_commission",
      [](const srm::Commission<double>& routines) {
        srm::Commission<float> single;
        srm::assign(single, routines);
        return nb::cast<nb::dict>(tree(single));
      },
      nb::arg("routines"), "In single precision as a tree of names and numbers, for export.");
  nb::class_<AnyBench>(m, "Bench", "A routine between a plant and how somebody has wired it.")
      .def(
          nb::init<const srm::Commission<double>&, const std::vector<int>&, const std::vector<int>&,
                   const std::vector<int>&, int, double, srm::Routine, int, int, int, double>(),
          nb::kw_only(), nb::arg("routines"), nb::arg("phase"), nb::arg("sensor"), nb::arg("sign"),
          nb::arg("direction"), nb::arg("zero"), nb::arg("routine"), nb::arg("pulsed"),
          nb::arg("count"), nb::arg("held") = -1, nb::arg("i_held") = 0.0)
      .def_ro("controller", &AnyBench::controller, "Takes the place of a drive's controller.")
      .def_prop_ro(
          "finding", [](const AnyBench& b) { return int(b.finding()); }, "Number of the finding.")
      .def_prop_ro(
          "text", [](const AnyBench& b) { return srm::describe(b.finding()); }, "In words.")
      .def("found", &AnyBench::found, "What was found so far, SI units.")
      .def("rows", &AnyBench::rows,
           "The recording of the pulses: pulse, sample, mean voltage since the row before [V], "
           "current [A], electrical angle as shown [rad], and of the held phase mean voltage [V] "
           "and current [A].");
}

}  // namespace bound
