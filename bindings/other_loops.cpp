// Loops of environments, and of runs with a number of phases that is not usual (forms.hpp):
// compiled in less time than the loop of a run.
#include <algorithm>

#include "environments.hpp"
#include "other_forms.hpp"
#include "srm/c_api/named.hpp"

namespace bound {

namespace {

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

void loop(AnySimulation& simulation, const AnyController& controller, const SimulationParts& given,
          const AnySimulation::Faults& faults) {
  std::visit(
      [&]<int N, class M>(const srm::Controller<N>& step, const srm::Held<M>& model) {
        if constexpr (!has_form<Forms::usual, double, N>) {
          simulation.make(step, given, srm::Scaled<M>{model.value, model.value.N_r, 1.0}, faults);
        }
      },
      controller.step, given.machine);
}

}  // namespace

void bind_other_loops(nb::module_&) {
  add_other_form<MakesBatch>("batch", &batch);
  add_other_form<MakesLoop>("loop", &loop);
}

}  // namespace bound
