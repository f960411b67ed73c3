// Drive, power stage or controller for one machine model and number of phases.
#pragma once

#include <algorithm>
#include <cstring>
#include <optional>

#include "srm/c_api/control_part.hpp"
#include "srm/c_api/unit.hpp"

namespace srm::c_api {

/// All that a blob holds but the controller, which follows under the name `control`.
template <Machine M, int N>
struct LoopParameters {
  Plant<M, N> plant;
  double t_dead;
  Sampling sampling;
  Course reference;
  double theta_m;
  Resolution resolution;
  SRM_FIELDS(plant, t_dead, sampling, reference, theta_m, resolution)
};

/// Currents, speed and voltage beyond which no drive is: there numbers have lost their meaning.
inline constexpr double most = 1e9;

template <Machine M, int N>
class DriveUnit final : public Unit {
 public:
  using Loop = Simulation<M, N>;
  using Seen = Measurement<double, N>;

  /// identity: of the blob, so that a state of another is refused.
  DriveUnit(LoopParameters<M, N> given, Tables memory, std::unique_ptr<ControlPart<N>> control,
            srm_part part, std::uint64_t identity)
      : given_(std::move(given)),
        memory_(std::move(memory)),
        control_(std::move(control)),
        part_(part),
        identity_(identity) {
    add_numbers(given_, numbers_);
    Names names(numbers_, true);
    names.name("control");
    control_->walk(names);
    list_inputs();
    for (const Number& n : numbers_) names_[SRM_PARAMETER].push_back(n.name);
    for (const Input& n : inputs_) names_[SRM_INPUT].push_back(n.name);
    if (part != SRM_CONTROLLER) {
      names_[SRM_WAVEFORM] =
          follows() ? column_names(FollowedWaveform<N>{}) : column_names(Waveform<N>{});
      names_[SRM_PERIOD] = names_[SRM_LAST_PERIOD] = column_names(Period<N>{});
      for (int k = 0; k < N; ++k) names_[SRM_LEG].push_back("leg_" + std::to_string(k));
    }
    names_[SRM_MEASUREMENT] = column_names(Seen{});
    for (int k = 0; k < N; ++k) {
      for (const std::string& name : column_names(PhaseCommand<double>{})) {
        names_[SRM_ORDER].push_back(name + "_" + std::to_string(k));
      }
    }
    if (control_->supervised()) names_[SRM_ORDER].push_back("at_once");
    if (part != SRM_STAGE) names_[SRM_ORDER].push_back("tau_ref");
    if (part != SRM_STAGE && control_->supervised()) names_[SRM_STATES] = column_names(States{});
  }
  DriveUnit(const DriveUnit&) = delete;  // the loop calls the controller of its own unit
  DriveUnit& operator=(const DriveUnit&) = delete;

  Outcome start() override {
    if (started_) return {SRM_WRONG_ORDER};
    if (const Fault f = unsound()) return {SRM_BAD_PARAMETER, f};
    control_->reset();
    orders_ = {};
    seen_ = {};
    if (part_ != SRM_CONTROLLER) {
      Controller<N> controller;
      if (part_ == SRM_DRIVE) {
        controller = [this](const Seen& y, double reference) {
          Orders<N> given = control_->step(y, reference);
          note_state();
          orders_.tau_ref = given.tau_ref;
          orders_.at_once = given.at_once;
          return given;
        };
      }
      loop_.emplace(given_.plant, given_.t_dead, given_.sampling, std::move(controller),
                    given_.reference, given_.theta_m, given_.resolution);
      for (const Input& input : inputs_) {
        if (!input.of_control) put_input(input);
      }
      const bool records = given_.resolution.record_every >= 0;
      waveforms_.emplace(int(names_[SRM_WAVEFORM].size()), records ? 20000 : 1);
      periods_.emplace(columns_of(Period<N>{}), 1000);
      last_period_ = loop_->period();
      loop_->close_period(*periods_);
    }
    if (!names_[SRM_STATES].empty()) entered_.emplace(columns_of(States{}), 1000);
    mode_ = -1;
    looked_ = false;
    started_ = true;
    return {};
  }

  void reset() override {
    started_ = false;
    loop_.reset();
    waveforms_.reset();
    periods_.reset();
    entered_.reset();
  }

