#include "bind_pairs.hpp"
#include "srm/control/laws.hpp"

namespace bound {

template <>
void bind_built_in<srm::laws::PaperMpc>(nb::module_& m) {
  m.attr("N_p_max") = srm::laws::Np_max;
  m.attr("N_c_max") = srm::laws::Nc_max;
  bind_law<srm::laws::PaperMpc>(
      m, "paper_mpc", "Predictive controller of current references. guide: phase current [A].");
  bind_coupled<srm::laws::PaperMpc>(m, "coupled_paper_mpc");
}

}  // namespace bound
