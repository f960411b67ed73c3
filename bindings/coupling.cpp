// Phases that share iron: the tables of their pairs, and what they add over arrays.
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <tuple>

#include "bindings.hpp"

namespace bound {

namespace {

using Pairs = srm::Held<srm::Coupling<double>>;
using Values = nb::ndarray<nb::numpy, double>;

Pairs coupling(int N_r, double factor, const std::vector<std::tuple<int, int, int>>& pairs,
               const std::vector<double>& behind, const Array<1>& knots, const Array<4>& functions,
               const Array<4>& tables) {
  std::vector<int> first, second, kind;
  for (const auto& [a, b, table] : pairs) {
    if (std::min({a, b, table}) < 0) throw std::invalid_argument("need phases and tables from 0");
    first.push_back(a);
    second.push_back(b);
    kind.push_back(table);
  }
  const int n_phi = int(tables.shape(1)) - 3;
  srm::Tables memory;
  const auto kept = [&](const auto& array) {
    return memory.keep<double>(std::vector<double>(array.data(), array.data() + array.size()));
  };
  const srm::Coupling<double> made{.N_r = N_r,
                                   .n_i = int(knots.shape(0)),
                                   .n_phi = n_phi,
                                   .rank = int(tables.shape(2)),
                                   .factor = factor,
                                   .cells_per_rad = n_phi / srm::pi<double>,
                                   .first = memory.keep<std::uint8_t>(first),
                                   .second = memory.keep<std::uint8_t>(second),
                                   .kind = memory.keep<std::uint8_t>(kind),
                                   .behind = memory.keep<double>(behind),
                                   .knot = kept(knots),
                                   .f = kept(functions),
                                   .C = kept(tables)};
  if (const char* wrong = made.fault(6)) throw std::invalid_argument(wrong);
  return {made, memory.owner()};
}

void check_pair(const Pairs& self, int pair) {
  if (pair < 0 || pair >= self.value.n_pairs()) throw std::invalid_argument("no such pair");
}

Values at(const Pairs& self, int pair, const Array<1>& a, const Array<1>& b,
          const Array<1>& theta_e) {
  check_pair(self, pair);
  const std::size_t n = a.shape(0);
  if (b.shape(0) != n || theta_e.shape(0) != n) {
    throw std::invalid_argument("a, b and theta_e differ in length");
  }
  std::vector<double> rows;
  for (std::size_t j = 0; j < n; ++j) {
    const srm::PairMagnetics<double> m =
        self.value.at(pair, a.data()[j], b.data()[j], srm::wrap(theta_e.data()[j]));
    rows.insert(rows.end(), {m.W_c, m.tau, m.psi_first, m.psi_second, m.L_first, m.L_second,
                             m.L_mutual, m.psi_theta_first, m.psi_theta_second});
  }
  return numpy(std::move(rows), {n, 9});
}

Values torque(const Pairs& self, const Array<2>& i, const Array<1>& theta_e) {
  const std::size_t n = i.shape(0);
  if (theta_e.shape(0) != n) throw std::invalid_argument("i and theta_e differ in length");
  if (const char* wrong = self.value.fault(int(i.shape(1)))) throw std::invalid_argument(wrong);
  std::vector<double> tau(n);
  for (std::size_t j = 0; j < n; ++j) {
    tau[j] = self.value.torque(i.data() + j * i.shape(1), srm::wrap(theta_e.data()[j]));
  }
  return numpy(std::move(tau), {n});
}

}  // namespace

void bind_coupling(nb::module_& m) {
  nb::class_<Pairs>(m, "Coupling", "Phases that share iron: what two currents at once add.")
      .def(nb::new_(&coupling), nb::kw_only(), nb::arg("N_r"), nb::arg("factor"), nb::arg("pairs"),
           nb::arg("behind"), nb::arg("knots"), nb::arg("functions"), nb::arg("tables"),
           "pairs: both phases and the table of each; behind: electrical angle of phase 0 less "
           "that of the pair, in [0, 2 pi) [rad]; knots: (n_i) [A]; functions: (n_tables, n_i, "
           "rank, 4) powers of the current above its knot; tables: (n_tables, n_phi + 3, rank, "
           "rank) of half a period [J].")
      .def("at", &at, nb::arg("pair"), nb::arg("a"), nb::arg("b"), nb::arg("theta_e"),
           "Columns W_c [J], tau [N m], psi of the first and of the second phase [Wb], their "
           "incremental inductances and the mutual one [H], dpsi/dtheta of both [Wb/rad], shape "
           "(n, 9), at n currents of both [A] and electrical angles of phase 0 [rad].")
      .def("torque", &torque, nb::arg("i"), nb::arg("theta_e"),
           "Torque of all pairs (n) [N m] at currents (n, n_phases) [A] and electrical angles of "
           "phase 0 (n) [rad].");
}

}  // namespace bound
