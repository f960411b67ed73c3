#include "bind_law.hpp"
#include "srm/control/laws.hpp"

namespace bound {

template <srm::Real T>
struct Given<srm::PulseTable<T>> {
  using type = srm::Held<srm::PulseTable<double>>;
};

namespace {

using PulseTable = srm::Held<srm::PulseTable<double>>;
using Values = std::vector<double>;

PulseTable pulse_table(const Values& omega, const Values& tau, const Values& theta_on,
                       const Values& theta_off, const Values& i_ref) {
  srm::Tables memory;
  const auto kept = [&](const Values& values) { return memory.keep<double>(values); };
  const srm::PulseTable<double> view{kept(omega), kept(tau), kept(theta_on), kept(theta_off),
                                     kept(i_ref)};
  if (!view.is_consistent()) throw std::invalid_argument("need rising axes, a value at each node");
  return {view, memory.owner()};
}

void bind_pulse_table(nb::module_& m) {
  nb::class_<PulseTable>(m, "PulseTable",
                         "Angles [rad] and current [A] of motoring pulses over speed [rad/s] and "
                         "torque [N m], row by row of speed; without values no table.")
      .def(nb::new_(&pulse_table), nb::kw_only(), nb::arg("omega") = Values(),
           nb::arg("tau") = Values(), nb::arg("theta_on") = Values(),
           nb::arg("theta_off") = Values(), nb::arg("i_ref") = Values())
      .def(
          "at",
          [](const PulseTable& self, double omega_m, double tau) {
            if (!self.value.is_there()) throw std::invalid_argument("an empty table has no pulses");
            const srm::Pulse<double> pulse = self.value.at(omega_m, tau);
            return std::array{pulse.window.theta_on, pulse.window.theta_off, pulse.i_ref};
          },
          nb::arg("omega_m"), nb::arg("tau"),
          "Turn-on and turn-off angle [rad] and current [A] at a speed [rad/s] and torque [N m].");
}

}  // namespace

template <>
void bind_built_in<srm::laws::Angles>(nb::module_& m) {
  if (forms_here != Forms::other) bind_pulse_table(m);
  bind_law<srm::laws::Angles>(
      m, "angles", "Current held in a band of half width i_band [A] between turn-on and turn-off.");
}

}  // namespace bound
