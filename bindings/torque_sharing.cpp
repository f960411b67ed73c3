// Torque sharing function with hysteresis current control.
#include "srm/control/torque_sharing.hpp"

#include "law_parts.hpp"

namespace bound {

namespace {

AnyController torque_sharing(const Setting& setting, const srm::Sharing<double>& sharing,
                             double i_max, double i_band, double t_ahead, srm::Leg chop) {
  return controller(setting, [&]<class T, int N>(const auto& model) {
    using M = std::decay_t<decltype(model)>;
    const srm::TorqueSharing<M, N> law{.machine = model,
                                       .sharing = in_precision<T>(sharing),
                                       .i_max = T(i_max),
                                       .i_band = T(i_band),
                                       .t_ahead = T(t_ahead),
                                       .chop = chop};
    return std::pair(law, std::shared_ptr<void>());
  });
}

}  // namespace

void bind_torque_sharing(nb::module_& m) {
  m.def("torque_sharing", &torque_sharing, nb::arg("setting"), nb::kw_only(), nb::arg("sharing"),
        nb::arg("i_max"), nb::arg("i_band"), nb::arg("t_ahead"), nb::arg("chop"),
        "Shared torque as current references, for the instant t_ahead [s] after the sample.");
}

}  // namespace bound
