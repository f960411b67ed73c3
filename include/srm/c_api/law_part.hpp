// The law within a controller, without its type: what stands around it is compiled once for each
// precision, machine model and number of phases, and not for each law besides.
#pragma once

#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "srm/c_api/named.hpp"
#include "srm/c_api/sound.hpp"

namespace srm::c_api {

template <Real T, int N>
class LawPart {
 public:
  virtual ~LawPart() = default;

  virtual void walk(Reader& reader) = 0;
  virtual void walk(Names& names) = 0;
  virtual Fault unsound() const = 0;

  virtual void reset() = 0;
  virtual Command<T, N> step(const Measurement<T, N>& y, T tau_ref) = 0;

  virtual std::size_t state_size() const = 0;
  virtual void save(unsigned char* bytes) const = 0;
  virtual void restore(const unsigned char* bytes) = 0;
};

template <class Law>
class LawOf final : public LawPart<typename Law::Scalar, Law::n_phases> {
 public:
  using T = typename Law::Scalar;
  static constexpr int N = Law::n_phases;
  using State = typename Law::State;
  static_assert(std::is_trivially_copyable_v<State>, "a state is saved as bytes");

  void walk(Reader& reader) override { srm::walk(reader, law_); }
  void walk(Names& names) override { srm::walk(names, law_); }
  Fault unsound() const override { return fault_of_law(law_); }

  void reset() override { state_ = {}; }
  Command<T, N> step(const Measurement<T, N>& y, T tau_ref) override {
    return law_.step(state_, y, tau_ref);
  }

  std::size_t state_size() const override { return sizeof state_; }
  void save(unsigned char* bytes) const override { std::memcpy(bytes, &state_, sizeof state_); }
  void restore(const unsigned char* bytes) override {
    std::memcpy(static_cast<void*>(&state_), bytes, sizeof state_);
  }

 private:
  Law law_{};
  State state_{};
};

/// A law elsewhere, as a law.
template <Real T, int N>
struct PointedLaw {
  using Scalar = T;
  static constexpr int n_phases = N;
  struct State {
    bool running = false;  // a default state is that after reset
  };

  LawPart<T, N>* part = nullptr;

  Command<T, N> step(State& x, const Measurement<T, N>& y, T tau_ref) const {
    if (!x.running) part->reset();
    x.running = true;
    return part->step(y, tau_ref);
  }

  /// Its numbers are those of the law.
  template <class A>
  void walk(A& archive) {
    part->walk(archive);
  }
};

}  // namespace srm::c_api
