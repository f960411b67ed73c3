// A guarded control that says what broke: the diagnosis in the place of the check of the currents.
#pragma once

#include "srm/control/frame/flux_angle.hpp"
#include "srm/control/guard/diagnosis.hpp"

namespace srm {

/// In the place of a FluxAngle that is left out of a target's code.
struct NoFluxAngle {
  template <int N>
  struct State {};
};

/// A guarded control that says what broke. Angle: what follows the rotor by the flux linkages.
template <class Guarded, class Angle = FluxAngle<typename Guarded::Scalar>>
struct Diagnosed {
  using Scalar = typename Guarded::Scalar;
  using T = Scalar;
  using Tuning = typename Guarded::Tuning;
  static constexpr int N = Guarded::N;
  static constexpr int n_phases = N;
  static constexpr bool follows = !std::same_as<Angle, NoFluxAngle>;

  Guarded guarded;
  Diagnosis<T> diagnosis;
  Angle flux_angle;
  SRM_FIELDS(guarded, diagnosis, flux_angle)

  struct State {
    typename Guarded::State guarded;
    typename Diagnosis<T>::template State<N> diagnosis;
    [[no_unique_address]] typename Angle::template State<N> flux_angle;
  };

  constexpr Tuning tuning() const { return guarded.tuning(); }
  constexpr bool motors() const { return guarded.motors(); }
  template <Uses used = Uses{}>
  T speed(const State& x, const Measurement<T, N>& y) const {
    return guarded.template speed<used>(x.guarded, y);
  }

  template <Uses used = Uses{}>
  [[gnu::always_inline]] Status step(State& x, const Measurement<T, N>& y, T reference,
                                     Command<T, N>& orders, const Tuning& at) const {
    return guarded.template step<used>(x.guarded, y, reference, orders, at, Asked{*this, x});
  }

  void start(State& x) const {
    guarded.start(x.guarded);
    renew(x.diagnosis);
    x.diagnosis.trial = PhaseTrial<T>::template begun<N>(diagnosis.flux.psi_max);
    renew(x.flux_angle);
  }
  void forget(State& x) const {
    guarded.forget(x.guarded);
    renew(x.diagnosis);
    renew(x.flux_angle);
  }
  void lose(State& x) const {
    forget(x);
    guarded.lose(x.guarded);
  }
  template <Uses used = Uses{}>
  void watch(State& x, const Measurement<T, N>& y, const Tuning& at) const {
    guarded.template watch<used>(x.guarded, y, at);
  }
  const Fault<T>& fault(const State& x) const { return guarded.fault(x.guarded); }
  bool latched(const State& x) const { return guarded.latched(x.guarded); }
  const auto& law(const State& x) const { return guarded.law(x.guarded); }

  /// Where the rotor is by the flux linkages; all zero where nothing follows it.
  FluxEstimate<T> estimate(const State& x) const requires follows {
    return flux_angle.on() ? flux_angle.estimate(x.flux_angle, guarded.machine.N_r)
                           : FluxEstimate<T>{};
  }

 private:
  struct Asked {
    static constexpr bool on = true;
    const Diagnosed& self;
    State& x;

    bool finds(const Measurement<T, N>& y) const {
      const bool found = self.diagnosis.finds(x.diagnosis, x.guarded.guard, self.guarded.protection,
                                              self.guarded.machine, y);
      if constexpr (follows) return leaves(y) || found;
      return found;
    }
    /// True where the angle shown has left the one by the flux linkages, which the guard is told.
    /// In doubt of a phase only the others say where the rotor is.
    bool leaves(const Measurement<T, N>& y) const {
      const FluxAngle<T>& angle = self.flux_angle;
      if (!angle.on()) return false;
      angle.step(x.flux_angle, self.guarded.machine, self.guarded.control.pairs(), y,
                 [this](int k) { return self.diagnosis.by_voltage(x.diagnosis, k); });
      auto& guard = x.guarded.guard;
      if (guard.latched || !angle.off(x.flux_angle)) return false;
      guard.latched = true;
      guard.fault = {Status::angle_off};
      return true;
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
