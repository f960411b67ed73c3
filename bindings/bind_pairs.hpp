// A law that computes with the pairs of phases itself, from Python.
#pragma once

#include "bind_law.hpp"
#include "srm/machine/with_pairs.hpp"

namespace bound {

/// What Python gives for such a law.
template <template <class, int> class Law>
struct GivenCoupled {
  static constexpr bool seldom = true;  // forms.hpp

  const srm::Held<srm::Coupling<double>>& pairs;
  GivenFields<Law> law;

  /// Makes the law.
  template <class T, int N, class M>
  auto operator()(const M& machine, srm::Tables& memory) const {
    if (!couples(machine)) throw std::invalid_argument("machines of this model have no pairs");
    srm::WithPairs<M> own{machine, machine.N_r, {}};
    srm::assign(own.pairs, pairs.value, memory);
    return law.template operator()<T, N>(own, memory);
  }
};

/// Python's function that makes it: as bind_law, and the pairs.
template <template <class, int> class Law, Forms here = forms_here>
void bind_coupled(nb::module_& m, const char* name, const Place& place = Place::current()) {
  bind_made<Law, here, GivenCoupled<Law>, srm::Held<srm::Coupling<double>>>(
      m, name, "The same law, which computes with the pairs of phases.", {"pairs"}, place);
}

}  // namespace bound
