// A flux map together with its memory: the machine that the desk copies, stores and simulates.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "srm/machine/flux_map.hpp"

namespace bound {

/// A Machine like the map it views. Copies share the tables, which never change.
template <srm::Real T>
struct FluxMapTable {
  using Scalar = T;
  struct Tables {
    std::vector<T> knot, coefficient;
    std::vector<std::uint8_t> piece;
  };

  int N_r;
  srm::FluxMap<T> map;
  std::shared_ptr<const Tables> tables;

  srm::Magnetics<T> at(T i, T theta_e) const { return map.at(i, theta_e); }
};

/// For each slot of equal width, the piece at its start. A slot is no wider than the narrowest
/// piece.
inline std::vector<std::uint8_t> piece_table(const std::vector<double>& knot, double slots_per_A,
                                             int n_slot) {
  std::vector<std::uint8_t> piece(n_slot);
  int j = 0;
  for (int slot = 0; slot < n_slot; ++slot) {
    // The tolerance gives a knot that rounding moved past the edge of its slot to that slot.
    while (j + 1 < int(knot.size()) && knot[j + 1] * slots_per_A <= slot + 1e-9) ++j;
    piece[slot] = std::uint8_t(j);
  }
  return piece;
}

/// The map from its knots (n_i) [A] and coefficients (n_i, n_theta + 3, 5).
///
/// Throws std::invalid_argument where it would not be a machine: knots that do not start at 0 and
/// rise, flux or co-energy at zero current, or an incremental inductance that is not proved
/// positive.
template <srm::Real T>
FluxMapTable<T> flux_map_table(int N_r, const std::vector<double>& knot,
                               const std::vector<double>& coefficient, double theta_span) {
  const int n_i = int(knot.size());
  if (N_r < 1) throw std::invalid_argument("N_r = " + std::to_string(N_r) + ", need >= 1");
  if (n_i < 2 || n_i > 255 || knot[0] != 0) {
    throw std::invalid_argument("need 2 to 255 knots, the first at 0 A");
  }
  if (coefficient.size() % (5 * n_i) != 0 || coefficient.size() / (5 * n_i) < 5) {
    throw std::invalid_argument("coefficients need the shape (n_i, n_theta + 3, 5), n_theta >= 2");
  }
  double narrowest = knot[1];
  for (int j = 1; j < n_i; ++j) narrowest = std::min(narrowest, knot[j] - knot[j - 1]);
  // 65536 slots are the most that a target would store.
  if (!(narrowest * 65536 > knot.back())) {
    throw std::invalid_argument("knots need to rise, in steps above i_last/65536");
  }
  for (const double c : coefficient) {
    if (!std::isfinite(c)) throw std::invalid_argument("coefficients need to be finite");
  }
  const int n_theta = int(coefficient.size()) / (5 * n_i) - 3;
  for (int m = 0; m < n_theta + 3; ++m) {
    if (coefficient[5 * m] != 0 || coefficient[5 * m + 1] != 0) {
      throw std::invalid_argument("flux and co-energy need to vanish at zero current");
    }
  }
  const int n_slot = int(std::ceil(knot.back() / narrowest * (1 - 1e-9))) + 1;
  const double slots_per_A = (n_slot - 1) / knot.back();
  auto tables = std::make_shared<typename FluxMapTable<T>::Tables>();
  tables->knot.assign(knot.begin(), knot.end());
  tables->coefficient.assign(coefficient.begin(), coefficient.end());
  tables->piece = piece_table(knot, slots_per_A, n_slot);
  const srm::FluxMap<T> map{.N_r = N_r,
                            .n_i = n_i,
                            .n_theta = n_theta,
                            .n_slot = n_slot,
                            .theta_span = T(theta_span),
                            .cells_per_rad = T(n_theta / theta_span),
                            .slots_per_A = T(slots_per_A),
                            .knot = tables->knot.data(),
                            .piece = tables->piece.data(),
                            .coefficient = tables->coefficient.data()};
  if (!(srm::inductance_bound(map) > T(0))) {
    throw std::invalid_argument("the incremental inductance is not positive everywhere");
  }
  return {N_r, map, tables};
}

/// The same machine in the precision of a control law.
template <srm::Real T>
FluxMapTable<T> in_precision(const FluxMapTable<double>& m) {
  return flux_map_table<T>(m.N_r, m.tables->knot, m.tables->coefficient, m.map.theta_span);
}

}  // namespace bound
