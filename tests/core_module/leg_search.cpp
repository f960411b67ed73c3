// The search of the finite-control-set law by itself.
#include "srm/control/part/leg_search.hpp"

#include "arrays.hpp"

namespace bound {

namespace {

/// Three phases, each a row of psi, i, tau, gain, drift, goal, goal_rate, i_gain, i_drift, last
/// leg, idle.
nb::tuple leg_search(const Array<2>& phases, double tau_ref, double u_dc, double R, double i_max,
                     double T_s, double t_end, double w_psi, double w_i, double w_sw, int horizon,
                     bool prune) {
  if (phases.shape(0) != 3 || phases.shape(1) != 11) {
    throw std::invalid_argument("phases has another shape than (3, 11)");
  }
  srm::LegSearch<double, 3> s;
  std::array<int, 3> last;
  for (int k = 0; k < 3; ++k) {
    const double* x = phases.data() + 11 * k;
    s.phases[k] = {x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[10] != 0, 0};
    last[k] = int(x[9]);
  }
  s.tau_ref = tau_ref;
  s.u_dc = u_dc;
  s.R = R;
  s.i_max = i_max;
  s.T_s = T_s;
  s.t_end = t_end;
  s.w_psi = w_psi;
  s.w_i = w_i;
  s.w_sw = w_sw;
  s.horizon = horizon;
  const auto found = prune ? s.best(last) : s.best<srm::Pruning::off>(last);
  return nb::make_tuple(found.level[0], found.level[1], found.level[2], found.cost, found.nodes);
}

}  // namespace

void bind_leg_search(nb::module_& m) {
  m.def(
      "leg_search", &leg_search, nb::arg("phases"), nb::kw_only(), nb::arg("tau_ref"),
      nb::arg("u_dc"), nb::arg("R"), nb::arg("i_max"), nb::arg("T_s"), nb::arg("t_end"),
      nb::arg("w_psi"), nb::arg("w_i"), nb::arg("w_sw"), nb::arg("horizon"), nb::arg("prune"),
      "Best first legs of three phases, the cost of their sequence, and the nodes "
      "searched. phases: (3, 11) psi, i, tau, gain, drift, goal, goal_rate, i_gain, i_drift, last "
      "leg, idle.");
}

}  // namespace bound