  Outcome advance(double t_stop, double& reached) override {
    if (part_ == SRM_CONTROLLER) return {SRM_WRONG_PART};
    if (!started_) return {SRM_WRONG_ORDER};
    if (!is_finite(t_stop)) return {SRM_NOT_FINITE, "t_stop"};
    if (looked_ && t_stop >= loop_->t()) {
      loop_->restore(before_);
      looked_ = false;
    }
    if (t_stop < loop_->t()) return {SRM_BAD_PARAMETER, "t_stop is in the past"};
    const int known = periods_->size();
    reached = loop_->advance_whole(t_stop, *waveforms_, *periods_);
    if (periods_->size() > known) {
      last_period_ = periods_->template row<Period<N>>(periods_->size() - 1);
    }
    if (reached < t_stop) return diverged() ? Outcome{SRM_DIVERGED} : Outcome{SRM_MORE};
    if (loop_->t() < t_stop || loop_->within_step()) {
      before_ = loop_->snapshot();
      loop_->peek(t_stop);
      looked_ = true;
      reached = loop_->t();
    }
    if (diverged()) return {SRM_DIVERGED};
    return {reached < t_stop ? SRM_MORE : SRM_OK};
  }

  Outcome sample() override {
    if (part_ == SRM_DRIVE) return {SRM_WRONG_PART};
    if (!started_) return {SRM_WRONG_ORDER};
    if (part_ == SRM_CONTROLLER) {
      orders_ = control_->step(seen_, given_.reference.at(0));
      note_state();
    } else {
      if (const Outcome edges = edges_rise(orders_.command); edges.status != SRM_OK) return edges;
      looked_ = false;
      loop_->obey(orders_);
    }
    return {};
  }

  const std::vector<std::string>& names(srm_table table) const override { return names_[table]; }

  Outcome read(srm_table table, double* values) override {
    if (table == SRM_PARAMETER || table == SRM_INPUT) {
      for (const Number& n : numbers_) {
        if (table == SRM_PARAMETER) *values++ = n.get();
      }
      for (const Input& n : inputs_) {
        if (table == SRM_INPUT) *values++ = n.course->value[0];
      }
      return {};
    }
    if (!started_) return {SRM_WRONG_ORDER};
    switch (table) {
      case SRM_WAVEFORM:
        if (follows()) {
          write_columns(loop_->followed_waveform(), values);
        } else {
          write_columns(loop_->waveform(), values);
        }
        break;
      case SRM_PERIOD:
        write_columns(loop_->period(), values);
        break;
      case SRM_LAST_PERIOD:
        write_columns(last_period_, values);
        break;
      case SRM_MEASUREMENT:
        write_columns(part_ == SRM_CONTROLLER ? seen_ : loop_->sense(), values);
        break;
      case SRM_ORDER:
        values = write_columns(part_ == SRM_DRIVE ? loop_->command() : orders_.command, values);
        if (control_->supervised()) *values++ = double(orders_.at_once);
        if (part_ != SRM_STAGE) *values = orders_.tau_ref;
        break;
      case SRM_STATES:
        write_columns(control_->states(), values);
        break;
      default:
        for (int k = 0; k < N; ++k) values[k] = double(orders_.command[k].leg[0]);
    }
    return {};
  }

  Outcome write(srm_table table, std::size_t first, const double* values,
                std::size_t count) override {
    for (std::size_t j = 0; j < count; ++j) {
      if (!is_finite(values[j])) return {SRM_NOT_FINITE, names_[table][first + j]};
    }
    switch (table) {
      case SRM_PARAMETER:
        return write_parameters(first, values, count);
      case SRM_INPUT:
        return write_inputs(first, values, count);
      case SRM_MEASUREMENT:
        if (part_ != SRM_CONTROLLER) return {SRM_NOT_WRITABLE};
        return write_row(seen_, first, values, count);
      case SRM_ORDER:
        if (part_ != SRM_STAGE) return {SRM_NOT_WRITABLE};
        return write_orders(first, values, count);
      case SRM_LEG:
        if (part_ != SRM_STAGE) return {SRM_NOT_WRITABLE};
        return write_legs(first, values, count);
      default:
        return {SRM_NOT_WRITABLE};
    }
  }

  Outcome take(srm_table table, double* rows, std::size_t capacity, std::size_t& count) override {
    if (table != SRM_WAVEFORM && table != SRM_PERIOD && table != SRM_STATES) {
      return {SRM_WRONG_PART};
    }
    if (!started_) return {SRM_WRONG_ORDER};
    std::optional<Rows>& from = table == SRM_WAVEFORM ? waveforms_
                                : table == SRM_PERIOD ? periods_
                                                      : entered_;
    if (!from) return {SRM_WRONG_PART};
    if (capacity < std::size_t(from->size())) return {SRM_WRONG_SIZE, "rows that wait"};
    count = std::size_t(from->size());
    std::copy_n(from->data(), count * std::size_t(from->columns()), rows);
    from->clear();
    return {};
  }

  std::size_t state_size() const override { return sizeof(Saved) + control_->state_size(); }

