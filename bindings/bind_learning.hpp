// A law that learns the machine it drives, from Python.
#pragma once

#include "bind_law.hpp"
#include "srm/control/frame/learning.hpp"

namespace bound {

/// What Python gives for a law that learns.
template <template <class, int> class Law>
struct GivenLearning {
  const srm::StrokeFit<double>& fit;
  double w_sw_torque, w_sw_voltage;
  GivenFields<Law> law;

  /// Makes the law.
  template <class T, int N, class M>
  auto operator()(const M& machine, srm::Tables& memory) const {
    const srm::WithInductance<M> own{machine, machine.N_r, T(0)};
    srm::Learning<Law<srm::WithInductance<M>, N>> learning{
        .law = law.template operator()<T, N>(own, memory),
        .fit = {},
        .w_sw_torque = static_cast<T>(w_sw_torque),
        .w_sw_voltage = static_cast<T>(w_sw_voltage)};
    srm::assign(learning.fit, fit);
    return learning;
  }
};

/// Python's function that makes a law that learns: as bind_law, and what Learning adds to the law.
template <template <class, int> class Law, Forms here = forms_here>
void bind_learning(nb::module_& m, const char* name) {
  using Make = GivenLearning<Law>;
  if constexpr (here == Forms::other) {
    other_form<Make> = &any_law<here, Make>;
  } else {
    Sample<Law> sample{};
    const auto list = field_list(sample);
    [&]<std::size_t... n>(std::index_sequence<n...>) {
      m.def(
          name,
          [](const AnyMachine& model, int n_phases, bool single, const srm::StrokeFit<double>& fit,
             double w_sw_torque, double w_sw_voltage, const GivenField<Law, n>&... value) {
            return any_law<here>(model, n_phases, single,
                                 Make{fit, w_sw_torque, w_sw_voltage, {{value...}}});
          },
          nb::arg("machine"), nb::arg("n_phases"), nb::arg("single"), nb::kw_only(), nb::arg("fit"),
          nb::arg("w_sw_torque"), nb::arg("w_sw_voltage"),
          nb::arg(std::get<n + has_machine<Law>>(list).name)...,
          "The same law, which learns the machine that it drives.");
    }
    (std::make_index_sequence<given_fields<Law>>());
  }
}

}  // namespace bound
