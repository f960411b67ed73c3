// A law that learns the machine it drives, from Python.
#pragma once

#include "bind_law.hpp"
#include "srm/control/frame/learning.hpp"

namespace bound {

/// What Python gives for a law that learns.
template <template <class, int> class Law>
struct GivenLearning {
  static constexpr bool seldom = true;  // forms.hpp

  const srm::StrokeFit<double>& fit;
  const AnyCoupling& pairs;
  double w_sw_torque, w_sw_voltage;
  GivenFields<Law> law;

  /// Makes the law.
  template <class T, int N, class M>
  auto operator()(const M& machine, srm::Tables& memory) const {
    const srm::WithInductance<M> own{machine, machine.N_r, T(0)};
    srm::Learning<Law<srm::WithInductance<M>, N>> learning{
        .law = law.template operator()<T, N>(own, memory),
        .fit = {},
        .pairs = {},
        .w_sw_torque = static_cast<T>(w_sw_torque),
        .w_sw_voltage = static_cast<T>(w_sw_voltage)};
    srm::assign(learning.fit, fit);
    if (pairs) srm::assign(learning.pairs, pairs->value, memory);
    return learning;
  }
};

/// Python's function that makes a law that learns: as bind_law, and what Learning adds to the law.
template <template <class, int> class Law, Forms here = forms_here>
void bind_learning(nb::module_& m, const char* name, const Place& place = Place::current()) {
  bind_made<Law, here, GivenLearning<Law>, srm::StrokeFit<double>, AnyCoupling, double, double>(
      m, name, "The same law, which learns the machine that it drives.",
      {"fit", "pairs", "w_sw_torque", "w_sw_voltage"}, place);
}

}  // namespace bound
