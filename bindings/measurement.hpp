// A sample as Python sees it.
#pragma once

#include "bindings.hpp"

namespace bound {

/// srm::Measurement of any number of phases.
struct Measurement {
  std::vector<double> i;
  double theta_e, omega_m, u_dc, i_source;

  template <int N>
  static Measurement of(const srm::Measurement<double, N>& y) {
    return {{y.i.begin(), y.i.end()}, y.theta_e, y.omega_m, y.u_dc, y.i_source};
  }

  template <int N>
  srm::Measurement<double, N> in_core() const {
    if (int(i.size()) != N) throw std::invalid_argument("i has another phase count");
    srm::Measurement<double, N> y{
        .theta_e = theta_e, .omega_m = omega_m, .u_dc = u_dc, .i_source = i_source};
    for (int k = 0; k < N; ++k) y.i[k] = i[k];
    return y;
  }

  /// Electrical angle of phase k.
  double angle(int k) const {
    if (k < 0 || k >= int(i.size())) {
      throw std::out_of_range("phase " + std::to_string(k) + ", need 0 to " +
                              std::to_string(i.size() - 1));
    }
    const double strokes = double(k) / double(i.size());
    return srm::wrap(theta_e - strokes * srm::two_pi<double>);
  }
};

/// The simulation runs without the interpreter lock; each sample takes it back. The deleter ensures
/// that the function is released under the lock too.
inline std::shared_ptr<nb::callable> guarded(nb::callable function) {
  return {new nb::callable(std::move(function)), [](auto* f) {
            const nb::gil_scoped_acquire lock;
            delete f;
          }};
}

}  // namespace bound
