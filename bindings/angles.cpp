// Conduction angles with hysteresis current control.
#include "srm/control/angles.hpp"

#include "law_parts.hpp"

namespace bound {

namespace {

AnyController angles(const Setting& setting, const srm::Conduction<double>& conduction,
                     const srm::MeanTorque<double>& reference, double i_band, srm::Leg chop,
                     srm::AngleWatch watch) {
  return controller(setting, [&]<class T, int N>(const auto&) {
    const srm::Angles<T, N> law{.conduction = in_precision<T>(conduction),
                                .reference = in_precision<T>(reference),
                                .i_band = T(i_band),
                                .chop = chop,
                                .watch = watch};
    return std::pair(law, std::shared_ptr<void>());
  });
}

}  // namespace

void bind_angles(nb::module_& m) {
  m.def("without_reference", &without_reference, nb::arg("controller"),
        "The controller of a law that holds a fixed current instead of a torque.");
  m.def("angles", &angles, nb::arg("setting"), nb::kw_only(), nb::arg("conduction"),
        nb::arg("reference"), nb::arg("i_band"), nb::arg("chop"), nb::arg("watch"),
        "Current held in a band of half width i_band [A] between turn-on and turn-off.");
}

}  // namespace bound
