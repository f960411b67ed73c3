// The extension module `reluctance._core`: one function per binding file.
#include "bindings.hpp"
#include "other_forms.hpp"
#include "srm/control/laws.hpp"

namespace bound {

template <template <class, int> class... Law>
void bind_all(nb::module_& m) {
  (bind_built_in<Law, Forms::usual>(m), ...);
#ifdef RELUCTANCE_OTHER_FORMS
  (bind_built_in<Law, Forms::other>(m), ...);
  bind_controllers<Forms::other>(m);
  bind_other_loops(m);
#endif
}

}  // namespace bound

NB_MODULE(_core, m) {
  // Objects alive at interpreter exit (a traceback, a module-level machine) are no leaks of ours.
  nanobind::set_leak_warnings(false);
  m.doc() = "Machine, plant and control in C++. SI units and radians throughout.";
  bound::share_other_forms(m, true);
  bound::bind_enums(m);
  bound::bind_machine(m);
  bound::bind_coupling(m);
  bound::bind_frame(m);
  bound::bind_controller(m);
  bound::bind_called_law(m);
  bound::bind_plant(m);
  bound::bind_exported(m);
  bound::bind_simulation(m);
  bound::bind_step_time(m);
  bound::bind_guard(m);
  bound::bind_supervised(m);
  bound::bind_reference_profile(m);
  bound::bind_law_parts(m);
  using namespace srm::laws;
  bound::bind_all<SRM_BUILT_IN_LAWS>(m);
}
