// Functions of other forms (forms.hpp) by their names. A file that binds some is compiled into
// `_core`, or as a module of its own when one of them is first asked for
// (python/reluctance/base/other_forms.py).
#pragma once

#include <nanobind/nanobind.h>

#include <map>
#include <source_location>
#include <string>

namespace bound {

namespace nb = nanobind;

/// The file that binds a function.
using Place = std::source_location;

using OtherForms = std::map<std::string, void (*)()>;
/// One for all modules: that of `_core`.
inline OtherForms* other_forms = nullptr;

/// A module begins with it.
inline void share_other_forms(nb::module_& m, bool is_core) {
  static OtherForms own;
  if (is_core) m.attr("_other_forms") = nb::capsule(&own);
  const nb::object shared = is_core ? nb::object(m) : nb::module_::import_("reluctance._core");
  other_forms = static_cast<OtherForms*>(nb::cast<nb::capsule>(shared.attr("_other_forms")).data());
}

template <class Function>
void add_other_form(const std::string& name, Function* function) {
  (*other_forms)[name] = reinterpret_cast<void (*)()>(function);
}

/// The function of this name, which the file adds.
template <class Function>
Function* other_form(const std::string& name, const char* file) {
  if (!other_forms->contains(name)) {
    const nb::gil_scoped_acquire locked;
    nb::module_::import_("reluctance.base.other_forms").attr("load")(file);
  }
  return reinterpret_cast<Function*>(other_forms->at(name));
}

}  // namespace bound
