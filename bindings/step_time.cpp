// What a control step costs on this computer: the controller alone, over recorded samples.
#include <algorithm>
#include <chrono>

#include "bindings.hpp"
#include "srm/sim/columns.hpp"

namespace bound {

namespace {

/// Seconds per step, the least of `repeats` passes over the samples, each from the state that the
/// controller is in. Rows: the columns of a measurement, and the reference.
double step_time(const AnyController& controller, const Array<2>& samples, int repeats) {
  return std::visit(
      [&]<int N>(const srm::Controller<N>& given) {
        const int n = int(samples.shape(0));
        if (int(samples.shape(1)) != N + 5)
          throw std::invalid_argument("need n_phases + 5 columns");
        if (n == 0 || repeats < 1) throw std::invalid_argument("need samples and repeats");
        double least = 1e300;
        for (int pass = 0; pass < repeats; ++pass) {
          srm::Controller<N> sampled = given;
          const auto start = std::chrono::steady_clock::now();
          for (int j = 0; j < n; ++j) {
            srm::Measurement<double, N> y;
            const double reference = *srm::read_columns(y, samples.data() + j * (N + 5));
            sampled(y, reference);
          }
          const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
          least = std::min(least, taken.count());
        }
        return least / n;
      },
      controller.step);
}

}  // namespace

void bind_step_time(nb::module_& m) {
  m.def("step_time", &step_time, nb::arg("controller"), nb::arg("samples"), nb::kw_only(),
        nb::arg("repeats"),
        "Wall time of a control step [s], the least mean of `repeats` passes. samples: (n, "
        "n_phases + 5) the columns of a measurement, and the reference [N m or rad/s].");
}

}  // namespace bound
