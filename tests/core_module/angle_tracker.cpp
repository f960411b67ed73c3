// The angle tracker by itself.
#include "srm/control/frame/angle_tracker.hpp"

#include "arrays.hpp"

namespace bound {

namespace {

/// (n, 2): estimated electrical angle [rad] and mechanical speed [rad/s].
nb::ndarray<nb::numpy, double> track_angle(const Array<1>& theta_e, double T_s, double bandwidth,
                                           int N_r, bool single) {
  const std::size_t n = theta_e.shape(0);
  std::vector<double> values(2 * n);
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
  return numpy(std::move(values), {n, 2});
}

}  // namespace

void bind_angle_tracker(nb::module_& m) {
  m.def("track_angle", &track_angle, nb::arg("theta_e"), nb::kw_only(), nb::arg("T_s"),
        nb::arg("bandwidth"), nb::arg("N_r"), nb::arg("single"),
        "Estimated electrical angle [rad] and mechanical speed [rad/s], shape (n, 2), from n "
        "counted electrical angles.");
}

}  // namespace bound