  Outcome save(unsigned char* bytes) override {
    if (!started_) return {SRM_WRONG_ORDER};
    Saved saved{};
    saved.identity = identity_;
    saved.part = part_;
    saved.looked = looked_;
    saved.orders = orders_;
    saved.seen = seen_;
    saved.mode = mode_;
    if (loop_) {
      saved.now = loop_->snapshot();
      saved.before = looked_ ? before_ : saved.now;
      saved.last_period = last_period_;
    }
    std::memcpy(bytes, &saved, sizeof saved);
    control_->save(bytes + sizeof saved);
    const std::uint64_t sum = checksum(bytes);
    std::memcpy(bytes, &sum, sizeof sum);
    return {};
  }

  Outcome restore(const unsigned char* bytes) override {
    if (!started_) return {SRM_WRONG_ORDER};
    Saved saved;
    std::memcpy(static_cast<void*>(&saved), bytes, sizeof saved);
    if (saved.checksum != checksum(bytes)) return {SRM_WRONG_CHECKSUM};
    if (saved.identity != identity_ || saved.part != part_) return {SRM_WRONG_STATE};
    looked_ = saved.looked;
    orders_ = saved.orders;
    seen_ = saved.seen;
    mode_ = saved.mode;
    if (entered_) entered_->clear();
    control_->restore(bytes + sizeof saved);
    if (!loop_) return {};
    loop_->restore(saved.now);
    before_ = saved.before;
    last_period_ = saved.last_period;
    waveforms_->clear();
    periods_->clear();
    return {};
  }

 private:
  /// The rotor by the flux linkages: rows of waveforms have the estimate.
  bool follows() const { return part_ != SRM_STAGE && control_->follows(); }

  /// A saved state; the state of the controller follows it.
  struct Saved {
    std::uint64_t checksum, identity;
    srm_part part;
    bool looked;
    Orders<N> orders;
    Seen seen;
    double mode;
    typename Loop::Snapshot now, before;
    Period<N> last_period;
  };
  static_assert(std::is_trivially_copyable_v<Saved>, "a state is saved as bytes");

  /// Over all that follows the checksum, bytes between members included: they are copied too.
  std::uint64_t checksum(const unsigned char* bytes) const {
    return hashed(hash_start, {reinterpret_cast<const char*>(bytes) + 8, state_size() - 8});
  }

  /// A row for each state that the drive enters; the first of those that wait stay.
  void note_state() {
    if (!entered_) return;
    const States states = control_->states();
    if (states.now.mode == mode_) return;
    mode_ = states.now.mode;
    if (!entered_->full()) entered_->add(states);
  }

  void list_inputs() {
    const auto constant = [&](const char* name, Course& course) {
      list_constant(inputs_, name, course, false);
    };
    if (part_ != SRM_STAGE) {
      constant("reference", given_.reference);
      control_->list_inputs(inputs_);
    }
    if (part_ == SRM_CONTROLLER) return;
    Plant<M, N>& p = given_.plant;
    if (auto* source = std::get_if<StiffSource>(&p.source)) constant("u_dc", source->u_dc);
    if (auto* source = std::get_if<Battery>(&p.source)) constant("u_dc", source->E);
    if (auto* source = std::get_if<PvArray>(&p.source)) {
      constant("poa_global", source->poa_global);
      constant("temp_cell", source->temp_cell);
    }
    if (p.shaft.rotation == Rotation::locked) {
      constant("omega_m", p.shaft.omega);
    } else {
      constant("tau_load", p.shaft.tau_0);
    }
    if (!p.shaft.pump.tau.empty()) constant("H_static", p.shaft.pump.H_static);
  }

  /// The same course within the loop's own copy of the parameters.
  void put_input(const Input& input) {
    const double value = input.course->value[0];
    loop_->change([&](Plant<M, N>& p, Course& reference) {
      Plant<M, N>& mine = given_.plant;
      const auto moved = [&](const Course& from, Course& to) {
        if (&from == input.course) to.value[0] = value;
      };
      moved(given_.reference, reference);
      std::visit(
          [&]<class S>(S& source) {
            S& to = std::get<S>(p.source);
            if constexpr (requires { to.poa_global; }) {
              moved(source.poa_global, to.poa_global);
              moved(source.temp_cell, to.temp_cell);
            } else if constexpr (requires { to.E; }) {
              moved(source.E, to.E);
            } else {
              moved(source.u_dc, to.u_dc);
            }
          },
          mine.source);
      moved(mine.shaft.omega, p.shaft.omega);
      moved(mine.shaft.tau_0, p.shaft.tau_0);
      moved(mine.shaft.pump.H_static, p.shaft.pump.H_static);
    });
  }

  Fault unsound() const {
    if (const Fault f = control_->unsound()) return f;
    if (part_ == SRM_CONTROLLER) return fault(given_.reference);
    if (const Fault f = fault(given_.plant)) return f;
    if (const Fault f = fault(given_.sampling)) return f;
    if (const Fault f = fault(given_.reference)) return f;
    if (!(given_.t_dead >= 0)) return "t_dead";
    if (!(std::fabs(given_.theta_m) <= 1e4)) return "theta_m";
    return fault(given_.resolution);
  }

