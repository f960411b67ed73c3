// Python's view of a struct of parameters, made from its field list (base/fields.hpp).
#pragma once

#include "bindings.hpp"

namespace bound {

/// An argument of a field's name; a function may be None.
template <class V>
auto argument(const srm::Field<V>& field) {
  if constexpr (requires(V v) { v(0.0); }) {
    return nb::arg(field.name).none();
  } else {
    return nb::arg(field.name);
  }
}

/// Python's view of a struct of parameters: a constructor with its fields by name.
template <class S>
nb::class_<S> bind_struct(nb::module_& m, const char* name, const char* doc) {
  nb::class_<S> bound(m, name, doc);
  S sample{};
  srm::fields_of(sample, [&]<class... V>(srm::Field<V>... field) {
    bound.def(
        "__init__", [](S* self, const V&... value) { new (self) S{value...}; }, nb::kw_only(),
        argument(field)...);
  });
  return bound;
}

/// The same for a struct of which a field may be left out: it keeps what a default S has.
template <class S>
nb::class_<S> bind_struct_with_defaults(nb::module_& m, const char* name, const char* doc) {
  nb::class_<S> bound(m, name, doc);
  S sample{};
  srm::fields_of(sample, [&]<class... V>(srm::Field<V>... field) {
    bound.def(
        "__init__", [](S* self, const V&... value) { new (self) S{value...}; }, nb::kw_only(),
        (argument(field) = field.value)...);
  });
  return bound;
}

}  // namespace bound
