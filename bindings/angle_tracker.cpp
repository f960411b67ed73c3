// The angle tracker by itself.
#include "srm/control/angle_tracker.hpp"

#include "bindings.hpp"

namespace bound {

namespace {

/// (n, 2): estimated electrical angle [rad] and mechanical speed [rad/s].
nb::ndarray<nb::numpy, double, nb::ndim<2>> track_angle(const Vector& theta_e, double T_s,
                                                        double bandwidth, int N_r, bool single) {
  const std::size_t n = theta_e.shape(0);
  auto* values = new double[n * 2];
  nb::capsule owner(values, [](void* p) noexcept { delete[] static_cast<double*>(p); });
  const auto run = [&]<class T>() {
    const srm::AngleTracker<T> tracker{T(T_s), T(bandwidth), N_r};
    typename srm::AngleTracker<T>::State x;
    for (std::size_t j = 0; j < n; ++j) {
      tracker.step(x, srm::wrap(T(theta_e.data()[j])));
      values[2 * j] = x.theta_e;
      values[2 * j + 1] = tracker.omega_m(x);
    }
  };
  if (single) {
    run.template operator()<float>();
  } else {
    run.template operator()<double>();
  }
  return {values, {n, 2}, owner};
}

}  // namespace

void bind_angle_tracker(nb::module_& m) {
  m.def("track_angle", &track_angle, nb::arg("theta_e"), nb::kw_only(), nb::arg("T_s"),
        nb::arg("bandwidth"), nb::arg("N_r"), nb::arg("single"),
        "Estimated electrical angle [rad] and mechanical speed [rad/s], shape (n, 2), from n "
        "counted electrical angles.");
}

}  // namespace bound
