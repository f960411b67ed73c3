// The closed loop, alone and in batches for learning (forms.hpp). Both have the same loop.
#include <algorithm>

#include "environments.hpp"
#include "simulation.hpp"
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
    srm::c_api::add_numbers(episode_, "", numbers_);
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

}  // namespace

template <int N>
void AnySimulation::make_of(const Loop& given) {
  const auto* step = std::get_if<srm::Controller<N>>(&given.controller.step);
  if (step == nullptr) throw std::invalid_argument("the controller has another phase count");
  const bool records = given.resolution.record_every >= 0;
  waveforms_ =
      std::make_unique<srm::Rows>(srm::columns_of(srm::Waveform<N>{}), records ? waveform_rows : 1);
  periods_ = std::make_unique<srm::Rows>(srm::columns_of(srm::Period<N>{}), period_rows);
  std::visit(
      [&]<class M>(const srm::Held<M>& model) {
        memory_ = model.memory;
        using Motor = srm::Scaled<M>;  // as in a batch
        const srm::Plant<Motor, N> plant{
            {model.value, model.value.N_r, 1.0}, given.R, given.source, given.bridge, given.shaft};
        auto loop = std::make_shared<srm::Simulation<Motor, N>>(plant, given.t_dead, given.sampling,
                                                                *step, given.reference,
                                                                given.theta_m, given.resolution);
        advance_ = [loop](double t, srm::Rows& w, srm::Rows& p) { return loop->advance(t, w, p); };
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
      given.machine);
}

template <>
void AnySimulation::make<forms_here>(const Loop& given) {
  with_phases(given.n_phases, [&]<int N>() {
    if constexpr (has_form<forms_here, double, N>) {
      make_of<N>(given);
    } else {
      make<Forms::other>(given);
    }
  });
}

template <>
std::unique_ptr<Batch> made_batch<forms_here>(const BatchParts& given) {
  return with_phases(given.n_phases, [&]<int N>() -> std::unique_ptr<Batch> {
    if constexpr (has_form<forms_here, double, N>) {
      return std::visit(
          [&]<class M>(const srm::Held<M>& model) -> std::unique_ptr<Batch> {
            srm::Episode<M, N> episode{{{model.value, model.value.N_r, 1.0},
                                        given.R,
                                        given.source,
                                        given.bridge,
                                        given.shaft},
                                       given.theta_m,
                                       given.reference};
            return std::make_unique<BatchOf<M, N>>(given.count, std::move(episode), given.rules,
                                                   given.drawn, model.memory);
          },
          given.machine);
    } else {
      return made_batch<Forms::other>(given);
    }
  });
}

}  // namespace bound
