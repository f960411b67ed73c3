// Every number of an exported controller, as a compiled program sees it, one per line, tables in
// place. tests/targets/test_firmware.py compares them with the description that the text was
// written from.
#include <cstdio>
#include <type_traits>

#include "parameters.hpp"
#include "srm/base/fields.hpp"

namespace {

template <class V>
void print(const V& value) {
  if constexpr (srm::Listed<V>) {
    srm::fields_of(value, [](auto... field) { (print(field.value), ...); });
  } else if constexpr (requires { value.begin(); }) {  // a view or an array
    for (const auto element : value) print(element);
  } else {
    std::printf("%.9g\n", static_cast<double>(value));
  }
}

}  // namespace

int main() {
  print(reluctance::control);
  print(reluctance::machine);
  print(reluctance::protection);
  print(reluctance::sequence);
#if __has_include("srm/control/guard/diagnosed.hpp")
  print(reluctance::diagnosis);
#endif
#ifdef FLUX_ANGLE
  print(reluctance::flux_angle);
#endif
}