  bool diverged() const {
    const State<N>& x = loop_->state();
    bool fine = std::fabs(x.omega_m) < most && std::fabs(x.theta_m) < most && x.u_dc < most;
    for (const double i : x.i) fine = fine && i < most;
    return !fine;
  }

  Outcome write_parameters(std::size_t first, const double* values, std::size_t count) {
    if (started_) return {SRM_WRONG_ORDER, "parameters, after srm_start"};
    for (std::size_t j = 0; j < count; ++j) {
      const Number& number = numbers_[first + j];
      const double before = number.get();
      if (number.set(values[j])) continue;
      number.set(before);
      return {SRM_BAD_PARAMETER, number.name};
    }
    return {};
  }

  Outcome write_inputs(std::size_t first, const double* values, std::size_t count) {
    std::vector<double> before(values, values + count);
    const auto exchange = [&] {
      for (std::size_t j = 0; j < count; ++j) {
        std::swap(before[j], inputs_[first + j].course->value[0]);
      }
    };
    exchange();
    const auto fault_of = [](const auto& source) { return fault(source); };
    if (const Fault wrong = std::visit(fault_of, given_.plant.source)) {
      exchange();
      return {SRM_BAD_PARAMETER, wrong};
    }
    for (std::size_t j = 0; j < count; ++j) {
      const Input& input = inputs_[first + j];
      if (before[j] == values[j] || !loop_ || input.of_control) continue;
      looked_ = false;  // from here on the run is another one
      put_input(input);
    }
    return {};
  }

  template <class S>
  Outcome write_row(S& to, std::size_t first, const double* values, std::size_t count) {
    double row[64];
    static_assert(sizeof(S) <= sizeof row);
    write_columns(to, row);
    std::copy_n(values, count, row + first);
    read_columns(to, row);
    return {};
  }

  Outcome write_orders(std::size_t first, const double* values, std::size_t count) {
    std::vector<double> row(names_[SRM_ORDER].size());
    double* end = write_columns(orders_.command, row.data());
    if (control_->supervised()) *end = double(orders_.at_once);
    std::copy_n(values, count, row.begin() + std::ptrdiff_t(first));
    std::vector<Number> places;
    Orders<N> given = orders_;
    Command<double, N>& trial = given.command;
    for (PhaseCommand<double>& c : trial) add_numbers(c, places);
    if (control_->supervised()) add_numbers(given.at_once, places);
    for (std::size_t j = 0; j < row.size(); ++j) {
      if (!places[j].set(row[j])) return {SRM_BAD_PARAMETER, names_[SRM_ORDER][j]};
    }
    for (const PhaseCommand<double>& c : trial) {
      if (!(c.i_band >= 0)) return {SRM_BAD_PARAMETER, "i_band"};
      for (const double t : c.t_edge) {
        if (!(t >= 0)) return {SRM_BAD_PARAMETER, fall};
      }
    }
    const Outcome whole = count == row.size() ? edges_rise(trial) : Outcome{};
    if (whole.status == SRM_OK) orders_ = given;
    return whole;
  }

  /// Whether the edges of an order stand in their turn. Who sets one after the other passes through
  /// orders in which they do not.
  static Outcome edges_rise(const Command<double, N>& command) {
    for (const PhaseCommand<double>& c : command) {
      if (!std::ranges::is_sorted(c.t_edge)) return {SRM_BAD_PARAMETER, fall};
    }
    return {};
  }
  static constexpr const char* fall = "t_edge: need edges that do not fall";

  Outcome write_legs(std::size_t first, const double* values, std::size_t count) {
    Command<double, N> trial = orders_.command;
    for (std::size_t j = 0; j < count; ++j) {
      Leg leg{};
      if (!put(leg, values[j])) return {SRM_BAD_PARAMETER, names_[SRM_LEG][first + j]};
      trial[first + j] = hold<double>(leg);
    }
    orders_.command = trial;
    return {};
  }

  LoopParameters<M, N> given_;
  Tables memory_;  // of the tables that the parameters view
  std::unique_ptr<ControlPart<N>> control_;
  srm_part part_;
  std::uint64_t identity_;
  std::vector<Number> numbers_;
  std::vector<Input> inputs_;
  std::array<std::vector<std::string>, 9> names_;

  bool started_ = false;
  std::optional<Loop> loop_;
  Orders<N> orders_{};
  Seen seen_{};
  bool looked_ = false;  // the loop is past its last whole step, which `before_` holds
  typename Loop::Snapshot before_{};
  Period<N> last_period_{};
  double mode_ = -1;  // of the drive at its last sample; none before the first
  std::optional<Rows> waveforms_, periods_, entered_;
};

}  // namespace srm::c_api
