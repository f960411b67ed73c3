// What a control step costs on this computer: the controller alone, over recorded samples.
#include <algorithm>
#include <chrono>

#include "bindings.hpp"

namespace bound {

namespace {

/// Seconds per step, the least of `repeats` passes over the samples, each from the state that the
/// controller is in. Rows: n_phases currents, angle, speed, dc-link voltage, reference.
double step_time(const AnyController& controller, const Array<2>& samples, int repeats) {
  return std::visit(
      [&]<int N>(const srm::Controller<N>& given) {
        const int n = int(samples.shape(0));
        if (int(samples.shape(1)) != N + 4)
          throw std::invalid_argument("need n_phases + 4 columns");
        if (n == 0 || repeats < 1) throw std::invalid_argument("need samples and repeats");
        double least = 1e300;
        for (int pass = 0; pass < repeats; ++pass) {
          srm::Controller<N> sampled = given;
          const auto start = std::chrono::steady_clock::now();
          for (int j = 0; j < n; ++j) {
            const double* row = samples.data() + j * (N + 4);
            srm::Measurement<double, N> y{
                .theta_e = row[N], .omega_m = row[N + 1], .u_dc = row[N + 2]};
            for (int k = 0; k < N; ++k) y.i[k] = row[k];
            sampled(y, row[N + 3]);
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
        "n_phases + 4) phase currents [A], angle [rad], speed [rad/s], dc-link voltage [V], "
        "reference [N m or rad/s].");
}

}  // namespace bound
