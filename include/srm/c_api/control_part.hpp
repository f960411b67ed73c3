// The controller within a unit: a law and its frame, or these with the protection and the states
// of a drive around them (control/guard/supervised.hpp), as on a target, with or without diagnosis.
#pragma once

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "srm/c_api/law_part.hpp"
#include "srm/control/guard/diagnosed.hpp"
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

  virtual void walk(Reader& reader) = 0;
  virtual void walk(Names& names) = 0;
  virtual void list_inputs(std::vector<Input>& found) = 0;
  virtual Fault unsound() const = 0;

  virtual void reset() = 0;
  virtual Orders<N> step(const Measurement<double, N>& y, double reference) = 0;

  virtual bool supervised() const = 0;
  /// The rotor by the flux linkages: its waveforms have an estimate.
  virtual bool follows() const = 0;
  virtual States states() const = 0;

  virtual std::size_t state_size() const = 0;
  virtual void save(unsigned char* bytes) const = 0;
  virtual void restore(const unsigned char* bytes) = 0;
};

template <Real T, int N>
using PointedControl = DriveControl<PointedLaw<T, N>>;

template <Machine M, int N>
using PointedGuarded = Guarded<M, PointedControl<typename M::Scalar, N>>;
template <Machine M, int N>
using PointedDrive = SupervisedDrive<Supervised<PointedGuarded<M, N>>>;
template <Machine M, int N>
using DiagnosedDrive = SupervisedDrive<Supervised<Diagnosed<PointedGuarded<M, N>>>>;

/// The controller with parameters P: a PointedControl, a PointedDrive or a DiagnosedDrive.
template <class P>
class ControlOf final : public ControlPart<P::n_phases> {
  using T = typename P::Scalar;
  using State = typename P::State;
  static constexpr int N = P::n_phases;
  static constexpr bool with_states = requires(P p) { p.supervision; };
  static_assert(std::is_trivially_copyable_v<State>, "a state is saved as bytes");

 public:
  explicit ControlOf(std::unique_ptr<LawPart<T, N>> law) : law_(std::move(law)) {
    if constexpr (with_states) {
      guarded(given_.drive.control).control.law.part = law_.get();
    } else {
      given_.law.part = law_.get();
    }
  }

  void walk(Reader& reader) override { srm::walk(reader, given_); }
  void walk(Names& names) override { srm::walk(names, given_); }
  void list_inputs([[maybe_unused]] std::vector<Input>& found) override {
    if constexpr (with_states) {
      list_constant(found, "enable", given_.supervision.enable, true);
      list_constant(found, "clear", given_.supervision.clear, true);
    }
  }
  Fault unsound() const override {
    if (const Fault f = law_->unsound()) return f;
    if constexpr (with_states) {
      const auto& inner = guarded(given_.drive.control);
      if (const Fault f = inner.machine.fault()) return f;
      if (const Fault f = inner.control.coupling.fault(N)) return f;
      if (const Fault f = fault(inner.protection)) return f;
      if constexpr (requires { given_.drive.control.diagnosis; }) {
        if (const Fault f = fault(given_.drive.control.diagnosis)) return f;
        if (const Fault f = fault(given_.drive.control.flux_angle)) return f;
      }
      if (const Fault f = fault(given_.drive.sequence)) return f;
      return fault<N>(given_.supervision);
    } else {
      return given_.coupling.fault(N);
    }
  }

  void reset() override { state_ = {}; }
  Orders<N> step(const Measurement<double, N>& y, double reference) override {
    return step_on_desk(given_, state_, y, reference);
  }

  bool supervised() const override { return with_states; }
  bool follows() const override {
    if constexpr (requires { given_.drive.control.flux_angle; }) {
      return given_.drive.control.flux_angle.on();
    } else {
      return false;
    }
  }
  States states() const override {
    if constexpr (with_states) {
      const Outputs& now = state_.outputs;
      return {event_of(given_, state_), double(now.gate_enable), double(now.precharged),
              double(now.chopper)};
    } else {
      return {};
    }
  }

  std::size_t state_size() const override { return sizeof state_ + law_->state_size(); }
  void save(unsigned char* bytes) const override {
    std::memcpy(bytes, &state_, sizeof state_);
    law_->save(bytes + sizeof state_);
  }
  void restore(const unsigned char* bytes) override {
    std::memcpy(static_cast<void*>(&state_), bytes, sizeof state_);
    law_->restore(bytes + sizeof state_);
  }

 private:
  /// The guarded control, which a diagnosis may be around.
  template <class Control>
  static auto& guarded(Control& control) {
    if constexpr (requires { control.diagnosis; }) {
      return control.guarded;
    } else {
      return control;
    }
  }

  std::unique_ptr<LawPart<T, N>> law_;
  P given_{};
  State state_{};
};

}  // namespace srm::c_api
