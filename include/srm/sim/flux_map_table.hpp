// A flux map from its tables, checked, with the memory that it views.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "srm/machine/flux_map.hpp"
#include "srm/sim/tables.hpp"

namespace srm {

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
inline Held<FluxMap<double>> flux_map(int N_r, const std::vector<double>& knot,
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
  Tables memory;
  const FluxMap<double> map{
      .N_r = N_r,
      .n_i = n_i,
      .n_theta = n_theta,
      .n_slot = n_slot,
      .theta_span = theta_span,
      .cells_per_rad = n_theta / theta_span,
      .slots_per_A = slots_per_A,
      .knot = memory.keep<double>(knot),
      .piece = memory.keep<std::uint8_t>(piece_table(knot, slots_per_A, n_slot)),
      .coefficient = memory.keep<double>(coefficient)};
  if (!(inductance_bound(map) > 0)) {
    throw std::invalid_argument("the incremental inductance is not positive everywhere");
  }
  return {map, memory.owner()};
}

}  // namespace srm
