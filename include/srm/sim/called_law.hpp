// A control law behind one call, with its state. On the desk every law is one of these, so that
// the frame around it is compiled once for each precision and number of phases, and not for each
// law. A law in Python is one too.
#pragma once

#include <functional>
#include <memory>

#include "srm/control/frame/learned.hpp"
#include "srm/control/interface/interface.hpp"
#include "srm/machine/with_pairs.hpp"

namespace srm {

template <Real T, int N>
struct CalledLaw {
  using Scalar = T;
  static constexpr int n_phases = N;
  using Call = std::function<Command<T, N>(const Measurement<T, N>&, T tau_ref, Learned<T>&)>;
  struct State {
    Call running;  // a copy of the law's call: what else it remembers is inside
    Learned<T> learned;
  };

  Call call;
  Coupling<T> known_pairs{};  // of phases, which the law computes with; by default none

  Command<T, N> step(State& x, const Measurement<T, N>& y, T tau_ref) const {
    if (!x.running) x.running = call;
    return x.running(y, tau_ref, x.learned);
  }

  static constexpr const Learned<T>& learned(const State& x) { return x.learned; }
};

/// Closes a law over its state.
template <ControlLaw Law>
CalledLaw<typename Law::Scalar, Law::n_phases> called(std::shared_ptr<const Law> law) {
  using T = typename Law::Scalar;
  const Coupling<T>* pairs = pairs_of(*law);
  return {[law, state = typename Law::State{}](const Measurement<T, Law::n_phases>& y, T tau_ref,
                                               Learned<T>& learned) mutable {
            if constexpr (requires { Law::learned(state); }) {
              const auto orders = law->step(state, y, tau_ref);
              learned = Law::learned(state);
              return orders;
            } else {
              return law->step(state, y, tau_ref);
            }
          },
          pairs == nullptr ? Coupling<T>{} : *pairs};
}

}  // namespace srm
