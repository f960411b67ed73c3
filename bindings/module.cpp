// The extension module `reluctance._core`: one function per binding file.
#include "bindings.hpp"

NB_MODULE(_core, m) {
  // Objects alive at interpreter exit (a traceback, a module-level machine) are no leaks of ours.
  nanobind::set_leak_warnings(false);
  m.doc() = "Machine, plant and control in C++. SI units and radians throughout.";
  bound::bind_enums(m);
  bound::bind_machine(m);
  bound::bind_controller(m);
  bound::bind_called_law(m);
  bound::bind_plant(m);
  bound::bind_simulation(m);
  bound::bind_step_time(m);
  bound::bind_guide(m);
  bound::bind_law_parts(m);
  bound::bind_angles(m);
  bound::bind_pwm_current(m);
  bound::bind_torque_sharing(m);
  bound::bind_ditc(m);
  bound::bind_deadbeat(m);
  bound::bind_paper_mpc(m);
  bound::bind_finite_set_mpc(m);
  bound::bind_edge_mpc(m);
  bound::bind_learning_deadbeat(m);
  bound::bind_learning_edge_mpc(m);
}
