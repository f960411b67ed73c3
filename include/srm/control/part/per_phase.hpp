// The commands of a sample, one phase after the other, by the rule that a law has for phase k.
//
// Each command is built in its place. To fill a default Command instead takes 80 to 120
// instructions more on a Cortex-M7 with three phases.
#pragma once

#include <utility>

#include "srm/control/interface/interface.hpp"

namespace srm {

/// {rule(0), rule(1), ... rule(N - 1)}, called in this order.
template <Real T, int N, class Rule>
constexpr Command<T, N> per_phase(const Rule& rule) {
  return [&]<int... k>(std::integer_sequence<int, k...>) { return Command<T, N>{rule(k)...}; }
  (std::make_integer_sequence<int, N>{});
}

}  // namespace srm
