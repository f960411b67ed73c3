// The controller within a unit: a law and its frame, or these with the protection and the states
// of a drive around them (control/guard/supervised.hpp), as on a target.
#pragma once

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "srm/c_api/law_part.hpp"
#include "srm/control/guard/guarded.hpp"
#include "srm/control/guard/supervised.hpp"
#include "srm/sim/desk.hpp"
#include "srm/sim/supervision.hpp"

namespace srm::c_api {

/// A quantity that is constant in the drive file, and may be changed from outside.
struct Input {
  const char* name;
  Course* course;
  bool of_control;  // which alone reads it, at its samples
};

inline void list_constant(std::vector<Input>& found, const char* name, Course& course,
                          bool of_control) {
  const bool constant = course.t.size() == 1 && course.value.size() == 1;
  if (constant) found.push_back({name, &course, of_control});
}

/// Where a supervised drive is, and what its board does besides the legs.
struct States {
  Event now;  // at the last sample
  double gate_enable{}, precharged{}, chopper{};
  SRM_FIELDS(now, gate_enable, precharged, chopper)
};

template <int N>
class ControlPart {
 public:
  virtual ~ControlPart() = default;

  virtual void read_parameters(Reader& reader) = 0;
  virtual void list_numbers(std::vector<Number>& found) = 0;
  virtual void list_inputs(std::vector<Input>& found) = 0;
  virtual Fault unsound() const = 0;

  virtual void reset() = 0;
  virtual Orders<N> step(const Measurement<double, N>& y, double reference) = 0;

  virtual bool supervised() const = 0;
  virtual States states() const = 0;

  virtual std::size_t state_size() const = 0;
  virtual void save(unsigned char* bytes) const = 0;
  virtual void restore(const unsigned char* bytes) = 0;
};

/// What both kinds share: parameters of type P with a law by pointer, and a state of type S.
template <class P, class S, Real T, int N>
class ControlWith : public ControlPart<N> {
 public:
  explicit ControlWith(std::unique_ptr<LawPart<T, N>> law) : law_(std::move(law)) {}

  void read_parameters(Reader& reader) override { reader.read(given_, memory_); }
  void list_numbers(std::vector<Number>& found) override {
    add_numbers(given_, "control", found);
    add_viewed_numbers(given_, "control", found);
  }
  void reset() override { state_ = {}; }

  std::size_t state_size() const override { return sizeof state_ + law_->state_size(); }
  void save(unsigned char* bytes) const override {
    std::memcpy(bytes, &state_, sizeof state_);
    law_->save(bytes + sizeof state_);
  }
  void restore(const unsigned char* bytes) override {
    std::memcpy(static_cast<void*>(&state_), bytes, sizeof state_);
    law_->restore(bytes + sizeof state_);
  }

 protected:
  static_assert(std::is_trivially_copyable_v<S>, "a state is saved as bytes");
  Tables memory_;  // of the tables that the parameters view
  std::unique_ptr<LawPart<T, N>> law_;
  P given_{};
  S state_{};
};

template <Real T, int N>
using PointedControl = DriveControl<PointedLaw<T, N>>;

template <Real T, int N>
class PlainControl final
    : public ControlWith<PointedControl<T, N>, typename PointedControl<T, N>::State, T, N> {
 public:
  using Base = ControlWith<PointedControl<T, N>, typename PointedControl<T, N>::State, T, N>;
  explicit PlainControl(std::unique_ptr<LawPart<T, N>> law) : Base(std::move(law)) {
    this->given_.law.part = this->law_.get();
  }

  void list_inputs(std::vector<Input>&) override {}
  Fault unsound() const override { return this->law_->unsound(); }
  Orders<N> step(const Measurement<double, N>& y, double reference) override {
    return step_on_desk(this->given_, this->state_, y, reference);
  }
  bool supervised() const override { return false; }
  States states() const override { return {}; }
};

/// A drive with its states, and when it is enabled and cleared.
template <Machine M, int N>
struct SupervisedParameters {
  Supervised<Guarded<M, PointedControl<typename M::Scalar, N>>> drive;
  Supervision supervision;
  SRM_FIELDS(drive, supervision)
};

template <Machine M, int N>
class SupervisedControl final
    : public ControlWith<SupervisedParameters<M, N>,
                         SupervisedState<decltype(SupervisedParameters<M, N>::drive)>,
                         typename M::Scalar, N> {
 public:
  using P = SupervisedParameters<M, N>;
  using T = typename M::Scalar;
  using Base = ControlWith<P, SupervisedState<decltype(P::drive)>, T, N>;
  explicit SupervisedControl(std::unique_ptr<LawPart<T, N>> law) : Base(std::move(law)) {
    this->given_.drive.control.control.law.part = this->law_.get();
  }

  void list_inputs(std::vector<Input>& found) override {
    list_constant(found, "enable", this->given_.supervision.enable, true);
    list_constant(found, "clear", this->given_.supervision.clear, true);
  }
  Fault unsound() const override {
    const P& p = this->given_;
    if (const Fault f = this->law_->unsound()) return f;
    if (const Fault f = p.drive.control.machine.fault()) return f;
    if (const Fault f = fault(p.drive.control.protection)) return f;
    if (const Fault f = fault(p.drive.sequence)) return f;
    return fault<N>(p.supervision);
  }
  Orders<N> step(const Measurement<double, N>& y, double reference) override {
    const P& p = this->given_;
    Orders<N> orders = step_supervised(p.drive, p.supervision, this->state_, y, reference);
    const auto& law = this->state_.drive.control.law;
    orders.tau_ref = this->state_.outputs.gate_enable ? double(law.frame.tau_ref) : 0.0;
    return orders;
  }
  bool supervised() const override { return true; }
  States states() const override {
    const auto& x = this->state_;
    return {.now = event_of(this->given_.drive, x, this->given_.supervision.T_s),
            .gate_enable = double(x.outputs.gate_enable),
            .precharged = double(x.outputs.precharged),
            .chopper = double(x.outputs.chopper)};
  }
};

}  // namespace srm::c_api
