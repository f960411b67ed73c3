// Conduction angles with PI current control and PWM.
#include "srm/control/pwm_current.hpp"

#include "law_parts.hpp"

namespace bound {

namespace {

AnyController pwm_current(const Setting& setting, const srm::Conduction<double>& conduction,
                          const srm::MeanTorque<double>& reference, double R, double bandwidth,
                          double T_s) {
  return controller(setting, [&]<class T, int N>(const auto& model) {
    using M = std::decay_t<decltype(model)>;
    const srm::PwmCurrent<M, N> law{.machine = model,
                                    .R = T(R),
                                    .conduction = in_precision<T>(conduction),
                                    .reference = in_precision<T>(reference),
                                    .bandwidth = T(bandwidth),
                                    .T_s = T(T_s)};
    return std::pair(law, std::shared_ptr<void>());
  });
}

}  // namespace

void bind_pwm_current(nb::module_& m) {
  m.def("pwm_current", &pwm_current, nb::arg("setting"), nb::kw_only(), nb::arg("conduction"),
        nb::arg("reference"), nb::arg("R"), nb::arg("bandwidth"), nb::arg("T_s"),
        "Current held by a PI controller of this bandwidth [rad/s] between turn-on and turn-off.");
}

}  // namespace bound
