// The extension module `reluctance._core`: one function per binding file.
#include "bindings.hpp"

NB_MODULE(_core, m) {
  m.doc() = "Machine, plant and control in C++. SI units and radians throughout.";
  bound::bind_machine(m);
  bound::bind_simulation(m);
  bound::bind_box_qp(m);
  bound::bind_incremental_mpc(m);
  bound::bind_paper_mpc(m);
}
