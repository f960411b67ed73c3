// The paper's controller, mended.
#include "srm/control/paper_mpc.hpp"

#include "bindings.hpp"

namespace bound {

namespace {

constexpr int Np_max = 10, Nc_max = 4;

AnyController paper_mpc(const Setting& setting, const Matrix& guide, double tau_max, int N_p,
                        int N_c, double r_w, double w_i, double R, double i_max, double i_band,
                        double T_s, int delay) {
  return controller(setting, [&]<class T, int N>(const auto& model) {
    using M = std::decay_t<decltype(model)>;
    const auto table = owned_table<T>(guide, tau_max);
    const srm::PaperMpc<M, N, Np_max, Nc_max> law{.machine = model,
                                                  .guide = table.view,
                                                  .mpc = {N_p, N_c, T(r_w), T(0), T(1)},
                                                  .w_i = T(w_i),
                                                  .R = T(R),
                                                  .i_max = T(i_max),
                                                  .i_band = T(i_band),
                                                  .T_s = T(T_s),
                                                  .delay = T(delay)};
    return std::pair(law, std::shared_ptr<void>(table.values));
  });
}

}  // namespace

void bind_paper_mpc(nb::module_& m) {
  m.attr("N_p_max") = Np_max;
  m.attr("N_c_max") = Nc_max;
  m.def("paper_mpc", &paper_mpc, nb::arg("setting"), nb::kw_only(), nb::arg("guide"),
        nb::arg("tau_max"), nb::arg("N_p"), nb::arg("N_c"), nb::arg("r_w"), nb::arg("w_i"),
        nb::arg("R"), nb::arg("i_max"), nb::arg("i_band"), nb::arg("T_s"), nb::arg("delay"),
        "Predictive controller of current references. guide: (n_levels, n_angles) phase current "
        "[A] for torques 0..tau_max [N m] over one electrical period.");
}

}  // namespace bound
