// Each phase alone: one after the other is magnetized by timers with the whole voltage, as far as a
// current, and demagnetized. The law does not run.
//
// A round is tried when the state `run` begins, once more when the rotor has turned by half a
// stroke, and again and again in a doubt (diagnosis.hpp). A phase is magnetized until its current
// shows, in whichever channel; docs/faults.md says why no current passes twice that one. A channel
// that shows a current when it begins shows none of this trial: it may be stuck.
#pragma once

#include "srm/control/guard/winding_flux.hpp"

namespace srm {

template <Real T>
struct PhaseTrial {
  T i;           // to which each phase is magnetized [A]
  T psi;         // most flux linkage at i, at any angle [Wb]
  T psi_sample;  // which a sample of a trial adds at most [Wb]
  SRM_FIELDS(i, psi, psi_sample)

  struct State {
    int rounds = 0;   // to come, with this one
    int to_come = 0;  // phases of this round, and one more for the last current to end
    int phase = 0;    // the last one
    bool magnetizes = false;
    std::uint8_t tried = 0;  // phases so far, modulo 256
    std::uint8_t flow = 0;   // channels that showed a current when this began: it is of no trial
    T volt_seconds{};        // of the dc link since this changed [V s]
    T left = never<T>;       // which a current may take to end [V s]
    T theta_e{};             // of the last round [rad]
  };

  /// The state before the law runs for the first time. psi_max: see `WindingFlux`.
  template <int N>
  static constexpr State begun(T psi_max) {
    return {.rounds = 2, .to_come = N + 1, .phase = N - 1, .left = psi_max};
  }

  /// Whether nothing is tried, now or later.
  static constexpr bool over(const State& x) { return x.to_come == 0 && x.rounds == 0; }

  /// The orders of a sample in which the law does not run; false where it does. known: what
  /// may be wrong; flux(k): between which bounds the flux linkage of phase k is, whatever its
  /// angle.
  template <Machine M, int N, class Flux>
  constexpr bool step(State& x, const WindingFlux<T>& known, bool in_doubt, const Protection<T>& p,
                      const M& machine, const Measurement<T, N>& y, const Flux& flux,
                      std::type_identity_t<Command<T, N>>& orders) const {
    if (x.to_come == 0 && !in_doubt) {
      const T turned = wrap(y.theta_e - x.theta_e + pi<T>) - pi<T>;
      if (abs(turned) < pi<T> / T(N)) return false;
      x.to_come = N + 1;
    }
    const T u = p.flux.T_s * y.u_dc;
    x.volt_seconds = x.volt_seconds + u;
    if (x.magnetizes) {
      if (ends(x, known, p, machine, y, flux)) {
        x.magnetizes = false;
        ++x.tried;
        x.left = T(5) / T(4) * x.volt_seconds + static_cast<T>(2 + p.delay) * u;
        x.volt_seconds = T(0);
        if (x.to_come > 1) --x.to_come;
      }
    } else if (const int k = at_rest(x, known, p, y, flux); k >= 0) {
      if (x.to_come == 1 && !in_doubt) {
        x = {.rounds = x.rounds - 1, .phase = k, .left = known.psi_max, .theta_e = y.theta_e};
        return false;
      }
      x.phase = k;
      x.magnetizes = true;
      x.volt_seconds = T(0);
      x.flow = 0;
      for (int j = 0; j < N; ++j) {
        if (y.i[j] > p.i_zero) x.flow = static_cast<std::uint8_t>(x.flow | 1U << j);
      }
    }
    orders = {};
    if (x.magnetizes) {
      orders[x.phase] = hold<T>(Leg::freewheel);
      orders[x.phase].leg[0] = Leg::magnetize;
      const T t = known.drops.t_dead + psi_sample / y.u_dc;
      if (t < p.flux.T_s) orders[x.phase].t_edge[0] = t;
    }
    return true;
  }

 private:
  /// The next phase without flux linkage, when no other one has any or it lasts for too long; less
  /// than 0 before.
  template <int N, class Flux>
  static constexpr int at_rest(const State& x, const WindingFlux<T>& known, const Protection<T>& p,
                               const Measurement<T, N>& y, const Flux& flux) {
    const bool waits = x.volt_seconds < x.left;
    int found = -1;
    for (int n = N; n > 0; --n) {
      const int k = (x.phase + n) % N;
      if (y.i[k] <= p.i_zero && !(flux(k).most > known.psi_error)) {
        found = k;
      } else if (waits) {
        return -1;
      }
    }
    return found;
  }

  /// Whether a current has reached i, in whichever channel it shows. Where it shows in none, either
  /// the phase is broken and the angle right, and it has twice this current at most; or the channel
  /// is right, and tells that it has none.
  template <Machine M, int N, class Flux>
  constexpr bool ends(const State& x, const WindingFlux<T>& known, const Protection<T>& p,
                      const M& machine, const Measurement<T, N>& y, const Flux& flux) const {
    bool shows = false;
    for (int k = 0; k < N; ++k) {
      if ((x.flow >> k & 1) != 0) continue;
      if (y.i[k] >= i) return true;
      shows = shows || y.i[k] > p.i_zero;
    }
    if (x.volt_seconds > T(2) * known.psi_max) return true;
    const T least = flux(x.phase).least;
    if (shows) return least > psi;
    if (least > known.psi_zero) return true;
    const T at_twice = machine.at(T(2) * i, phase_angle_in_turn<N>(y.theta_e, x.phase)).psi;
    return least > (T(1) - known.map_error) * at_twice;
  }
};

}  // namespace srm
