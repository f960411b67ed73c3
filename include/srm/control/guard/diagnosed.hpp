// A guarded control that says what broke: the diagnosis in the place of the check of the currents.
#pragma once

#include "srm/control/guard/diagnosis.hpp"

namespace srm {

/// A guarded control that says what broke.
template <class Guarded>
struct Diagnosed {
  using Scalar = typename Guarded::Scalar;
  using T = Scalar;
  using Tuning = typename Guarded::Tuning;
  static constexpr int N = Guarded::N;
  static constexpr int n_phases = N;

  Guarded guarded;
  Diagnosis<T> diagnosis;
  SRM_FIELDS(guarded, diagnosis)

  struct State {
    typename Guarded::State guarded;
    typename Diagnosis<T>::template State<N> diagnosis;
  };

  constexpr Tuning tuning() const { return guarded.tuning(); }
  constexpr bool motors() const { return guarded.motors(); }

  template <Uses used = Uses{}>
  [[gnu::always_inline]] Status step(State& x, const Measurement<T, N>& y, T reference,
                                     Command<T, N>& orders, const Tuning& at) const {
    return guarded.template step<used>(x.guarded, y, reference, orders, at, Asked{*this, x});
  }

  void start(State& x) const {
    guarded.start(x.guarded);
    x.diagnosis = {};
    x.diagnosis.trial = PhaseTrial<T>::template begun<N>(diagnosis.psi_max);
  }
  void forget(State& x) const {
    guarded.forget(x.guarded);
    x.diagnosis = {};
  }
  template <Uses used = Uses{}>
  void watch(State& x, const Measurement<T, N>& y, const Tuning& at) const {
    guarded.template watch<used>(x.guarded, y, at);
  }
  const Fault<T>& fault(const State& x) const { return guarded.fault(x.guarded); }
  bool latched(const State& x) const { return guarded.latched(x.guarded); }
  const auto& law(const State& x) const { return guarded.law(x.guarded); }

 private:
  struct Asked {
    static constexpr bool on = true;
    const Diagnosed& self;
    State& x;

    bool finds(const Measurement<T, N>& y) const {
      return self.diagnosis.finds(x.diagnosis, x.guarded.guard, self.guarded.protection,
                                  self.guarded.machine, y);
    }
    bool tries(const Measurement<T, N>& y, Command<T, N>& orders) const {
      return self.diagnosis.tries(x.diagnosis, self.guarded.protection, self.guarded.machine, y,
                                  orders);
    }
    void explain() const { self.diagnosis.explain(x.diagnosis, x.guarded.guard); }
    void remember(const Command<T, N>& orders) const {
      self.diagnosis.remember(x.diagnosis, self.guarded.protection, orders);
    }
  };
};

}  // namespace srm
