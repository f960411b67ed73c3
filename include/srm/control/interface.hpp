// What a control law sees and what it returns: the border between control and everything else.
#pragma once

#include <array>
#include <concepts>

#include "srm/base/angle.hpp"
#include "srm/base/leg.hpp"

namespace srm {

/// One sample, as the sensors deliver it.
template <Real T, int N>
struct Measurement {
  std::array<T, N> i{};  // phase currents [A]
  T theta_e{};           // electrical angle of phase 0, in [0, 2 pi)
  T omega_m{};           // rotor speed [rad/s]
  T u_dc{};              // dc-link voltage [V]
};

/// Who switches a leg between two samples.
enum class Gate : std::int8_t {
  timer,       // leg[0], then leg[1] from t_edge[0], then leg[2] from t_edge[1]
  comparator,  // hysteresis: the current is held at i_ref +- i_band
  window       // the same between theta_on and theta_off, demagnetize outside (position compare)
};

/// Orders for one phase, valid until the next ones. Fields that the gate does not use are ignored.
template <Real T>
struct PhaseCommand {
  Gate gate = Gate::timer;
  std::array<Leg, 3> leg{Leg::demagnetize, Leg::demagnetize, Leg::demagnetize};
  std::array<T, 2> t_edge{};  // from the start of the sample, rising [s]; past its end: no edge
  T i_ref{};                  // comparator: reference [A]; 0 or less demagnetizes
  T i_band{};                 // comparator: half width [A]
  Leg chop = Leg::freewheel;  // comparator: leg above the band (freewheel soft, demagnetize hard)
  T theta_on{}, theta_off{};  // window: electrical angles of this phase [rad]
};

template <Real T, int N>
using Command = std::array<PhaseCommand<T>, N>;

/// One leg state for a whole sample.
template <Real T>
constexpr PhaseCommand<T> hold(Leg leg) {
  return {.gate = Gate::timer, .leg = {leg, leg, leg}};
}

/// Current reference for the hysteresis comparator.
template <Real T>
constexpr PhaseCommand<T> regulate(T i_ref, T i_band, Leg chop = Leg::freewheel) {
  return {.gate = Gate::comparator, .i_ref = i_ref, .i_band = i_band, .chop = chop};
}

/// A control law is its parameters; what it remembers is a plain value, `State`; a default State
/// is the state after reset. `step` runs once a sample and turns a torque reference into commands.
template <class L>
concept ControlLaw =
    requires(const L law, typename L::State& state,
             const Measurement<typename L::Scalar, L::n_phases>& y, typename L::Scalar tau_ref) {
      requires Real<typename L::Scalar>;
      { law.step(state, y, tau_ref) } -> std::same_as<Command<typename L::Scalar, L::n_phases>>;
    };

}  // namespace srm
