// Direct instantaneous torque control.
#include "srm/control/ditc.hpp"

#include "law_parts.hpp"

namespace bound {

namespace {

AnyController ditc(const Setting& setting, const srm::Conduction<double>& conduction, double inner,
                   double outer, double i_max) {
  return controller(setting, [&]<class T, int N>(const auto& model) {
    using M = std::decay_t<decltype(model)>;
    const srm::Ditc<M, N> law{.machine = model,
                              .conduction = in_precision<T>(conduction),
                              .bands = {T(inner), T(outer)},
                              .i_max = T(i_max)};
    return std::pair(law, std::shared_ptr<void>());
  });
}

}  // namespace

void bind_ditc(nb::module_& m) {
  m.def("ditc", &ditc, nb::arg("setting"), nb::kw_only(), nb::arg("conduction"), nb::arg("inner"),
        nb::arg("outer"), nb::arg("i_max"),
        "Legs chosen by the torque error. inner, outer: half widths of the torque bands [N m].");
}

}  // namespace bound
