// The angle tracker by itself.
#include "srm/control/frame/angle_tracker.hpp"

#include "arrays.hpp"
#include "srm/sim/tables.hpp"

namespace bound {

namespace {

/// (n, 3): estimated electrical angle [rad], mechanical speed [rad/s] and load torque [N m].
nb::ndarray<nb::numpy, double> track_angle(const Array<1>& theta_e, const Array<1>& tau,
                                           const srm::AngleTracker<double>& given, bool single) {
  const std::size_t n = theta_e.shape(0);
  if (tau.shape(0) != n) throw std::invalid_argument("need as many torques as angles");
  std::vector<double> values(3 * n);
  const auto run = [&]<class T>() {
    srm::AngleTracker<T> tracker;
    srm::assign(tracker, given);
    typename srm::AngleTracker<T>::State x;
    for (std::size_t j = 0; j < n; ++j) {
      tracker.step(x, srm::wrap(T(theta_e.data()[j])), T(tau.data()[j]));
      values[3 * j] = x.theta_e;
      values[3 * j + 1] = tracker.omega_m(x);
      values[3 * j + 2] = x.tau_load;
    }
  };
  if (single) {
    run.template operator()<float>();
  } else {
    run.template operator()<double>();
  }
  return numpy(std::move(values), {n, 3});
}

}  // namespace

void bind_angle_tracker(nb::module_& m) {
  m.def("track_angle", &track_angle, nb::arg("theta_e"), nb::arg("tau"), nb::kw_only(),
        nb::arg("tracker"), nb::arg("single"),
        "Estimated electrical angle [rad], mechanical speed [rad/s] and load torque [N m], shape "
        "(n, 3), from n counted electrical angles and the torques before them.");
}

}  // namespace bound
