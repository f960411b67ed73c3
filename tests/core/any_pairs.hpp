// Two pairs of three phases, with any coefficients: for what must hold of every table.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "srm/machine/coupling.hpp"

namespace srm {

struct AnyPairs {
  std::vector<std::uint8_t> first{0, 2}, second{1, 0}, kind{0, 1};
  std::vector<double> behind{1.1, 5.3}, knot{0.0, 3.7, 9.0}, f, C;
  Coupling<double> pairs{};

  AnyPairs() {
    for (int n = 0; n < 2 * 3 * 3 * 4; ++n) f.push_back(std::sin(1.0 + n * n));
    for (int n = 0; n < 2 * 8 * 9; ++n) C.push_back(std::sin(2.0 + n * n));
    const auto view = []<class T>(const std::vector<T>& of) {
      return View<T>{of.data(), static_cast<int>(of.size())};
    };
    pairs.N_r = 6;
    pairs.n_i = 3;
    pairs.n_phi = 5;
    pairs.rank = 3;
    pairs.factor = 0.7;
    pairs.cells_per_rad = pairs.n_phi / pi<double>;
    pairs.first = view(first);
    pairs.second = view(second);
    pairs.kind = view(kind);
    pairs.behind = view(behind);
    pairs.knot = view(knot);
    pairs.f = view(f);
    pairs.C = view(C);
  }
};

}  // namespace srm
