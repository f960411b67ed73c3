// Phases that are unlike by their flux linkages: what hides it, and which is named.
#include <algorithm>
#include <cmath>

#include "errors.hpp"
#include "srm/control/guard/likeness.hpp"
#include "within.hpp"

using namespace srm;

namespace {

/// Phase 1 of three has another ratio of its two flux linkages; each allowance by itself hides
/// as much as it says.
double unlikeness() {
  double worst = 0;
  struct Case {
    Likeness<double> part;
    double most;  // ratio apart that it hides
  };
  // Samples of 5 A with 0.1 Wb, 3 a window, 4 samples old; the voltage brings 0.02 Wb a sample.
  Likeness<double> none{};
  none.recent = 1000;
  Case cases[8]{};
  for (Case& c : cases) c.part = none;
  cases[0].part.spread = 0.02;
  cases[0].most = 0.04 * 1.3;  // 0.3 is taken by the resistance
  cases[1].part.i_gain = 0.03;
  cases[1].most = 0.06 * 1.3;
  cases[2].part.i_offset = 0.1;
  cases[2].most = 2 * 0.02 * 1.3;
  cases[3].part.i_noise = 0.1;
  cases[3].most = 2 * 0.1 * std::sqrt(3.0) / 15;
  cases[4].part.psi_error = 0.002;
  cases[4].most = 2 * 0.02;
  cases[5].part.u_noise = 0.0005;
  cases[5].most = 2 * 0.0005 * std::sqrt(12.0) * std::sqrt(3.0) / 0.3;
  cases[6].most = 2 * 0.003 / 0.1;  // what is left open by the sample itself
  cases[7].part.spread = 1e-9;
  cases[7].most = 2e-9 * 1.3;
  for (int which = 0; which < 8; ++which) {
    for (double sense : {-1.0, 1.0}) {
      for (double part : {0.99, 1.01}) {
        const Likeness<double>& like = cases[which].part;
        Likeness<double>::State<3> x;
        int found = -1;
        const double unlike = 1 + sense * part * cases[which].most;
        for (int period = 0; period < 3; ++period) {
          for (int k = 0; k < 3; ++k) {
            for (int n = 0; n < 3; ++n) {
              x.now += 5;
              worst = worst_of({worst, unless(!like.ends(x, k, 0.6))});
              like.hears(x, k,
                         {.theta_e = 0.3 + 0.05 * n,
                          .i = 5,
                          .psi = k == 1 ? 0.1 * unlike : 0.1,
                          .map = 0.1,
                          .taken = 0.03,
                          .left = which == 6 ? 0.003 : 0,
                          .age = 4});
            }
            worst = worst_of({worst, unless(like.ends(x, k, 0.6) && !like.ends(x, k, 0.5))});
            const int now = like.concludes(x, k, 0.02);
            if (now >= 0) found = now;
          }
        }
        worst = worst_of({worst, off(found, part > 1 ? 1 : -1)});
      }
    }
  }
  return worst;
}

/// What all phases have in common hides a difference only as far as they are not asked alike: by
/// what resistance, voltage and place on the map differ. Old ratios count for nothing.
double common_errors() {
  double worst = 0;
  const auto finds = [&](const Likeness<double>& like, double unlike, double taken, int age,
                         double i, int wait) {
    Likeness<double>::State<3> x;
    int found = -1;
    for (int period = 0; period < 3; ++period) {
      for (int k = 0; k < 3; ++k) {
        x.now += wait;
        for (int n = 0; n < 3; ++n) {
          const double map = k == 1 ? 0.02 * i : 0.1;
          like.hears(x, k,
                     {.theta_e = 0.3,
                      .i = k == 1 ? i : 5,
                      .psi = k == 1 ? map * unlike : map,
                      .map = map,
                      .taken = k == 1 ? taken : 0.03,
                      .left = 0,
                      .age = k == 1 ? age : 4});
        }
        found = std::max(found, like.concludes(x, k, 0.02));
      }
    }
    return found;
  };
  Likeness<double> R{}, u{}, map{};
  R.recent = u.recent = map.recent = 1000;
  R.R_error = 0.2;
  u.u_error = 0.01;
  map.map_error = 0.05;
  worst = worst_of(
      {off(finds(R, 1.001, 0.03, 4, 5, 1), 1), off(finds(R, 1.0199, 0.04, 4, 5, 1), -1),
       off(finds(R, 1.0201, 0.04, 4, 5, 1), 1), off(finds(u, 1.001, 0.03, 4, 5, 1), 1),
       off(finds(u, 1.0099, 0.03, 9, 5, 1), -1), off(finds(u, 1.0101, 0.03, 9, 5, 1), 1),
       off(finds(map, 1.001, 0.03, 4, 5, 1), 1), off(finds(map, 1.0199, 0.03, 4, 4, 1), -1),
       off(finds(map, 1.0201, 0.03, 4, 4, 1), 1), off(finds(map, 1.0199, 0.03, 4, 6.25, 1), -1),
       off(finds(map, 1.0201, 0.03, 4, 6.25, 1), 1), off(finds(R, 1.1, 0.03, 4, 5, 500), 1),
       off(finds(R, 1.1, 0.03, 4, 5, 501), -1)});
  return worst;
}

/// Two windows of an electrical period, and any phase: the unlike one is named in each window in
/// which it differed from all others, and no longer once another one changes.
double windows_of_likeness() {
  double worst = 0;
  Likeness<double> like{};
  like.spread = 0.01;
  like.recent = 1000;
  for (int unlike = 0; unlike < 3; ++unlike) {
    const int next = (unlike + 1) % 3, last = (unlike + 2) % 3;
    Likeness<double>::State<3> x;
    const auto hears = [&](int k, int window, double ratio) {
      x.now += 5;
      for (int n = 0; n < (k == 1 ? 6 : 3); ++n) {
        like.hears(x, k,
                   {.theta_e = (window + 0.5) * turn / 12,
                    .i = 5,
                    .psi = 0.1 * ratio,
                    .map = 0.1,
                    .taken = 0,
                    .left = 0,
                    .age = 4});
      }
      return like.concludes(x, k, 0.02);
    };
    for (int window : {3, 11}) {
      for (int k : {next, last, unlike}) {
        worst = worst_of({worst, off(hears(k, window, k == unlike ? 1.1 : 1), -1)});
      }
    }
    auto other = x, forgotten = x;
    worst = worst_of({worst, off(hears(next, 3, 1), unlike), off(hears(last, 11, 1), unlike)});
    x = other;
    worst = worst_of({worst, off(hears(next, 3, 1.1), -1), off(hears(last, 3, 1), -1)});
    x = forgotten;
    like.forget(x);
    worst = worst_of({worst, off(hears(next, 3, 1), -1), off(hears(last, 3, 1), -1),
                      off(hears(unlike, 3, 1.1), -1), off(hears(next, 3, 1), unlike)});
  }
  like.map_error = 1;  // places on the map that are alike hide nothing, however many samples
  Likeness<double>::State<3> x;
  int found = -1;
  for (int n = 0; n < 60; ++n) {
    const int k = n / 6 % 3;
    x.now += 1;
    like.hears(x, k,
               {.theta_e = 0.3,
                .i = 5,
                .psi = k == 1 ? 0.11 : 0.1,
                .map = 0.1,
                .taken = 0,
                .left = 0,
                .age = 4});
    if (n % 6 == 5 || (k == 2 && n % 6 == 2)) found = std::max(found, like.concludes(x, k, 0.02));
  }
  return worst_of({worst, off(found, 1)});
}

}  // namespace

int main() {
  check("phases that are unlike: own errors", unlikeness(), 0);
  check("phases that are unlike: common errors", common_errors(), 0);
  check("phases that are unlike: their windows", windows_of_likeness(), 0);
  return failures == 0 ? 0 : 1;
}
