// Environments for learning: many drives that are stepped together, without the interpreter lock
// and without Python for each of them (python/reluctance/targets/gym).
#include "environments.hpp"

#include <nanobind/stl/unique_ptr.h>

#include "bind_struct.hpp"
#include "other_forms.hpp"

namespace bound {

namespace {

using Actions = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Flags = nb::ndarray<bool, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Prices = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Observations = nb::ndarray<float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

template <class... Array>
void check_lengths(const Batch& b, const Array&... arrays) {
  if (((arrays.shape(0) != std::size_t(b.size)) || ...)) {
    throw std::invalid_argument("need one row for each drive");
  }
}

void check_observations(const Batch& b, const Observations& observations) {
  check_lengths(b, observations);
  if (observations.shape(1) != std::size_t(b.observed())) {
    throw std::invalid_argument("observations have other columns");
  }
}

void step(Batch& b, const Actions& actions, const Flags& waiting, const Observations& observations,
          const Prices& prices, const Flags& tripped) {
  check_lengths(b, actions, waiting, prices, tripped);
  check_observations(b, observations);
  if (actions.shape(1) != std::size_t(b.n_phases)) {
    throw std::invalid_argument("need an action for each phase");
  }
  const nb::gil_scoped_release unlocked;
  b.step(actions.data(), waiting.data(), observations.data(), prices.data(), tripped.data());
}

void obey(Batch& b, const Actions& orders, const Observations& observations, const Prices& prices,
          const Flags& tripped) {
  check_lengths(b, orders, prices, tripped);
  check_observations(b, observations);
  if (orders.shape(1) != std::size_t(b.order_columns)) {
    throw std::invalid_argument("need the order columns of each phase");
  }
  const nb::gil_scoped_release unlocked;
  b.obey(orders.data(), observations.data(), prices.data(), tripped.data());
}

}  // namespace

void bind_environments(nb::module_& m) {
  nb::enum_<srm::Task>(m, "Task")
      .value("torque", srm::Task::torque)
      .value("current", srm::Task::current)
      .value("speed", srm::Task::speed);
  nb::enum_<srm::Action>(m, "Action")
      .value("legs", srm::Action::legs)
      .value("duties", srm::Action::duties)
      .value("currents", srm::Action::currents);
  bind_struct<srm::Rules>(m, "Rules",
                          "What is the same in all episodes of an environment: task and action, "
                          "sensors, units of the observation, trip levels, prices. SI units.");
  nb::class_<Batch>(m, "Batch",
                    "Drives for learning that are stepped together, a control period at a time. "
                    "Arrays have a row for each drive.")
      .def_ro("size", &Batch::size, "Drives.")
      .def_prop_ro("observed", &Batch::observed, "Columns of the observations.")
      .def("numbers", &Batch::numbers, "The numbers that an episode begins with, and their names.")
      .def("start", &Batch::start, nb::arg("drive"), nb::arg("drawn"),
           "Begins an episode of a drive with a value for each name in `drawn`.")
      .def(
          "observe",
          [](const Batch& b, const Observations& to) {
            check_observations(b, to);
            b.observe(to.data());
          },
          nb::arg("observations"), "Writes the observations.")
      .def("step", &step, nb::arg("actions"), nb::arg("waiting"), nb::arg("observations"),
           nb::arg("prices"), nb::arg("tripped"),
           "One control period of all drives but those that wait; writes the last three.")
      .def("obey", &obey, nb::arg("orders"), nb::arg("observations"), nb::arg("prices"),
           nb::arg("tripped"), "The same with orders of control laws, the columns of each phase.")
      .def("figures", &Batch::figures, nb::arg("drive"),
           "Since the start of an episode: duration [s]; integrals of torque, of its squared "
           "error, of "
           "copper loss, mechanical power and power of the dc link; turn-ons.")
      .def("sample", &Batch::sample, nb::arg("drive"),
           "The columns of the last measurement, and the reference.");
  const auto batch = [](int count, int n_phases, const SimulationParts& of, const srm::Rules& rules,
                        const std::vector<std::string>& drawn) {
    return other_form<MakesBatch>("batch", other_loops)(count, n_phases, of, rules, drawn);
  };
  m.def("batch", batch, nb::arg("count"), nb::arg("n_phases"), nb::arg("loop"), nb::kw_only(),
        nb::arg("rules"), nb::arg("drawn"),
        "Drives that share all but the numbers named in `drawn`.");
}

}  // namespace bound
