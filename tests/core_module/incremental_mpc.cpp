// The bare incremental law for one channel, so that tests can hold it against the textbook.
#include "srm/control/part/incremental_mpc.hpp"

#include <nanobind/stl/vector.h>

#include "arrays.hpp"

namespace bound {

namespace {

using Mpc = srm::IncrementalMpc<double, 1, 10, 10>;

/// Returns H (n, n) row by row, f (n,), and the free displacement (N_p,).
std::vector<std::vector<double>> incremental_mpc(int N_p, int N_c, double r_w, double a, double b,
                                                 const std::vector<double>& c,
                                                 const std::vector<double>& error_free) {
  if (N_p < 1 || N_p > 10 || N_c < 1 || N_c > N_p || int(c.size()) != N_p ||
      int(error_free.size()) != N_p) {
    throw std::invalid_argument("need 1 <= N_c <= N_p <= 10 and N_p gains and errors");
  }
  const Mpc mpc{N_p, N_c, r_w, a, b};
  Mpc::Gains gains{};
  Mpc::Outputs error{};
  for (int j = 0; j < N_p; ++j) {
    gains[j][0] = c[j];
    error[j] = error_free[j];
  }
  const auto qp = mpc.problem(gains, error);
  std::vector<std::vector<double>> result;
  for (int v = 0; v < qp.n; ++v) {
    result.emplace_back(qp.H[v].begin(), qp.H[v].begin() + qp.n);
  }
  result.emplace_back(qp.f.begin(), qp.f.begin() + qp.n);
  const auto displacement = mpc.free_displacement();
  result.emplace_back(displacement.begin(), displacement.begin() + N_p);
  return result;
}

}  // namespace

void bind_incremental_mpc(nb::module_& m) {
  m.def("incremental_mpc", &incremental_mpc, nb::kw_only(), nb::arg("N_p"), nb::arg("N_c"),
        nb::arg("r_w"), nb::arg("a"), nb::arg("b"), nb::arg("c"), nb::arg("error_free"),
        "Rows of H, then f, then the free displacement of the one-channel problem.");
}

}  // namespace bound
