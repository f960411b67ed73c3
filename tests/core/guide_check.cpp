// A guide of a blob is refused unless every phase finds its profile in it, whatever the sense of
// the torque (c_api/sound.hpp).
#include <cstdint>
#include <cstdio>
#include <initializer_list>

#include "srm/c_api/sound.hpp"

int main() {
  constexpr int N = 3, cells = 2 * 4;
  static double values[6 * cells], mutual[6 * cells];
  const double omega = 100;
  int wrong = 0;
  const auto check = [&](bool sound, int sets, std::initializer_list<std::uint8_t> mirrored,
                         bool couples = true) {
    srm::ReferenceProfile<double> g{{{values, sets * cells}, 2, 4, 1.0}, {&omega, 1}, 100, 0};
    if (couples) g.mutual = {mutual, sets * cells};
    g.mirrored = {mirrored.begin(), int(mirrored.size())};
    const bool right = (srm::c_api::fault(g, N) == nullptr) == sound;
    std::printf("%s %d profiles, %d mirrored, %s\n", right ? "ok  " : "FAIL", sets,
                int(mirrored.size()), sound ? "sound" : "refused");
    if (!right) ++wrong;
  };
  check(true, 1, {}, false);
  check(true, 1, {});
  check(true, 3, {2, 1, 0});
  check(true, 6, {3, 5, 4});
  check(false, 2, {});         // whose would they be?
  check(false, 2, {1, 0, 1});  // none for the third phase
  check(false, 3, {0, 1});     // nor under a torque of the other sense
  check(false, 3, {2, 1, 3});  // one that is not there
  check(false, 4, {0, 1, 200});
  return wrong;
}
