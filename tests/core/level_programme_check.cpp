// The program of levels at once: its guesses end at the optimum of the general box solver.
#include <cmath>
#include <cstdio>
#include <random>

#include "srm/control/part/level_programme.hpp"

namespace {

constexpr int N = 4, N_p = 3, N_c = 2;
using Exact = std::integral_constant<int, N_p>;
using Moves = std::integral_constant<int, N_c>;

template <class Samples, class Changes>
using Programme = srm::LevelProgramme<double, N, N_p, N_c, Samples, Changes>;

/// The same random program in both forms; `tight`: most of the bounds act.
template <class P>
void fill(P& p, unsigned seed, bool tight) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  p.N_p = {};
  if constexpr (std::is_same_v<decltype(p.N_p), int>) {
    p.N_p = N_p;
    p.N_c = N_c;
  }
  p.r_w = 0.05 + 0.05 * u(random) * 0.9;
  p.w_i = 0.05;
  p.n = 1 + int(seed % N);
  for (int j = 0; j < N_p; ++j) p.error[j] = 20 * u(random);
  for (int k = 0; k < p.n; ++k) {
    auto& x = p.channels[k];
    for (int j = 0; j < N_p; ++j) x.c[j] = u(random);
    for (int m = 0; m < N_c; ++m) {
      const double reach = (tight ? 2 : 40) * (m + 1);
      x.near[m] = 20 * u(random);
      x.lo[m] = reach * (u(random) - 1) / 2;
      x.hi[m] = reach * (u(random) + 1) / 2;
      x.side[m] = std::int8_t(tight ? int(random() % 3) - 1 : 0);  // of any earlier program
    }
  }
}

}  // namespace

int main() {
  int failures = 0;
  for (const bool tight : {false, true}) {
    const int tries = 100000;
    int confirmed = 0;
    double worst = 0;
    for (int seed = 0; seed < tries; ++seed) {
      Programme<Exact, Moves> guessed;
      Programme<int, int> general;
      fill(guessed, unsigned(seed), tight);
      fill(general, unsigned(seed), tight);
      if (!guessed.guess(8)) continue;
      ++confirmed;
      general.solve_exactly();
      for (int k = 0; k < general.n; ++k) {
        for (int m = 0; m < N_c; ++m) {
          worst = std::fmax(worst, std::fabs(guessed.channels[k].v[m] - general.channels[k].v[m]));
        }
      }
    }
    const bool ok = worst < 1e-7 && confirmed > 0.98 * tries;
    std::printf("%s %s bounds: %d of %d guesses confirmed, largest difference %.1e\n",
                ok ? "ok  " : "FAIL", tight ? "tight" : "wide", confirmed, tries, worst);
    failures += ok ? 0 : 1;
  }
  return failures;
}
