// Python's view of a struct of parameters, made from its field list (base/fields.hpp).
#pragma once

#include "bindings.hpp"

namespace bound {

/// An argument of a field's name; a function may be None, and what may be missing is by default.
/// With defaults it may be left out, and is what a default struct has.
template <bool defaults, class V>
auto argument(const srm::Field<V>& field) {
  if constexpr (defaults) {
    return argument<false>(field) = field.value;
  } else if constexpr (requires(V v) { v.has_value(); }) {
    return nb::arg(field.name) = nb::none();
  } else if constexpr (requires(V v) { v(0.0); }) {
    return nb::arg(field.name).none();
  } else {
    return nb::arg(field.name);
  }
}

/// Python's view of a struct of parameters: a constructor with its fields by name.
template <class S, bool defaults = false>
nb::class_<S> bind_struct(nb::module_& m, const char* name, const char* doc) {
  nb::class_<S> bound(m, name, doc);
  S sample{};
  srm::fields_of(sample, [&]<class... V>(srm::Field<V>... field) {
    bound.def(
        "__init__", [](S* self, const V&... value) { new (self) S{value...}; }, nb::kw_only(),
        argument<defaults>(field)...);
  });
  return bound;
}

}  // namespace bound
