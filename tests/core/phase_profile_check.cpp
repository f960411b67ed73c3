// What the profile of a phase asks of it (control/part/phase_profile.hpp): where phases couple, the
// volt-seconds that the neighbours add on the way as well; and each phase finds its own profile.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "errors.hpp"
#include "srm/control/part/phase_profile.hpp"
#include "srm/machine/lehuy.hpp"

namespace {

using Alone = srm::LeHuy<double>;
using Coupled = srm::WithPairs<Alone>;

constexpr int rows = 2, columns = 4, sets = 4;

/// Flux linkage of the set of a phase at a quarter of a turn, at the greatest torque [Wb].
double own(int set, int column) { return column == 1 ? 0 : 0.1 + 0.02 * set + 0.03 * column; }

double mutual(int set, int column) { return 0.01 * std::sin(1.0 + 4 * set + column); }

struct Guide {
  std::array<double, sets * rows * columns> values{}, others{};
  std::array<std::uint8_t, 3> mirrored{3, 2, 0};
  double omega = 100;

  Guide() {
    for (int set = 0; set < sets; ++set) {
      for (int column = 0; column < columns; ++column) {
        const auto at = static_cast<std::size_t>((set * rows + 1) * columns + column);
        values[at] = own(set, column);
        others[at] = mutual(set, column);
      }
    }
  }

  srm::ReferenceProfile<double> profile(bool couples) const {
    const int size = sets * rows * columns;
    srm::ReferenceProfile<double> g{{{values.data(), size}, rows, columns, 40.0}, {&omega, 1}};
    g.u_dc = 100;
    if (couples) {
      g.mutual = {others.data(), size};
      g.mirrored = {mirrored.data(), 3};
    }
    return g;
  }
};

}  // namespace

int main() {
  const Guide guide;
  const auto coupled = guide.profile(true), alone = guide.profile(false);
  const srm::Profile<double> all = coupled.at(40, 50, 100), one = alone.at(40, 50, 100);
  double own_error = 0, added_error = 0, without_error = 0;
  for (int k = 0; k < 3; ++k) {
    for (const double torque : {40.0, -40.0}) {
      const srm::Profile<double> p = srm::phase_profile<Coupled>(all, k, torque);
      const srm::Profile<double> same = srm::phase_profile<Coupled>(one, k, torque);
      const int set = torque < 0 ? guide.mirrored[static_cast<std::size_t>(k)] : k;
      for (int from = 0; from < columns; ++from) {
        for (int to = 0; to < columns; ++to) {
          const double theta_0 = from * turn / columns, theta_1 = to * turn / columns;
          const double asked = own(set, to);
          const double added = asked > 0 ? mutual(set, to) - mutual(set, from) : 0;
          const double found = srm::followed_flux<Coupled>(p, theta_0, theta_1);
          own_error = worst_of({own_error, off(p.at(theta_1), asked)});
          added_error = worst_of({added_error, off(found, asked + added)});
          without_error =
              worst_of({without_error, off(srm::followed_flux<Alone>(p, theta_0, theta_1), asked),
                        off(srm::followed_flux<Coupled>(same, theta_0, theta_1), own(0, to))});
        }
      }
    }
  }
  int wrong = 0;
  const auto check = [&](const char* what, double error) {
    const bool right = error < 1e-12;
    std::printf("%s %s: %.2g\n", right ? "ok  " : "FAIL", what, error);
    if (!right) ++wrong;
  };
  check("each phase has its own profile, in either sense", own_error);
  check("what the neighbours add on the way comes on top", added_error);
  check("nothing is added where the law or the guide has no pairs", without_error);
  return wrong;
}
