// Deadbeat flux control with duty cycles.
#include "srm/control/deadbeat.hpp"

#include "law_parts.hpp"

namespace bound {

namespace {

AnyController deadbeat(const Setting& setting, const srm::Sharing<double>& sharing, double R,
                       double i_max, double T_s, int delay, srm::Carriers carriers) {
  return controller(setting, [&]<class T, int N>(const auto& model) {
    using M = std::decay_t<decltype(model)>;
    const srm::Deadbeat<M, N> law{.machine = model,
                                  .R = T(R),
                                  .sharing = in_precision<T>(sharing),
                                  .i_max = T(i_max),
                                  .T_s = T(T_s),
                                  .delay = delay,
                                  .carriers = carriers};
    return std::pair(law, std::shared_ptr<void>());
  });
}

}  // namespace

void bind_deadbeat(nb::module_& m) {
  m.def("deadbeat", &deadbeat, nb::arg("setting"), nb::kw_only(), nb::arg("sharing"), nb::arg("R"),
        nb::arg("i_max"), nb::arg("T_s"), nb::arg("delay"), nb::arg("carriers"),
        "The duty cycle that brings each phase to its shared torque in one sample.");
}

}  // namespace bound
