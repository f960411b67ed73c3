// The paper's controller, mended.
#include "srm/control/paper_mpc.hpp"

#include "guide.hpp"

namespace bound {

namespace {

constexpr int Np_max = 10, Nc_max = 4;

AnyController paper_mpc(const Setting& setting, const Guide& guide, int N_p, int N_c, double r_w,
                        double w_i, double R, double i_max, double i_band, double T_s, int delay) {
  return controller(setting, [&]<class T, int N>(const auto& model) {
    using M = std::decay_t<decltype(model)>;
    GuideTables<T> tables(guide);
    const srm::PaperMpc<M, N, Np_max, Nc_max> law{.machine = model,
                                                  .guide = tables.view(),
                                                  .mpc = {N_p, N_c, T(r_w), T(0), T(1)},
                                                  .w_i = T(w_i),
                                                  .R = T(R),
                                                  .i_max = T(i_max),
                                                  .i_band = T(i_band),
                                                  .T_s = T(T_s),
                                                  .delay = T(delay)};
    return std::pair(law, tables.memory());
  });
}

}  // namespace

void bind_paper_mpc(nb::module_& m) {
  m.attr("N_p_max") = Np_max;
  m.attr("N_c_max") = Nc_max;
  m.def("paper_mpc", &paper_mpc, nb::arg("setting"), nb::kw_only(), nb::arg("guide"),
        nb::arg("N_p"), nb::arg("N_c"), nb::arg("r_w"), nb::arg("w_i"), nb::arg("R"),
        nb::arg("i_max"), nb::arg("i_band"), nb::arg("T_s"), nb::arg("delay"),
        "Predictive controller of current references. guide: phase current [A].");
}

}  // namespace bound
