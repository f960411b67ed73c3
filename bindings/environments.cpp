// Environments for learning: many drives that are stepped together, without the interpreter lock
// and without Python for each of them (python/reluctance/targets/gym). Compiled in less time than
// the loop of a run, which is theirs for numbers of phases that are not usual.
#include <nanobind/stl/unique_ptr.h>

#include <algorithm>

#include "bind_struct.hpp"
#include "simulation.hpp"
#include "srm/c_api/named.hpp"
#include "srm/sim/environment.hpp"

namespace bound {

namespace {

using Actions = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Flags = nb::ndarray<bool, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Prices = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Observations = nb::ndarray<float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

/// Drives that share machine model, number of phases and rules, whatever those are.
class Batch {
 public:
  virtual ~Batch() = default;

  /// The numbers that an episode begins with, by name.
  virtual std::vector<std::pair<std::string, double>> numbers() const = 0;
  virtual int observed() const = 0;
  virtual void start(int j, const std::vector<double>& drawn) = 0;
  virtual void observe(float* to) const = 0;
  virtual void step(const double* actions, const bool* waiting, float* observations, double* prices,
                    bool* tripped) = 0;
  virtual void obey(const double* orders, float* observations, double* prices, bool* tripped) = 0;
  virtual std::vector<double> figures(int j) const = 0;
  virtual std::vector<double> sample(int j) const = 0;

  int size = 0, n_phases = 0, order_columns = 0;
};

template <srm::Motor M, int N>
class BatchOf final : public Batch {
 public:
  using One = srm::Environment<M, N>;

  BatchOf(int count, srm::Episode<M, N> episode, const srm::Rules& rules,
          const std::vector<std::string>& drawn, std::shared_ptr<const void> memory)
      : episode_(std::move(episode)),
        rules_(rules),
        all_(std::size_t(count)),
        memory_(std::move(memory)) {
    size = count;
    n_phases = N;
    order_columns = N * srm::columns_of(srm::PhaseCommand<double>{});
    srm::c_api::add_numbers(episode_, numbers_);
    for (const std::string& name : drawn) {
      const auto found = std::find_if(numbers_.begin(), numbers_.end(),
                                      [&](const auto& number) { return number.name == name; });
      if (found == numbers_.end()) throw std::invalid_argument("no number `" + name + "`");
      drawn_.push_back(*found);
    }
    for (One& one : all_) one.start(episode_, rules_);
  }
  BatchOf(const BatchOf&) = delete;  // numbers_ has places in its episode
  BatchOf& operator=(const BatchOf&) = delete;

  std::vector<std::pair<std::string, double>> numbers() const override {
    std::vector<std::pair<std::string, double>> found;
    for (const auto& number : numbers_) found.emplace_back(number.name, number.get());
    return found;
  }

  int observed() const override { return One::observed(rules_.task); }

  void start(int j, const std::vector<double>& drawn) override {
    if (drawn.size() != drawn_.size()) throw std::invalid_argument("need a value for each name");
    for (std::size_t n = 0; n < drawn.size(); ++n) {
      if (!drawn_[n].set(drawn[n])) throw std::invalid_argument(drawn_[n].name + " cannot be that");
    }
    all_.at(std::size_t(j)).start(episode_, rules_);
  }

  void observe(float* to) const override {
    for (const One& one : all_) {
      one.observe(rules_, to);
      to += One::observed(rules_.task);
    }
  }

  void step(const double* actions, const bool* waiting, float* observations, double* prices,
            bool* tripped) override {
    for (int j = 0; j < size; ++j) {
      One& one = all_[std::size_t(j)];
      prices[j] = waiting[j] ? 0 : one.step(actions + std::size_t(j) * N, rules_, rows_);
      tripped[j] = !waiting[j] && one.tripped();
      one.observe(rules_, observations + std::size_t(j) * std::size_t(observed()));
    }
  }

  void obey(const double* orders, float* observations, double* prices, bool* tripped) override {
    for (int j = 0; j < size; ++j) {
      One& one = all_[std::size_t(j)];
      srm::Orders<N> ordered;
      srm::read_columns(ordered.command, orders + std::size_t(j) * std::size_t(order_columns));
      prices[j] = one.obey(ordered, rules_, rows_);
      tripped[j] = one.tripped();
      one.observe(rules_, observations + std::size_t(j) * std::size_t(observed()));
    }
  }

  std::vector<double> figures(int j) const override {
    const auto now = all_.at(std::size_t(j)).figures();
    std::vector<double> row(std::size_t(srm::columns_of(now)));
    srm::write_columns(now, row.data());
    return row;
  }

  std::vector<double> sample(int j) const override {
    const One& one = all_.at(std::size_t(j));
    std::vector<double> row(std::size_t(srm::columns_of(one.seen())));
    srm::write_columns(one.seen(), row.data());
    row.push_back(one.reference());
    return row;
  }

 private:
  srm::Episode<M, N> episode_;
  srm::Rules rules_;
  std::vector<One> all_;
  std::shared_ptr<const void> memory_;  // of the machine's tables
  std::vector<srm::c_api::Number> numbers_, drawn_;
  srm::Unread<N> rows_;
};

std::unique_ptr<Batch> batch(int count, int n_phases, const SimulationParts& of,
                             const srm::Rules& rules, const std::vector<std::string>& drawn) {
  if (count < 1) throw std::invalid_argument("need at least one drive");
  return std::visit(
      [&]<class M>(const srm::Held<M>& model) {
        return with_phases(n_phases, [&]<int N>() -> std::unique_ptr<Batch> {
          const srm::Scaled<M> machine{model.value, model.value.N_r, 1.0};
          srm::Episode<M, N> episode{of.plant<srm::Scaled<M>, N>(machine), of.theta_m, 0.0};
          return std::make_unique<BatchOf<M, N>>(count, std::move(episode), rules, drawn,
                                                 of.memory());
        });
      },
      of.machine);
}

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

void AnySimulation::make_other(const AnyController& controller, const SimulationParts& given,
                               const Faults& faults) {
  std::visit(
      [&]<int N, class M>(const srm::Controller<N>& step, const srm::Held<M>& model) {
        if constexpr (!has_form<Forms::usual, double, N>) {
          make(step, given, srm::Scaled<M>{model.value, model.value.N_r, 1.0}, faults);
        }
      },
      controller.step, given.machine);
}

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
  m.def("batch", &batch, nb::arg("count"), nb::arg("n_phases"), nb::arg("loop"), nb::kw_only(),
        nb::arg("rules"), nb::arg("drawn"),
        "Drives that share all but the numbers named in `drawn`.");
}

}  // namespace bound
