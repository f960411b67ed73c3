#include "bind_law.hpp"
#include "srm/control/law/paper_mpc.hpp"

namespace bound {

constexpr int Np_max = 10, Nc_max = 4;

template <class M, int N>
using PaperMpc = srm::PaperMpc<M, N, Np_max, Nc_max>;

void bind_paper_mpc(nb::module_& m) {
  m.attr("N_p_max") = Np_max;
  m.attr("N_c_max") = Nc_max;
  bind_law<PaperMpc>(m, "paper_mpc",
                     "Predictive controller of current references. guide: phase current [A].");
}

}  // namespace bound
