// A control law given as a function: it stands where the laws of the core stand, behind tracker,
// loops, sampled comparators and dead-time compensation.
#pragma once

#include <functional>

#include "srm/control/frame/interface.hpp"

namespace srm {

template <int N>
struct CalledLaw {
  using Scalar = double;
  static constexpr int n_phases = N;
  struct State {};  // whatever it remembers is inside the function

  std::function<Command<double, N>(const Measurement<double, N>&, double tau_ref)> call;

  Command<double, N> step(State&, const Measurement<double, N>& y, double tau_ref) const {
    return call(y, tau_ref);
  }
};

}  // namespace srm
