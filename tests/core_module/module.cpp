// The extension module `reluctance._core_parts`: parts of the core that only tests reach directly.
#include <nanobind/nanobind.h>

namespace bound {
namespace nb = nanobind;
void bind_angle_tracker(nb::module_& m);
void bind_box_qp(nb::module_& m);
void bind_c_controller(nb::module_& m);
void bind_incremental_mpc(nb::module_& m);
void bind_leg_search(nb::module_& m);
void bind_single(nb::module_& m);
}  // namespace bound

NB_MODULE(_core_parts, m) {
  nanobind::set_leak_warnings(false);
  bound::bind_angle_tracker(m);
  bound::bind_box_qp(m);
  bound::bind_c_controller(m);
  bound::bind_incremental_mpc(m);
  bound::bind_leg_search(m);
  bound::bind_single(m);
}
