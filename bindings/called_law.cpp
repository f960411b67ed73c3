// A control law in Python: what it sees, what it returns, and the controller around it.
#include "srm/sim/called_law.hpp"

#include "bindings.hpp"
#include "srm/control/part/modulator.hpp"

namespace bound {

namespace {

using Order = srm::PhaseCommand<double>;

/// A sample as a law in Python sees it.
struct Seen {
  std::vector<double> i;
  double theta_e, omega_m, u_dc, i_source;

  double angle(int k) const {
    const double strokes = double(k) / double(i.size());
    return srm::wrap(theta_e - strokes * srm::two_pi<double>);
  }
};

/// Numbers that a gate can follow: finite, and edges that never fall.
bool makes_sense(const Order& order) {
  double last = 0;
  for (const double t : order.t_edge) {
    if (!(t >= last)) return false;
    last = t;
  }
  return srm::is_finite(order.i_ref) && order.i_band >= 0 && srm::is_finite(order.theta_on) &&
         srm::is_finite(order.theta_off);
}

/// A mistake of the law, on one line.
[[noreturn]] void refuse(const std::string& text) {
  const nb::object error = nb::module_::import_("reluctance.errors").attr("ParameterError");
  PyErr_SetString(error.ptr(), text.c_str());
  throw nb::python_error();
}

template <int N>
srm::Command<double, N> taken(const nb::object& answer) {
  const std::string need = ", need a list of " + std::to_string(N) + " Order, one a phase";
  const auto text = [](nb::handle what) {
    return std::string(nb::repr(what).c_str()).substr(0, 80);
  };
  if (!nb::isinstance<nb::sequence>(answer)) {
    refuse("step returned " + text(answer) + need);
  }
  const nb::sequence orders = nb::borrow<nb::sequence>(answer);
  if (nb::len(orders) != N) {
    refuse("step returned " + std::to_string(nb::len(orders)) + " orders" + need);
  }
  srm::Command<double, N> command;
  for (int k = 0; k < N; ++k) {
    const nb::object order = orders[k];
    if (!nb::isinstance<Order>(order)) {
      refuse("step returned " + text(order) + " for a phase" + need);
    }
    command[k] = nb::cast<Order>(order);
    if (!makes_sense(command[k])) {
      refuse("step returned " + text(order) +
             ", need finite numbers, i_band >= 0 and edges that do not fall");
    }
  }
  return command;
}

/// The simulation runs without the interpreter lock; each sample takes it back.
AnyController controller_of(const Setting& setting, nb::callable function) {
  const std::shared_ptr<nb::callable> owner(new nb::callable(std::move(function)), [](auto* f) {
    const nb::gil_scoped_acquire lock;
    delete f;
  });
  return with_phases(setting.n_phases, [&]<int N>() -> AnyController {
    const srm::CalledLaw<N> law{[owner](const srm::Measurement<double, N>& y, double tau_ref) {
      const nb::gil_scoped_acquire lock;
      return taken<N>((*owner)(
          Seen{{y.i.begin(), y.i.end()}, y.theta_e, y.omega_m, y.u_dc, y.i_source}, tau_ref));
    }};
    return {srm::on_desk(drive_control(law, setting), nullptr), {}};
  });
}

std::string text_of(const Order& order) {
  std::string text = "Order(";
  srm::fields_of(order, [&](auto... field) {
    ((text += std::string(field.name) + "=" + nb::repr(nb::cast(field.value)).c_str() + ", "), ...);
  });
  return text.substr(0, text.size() - 2) + ")";
}

}  // namespace

void bind_called_law(nb::module_& m) {
  nb::class_<Seen>(m, "Measurement", "One sample, as the sensors deliver it.")
      .def_ro("i", &Seen::i, "Phase currents, one a phase [A].")
      .def_ro("theta_e", &Seen::theta_e, "Electrical angle of the first phase, in [0, 2 pi) [rad].")
      .def_ro("omega_m", &Seen::omega_m, "Rotor speed [rad/s].")
      .def_ro("u_dc", &Seen::u_dc, "dc-link voltage [V].")
      .def_ro("i_source", &Seen::i_source, "Current of the source into the dc link [A].")
      .def_prop_ro("n_phases", [](const Seen& y) { return y.i.size(); })
      .def("angle", &Seen::angle, nb::arg("k"),
           "Electrical angle of phase k: 0 unaligned, pi aligned [rad].");
  auto order = nb::class_<Order>(m, "Order", "What one phase does until the next sample.");
  order.def(nb::init<>(), "All off: the leg demagnetizes.");
  order
      .def_static("hold", &srm::hold<double>, nb::arg("leg"), "One leg state for the whole sample.")
      .def_static("pulse", &srm::pulse<double>, nb::arg("outside"), nb::arg("inside"),
                  nb::arg("start"), nb::arg("end"),
                  "`inside` between two instants of the sample [s], `outside` before and after.")
      .def_static("pwm", &srm::modulate<double>, nb::arg("duty"), nb::arg("T_s"),
                  nb::arg("centre") = 0.5,
                  "A pulse of the mean voltage duty u_dc, duty in [-1, 1], centred at this "
                  "fraction of the sample T_s [s].")
      .def_static("regulate", &srm::regulate<double>, nb::arg("i_ref"), nb::arg("i_band"),
                  nb::arg("chop") = srm::Leg::freewheel,
                  "The hysteresis comparator holds the current at i_ref +- i_band [A]; above the "
                  "band the leg freewheels (soft chopping) or demagnetizes (hard chopping).")
      .def("__repr__", &text_of);
  Order sample;
  srm::fields_of(sample, [&](auto... field) {
    (order.def_prop_ro(field.name,
                       [name = std::string(field.name)](const Order& o) {
                         nb::object value = nb::none();
                         srm::fields_of(o, [&](auto... f) {
                           ((f.name == name ? void(value = nb::cast(f.value)) : void()), ...);
                         });
                         return value;
                       }),
     ...);
  });
  m.def("controller_of", &controller_of, nb::arg("setting"), nb::arg("step"),
        "The controller of a law in Python: step(measurement, tau_ref) is called at every sample "
        "and returns an Order for each phase.");
}

}  // namespace bound
