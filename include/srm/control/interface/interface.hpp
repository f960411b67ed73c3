// What a control law sees and what it returns: the border between control and everything else.
#pragma once

#include <array>
#include <concepts>

#include "srm/base/angle.hpp"
#include "srm/base/fields.hpp"
#include "srm/base/leg.hpp"

namespace srm {

/// One sample, as the sensors deliver it.
template <Real T, int N>
struct Measurement {
  std::array<T, N> i{};  // phase currents [A]
  T theta_e{};           // electrical angle of phase 0, in [0, 2 pi)
  T omega_m{};           // rotor speed [rad/s]
  T u_dc{};              // dc-link voltage [V]
  T i_source{};          // current from the source into the dc link; used with a PV array [A]
  SRM_FIELDS(i, theta_e, omega_m, u_dc, i_source)
};

/// Who switches a leg between two samples.
enum class Gate : std::int8_t {
  off = 0,     // demagnetize: what an order of zeros means
  timer,       // leg[0], then leg[1] from t_edge[0], leg[2] from t_edge[1], and so on
  comparator,  // hysteresis on the thresholds of the order (comparator.hpp)
  window       // the same between theta_on and theta_off, demagnetize outside (position compare)
};

/// Changes of a leg that a timer can make in one sample: two pulses.
inline constexpr int max_edges = 4;
static_assert(max_edges == 4, "the lists of five legs and four edges below");

/// A leg state from the start of a sample and after each edge.
using Legs = std::array<Leg, max_edges + 1>;

constexpr Legs all_legs(Leg leg) { return {leg, leg, leg, leg, leg}; }

/// An edge that does not come.
template <Real T>
inline constexpr T never = T(1e30);

/// Orders for one phase, valid until the next ones. Fields that the gate does not use are ignored.
template <Real T>
struct PhaseCommand {
  Legs leg{Leg::demagnetize, Leg::demagnetize, Leg::demagnetize, Leg::demagnetize,
           Leg::demagnetize};
  Gate gate = Gate::timer;
  Leg chop = Leg::freewheel;  // comparator: leg above the band, freewheel or demagnetize
  std::array<T, max_edges> t_edge{never<T>, never<T>, never<T>,
                                  never<T>};  // from the sample's start, never falling [s]
  T i_ref{};                                  // comparator: reference [A]; 0 or less demagnetizes
  T i_band{};                                 // comparator: half width [A]
  T theta_on{}, theta_off{};                  // window: electrical angles of this phase [rad]
  // Thresholds of the comparator; the frame computes them from i_ref and i_band [A].
  T i_lower{}, i_centre{}, i_upper{}, i_runaway{};
  SRM_FIELDS(leg, gate, chop, t_edge, i_ref, i_band, theta_on, theta_off, i_lower, i_centre,
             i_upper, i_runaway)
};

template <Real T, int N>
using Command = std::array<PhaseCommand<T>, N>;

/// One leg state for a whole sample.
template <Real T>
constexpr PhaseCommand<T> hold(Leg leg) {
  return {.leg = all_legs(leg), .gate = Gate::timer};
}

/// One pulse: `inside` between two instants of the sample, `outside` before and after.
template <Real T>
constexpr PhaseCommand<T> pulse(Leg outside, Leg inside, T from, T to) {
  PhaseCommand<T> command = hold<T>(outside);
  command.leg[1] = inside;
  command.t_edge[0] = from;
  command.t_edge[1] = to;
  return command;
}

/// Current reference for the hysteresis comparator.
template <Real T>
constexpr PhaseCommand<T> regulate(T i_ref, T i_band, Leg chop = Leg::freewheel) {
  return {.gate = Gate::comparator, .chop = chop, .i_ref = i_ref, .i_band = i_band};
}

/// A control law is its parameters; what it remembers is a plain value, `State`; a default State
/// is the state after reset. `step` runs once a sample and turns a torque reference into commands.
template <class L>
concept ControlLaw = requires(const L law, typename L::State& state,
                              const Measurement<typename L::Scalar, L::n_phases>& y,
                              typename L::Scalar tau_ref) {
  requires Real<typename L::Scalar>;
  { law.step(state, y, tau_ref) } -> std::same_as<Command<typename L::Scalar, L::n_phases>>;
};

}  // namespace srm
