// A law from outside the tree as a module of its own: what `reluctance law build` compiles.
#pragma once

#include "bind_law.hpp"

namespace bound {

/// The law, the names of its fields without the machine, and the version of the core's headers.
template <template <class, int> class Law>
void own_law(nb::module_& m, const char* name, const char* core) {
  if constexpr (has_machine<Law> == 1) {
    using First = std::tuple_element_t<0, decltype(field_list(std::declval<Sample<Law>&>()))>;
    static_assert(std::is_same_v<decltype(First::value), decltype(Sample<Law>::machine)&>,
                  "machine has to be the first field of a law, in its struct and in SRM_FIELDS");
  }
  static_assert(srm::ControlLaw<Sample<Law>>,
                "a law needs State and Command<T, N> step(State&, const Measurement<T, N>&, T "
                "tau_ref) const");
  nb::module_::import_("reluctance._core");  // its types are those of the arguments
  bind_law<Law>(m, name, "A control law from outside the package.");
  nb::list names;
  Sample<Law> sample{};
  srm::fields_of(sample, [&](auto... field) {
    int n = 0;
    ((n++ < int(has_machine<Law>) ? void() : names.append(field.name)), ...);
  });
  m.attr("NAME") = name;
  m.attr("FIELDS") = names;
  m.attr("CORE") = core;
}

}  // namespace bound
