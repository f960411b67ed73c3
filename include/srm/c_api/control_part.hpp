// The controller within a unit, without the type of its law: drive_unit.hpp is compiled once per
// machine model and number of phases, and this once per law besides.
#pragma once

#include <cstring>
#include <string>
#include <vector>

#include "srm/c_api/named.hpp"
#include "srm/c_api/sound.hpp"
#include "srm/control/frame/drive_control.hpp"
#include "srm/sim/controller.hpp"
#include "srm/sim/desk.hpp"

namespace srm::c_api {

template <int N>
class ControlPart {
 public:
  virtual ~ControlPart() = default;

  virtual void read_parameters(Reader& reader) = 0;
  virtual void list_numbers(std::vector<Number>& found) = 0;
  virtual Fault unsound() const = 0;

  virtual void reset() = 0;
  virtual Orders<N> step(const Measurement<double, N>& y, double reference) = 0;
  virtual double tau_ref() const = 0;

  virtual std::size_t state_size() const = 0;
  virtual void save(unsigned char* bytes) const = 0;
  virtual void restore(const unsigned char* bytes) = 0;
};

template <class Law>
class ControlOf final : public ControlPart<Law::n_phases> {
 public:
  static constexpr int N = Law::n_phases;
  using T = typename Law::Scalar;
  using State = typename DriveControl<Law>::State;
  static_assert(std::is_trivially_copyable_v<State>, "a state is saved as bytes");

  void read_parameters(Reader& reader) override { reader.read(control_, memory_); }
  void list_numbers(std::vector<Number>& found) override {
    add_numbers(control_, "control", found);
    add_viewed_numbers(control_, "control", found);  // they lie in memory_
  }
  Fault unsound() const override { return fault(control_); }

  void reset() override { state_ = {}; }

  Orders<N> step(const Measurement<double, N>& y, double reference) override {
    return step_on_desk(control_, state_, y, reference);
  }

  double tau_ref() const override { return state_.frame.tau_ref; }

  std::size_t state_size() const override { return sizeof state_; }
  void save(unsigned char* bytes) const override { std::memcpy(bytes, &state_, sizeof state_); }
  void restore(const unsigned char* bytes) override {
    std::memcpy(static_cast<void*>(&state_), bytes, sizeof state_);
  }

 private:
  Tables memory_;  // of the tables that the law views
  DriveControl<Law> control_{};
  State state_{};
};

}  // namespace srm::c_api
