// A control law in Python: what it sees and what it returns.
#include "measurement.hpp"
#include "srm/control/part/modulator.hpp"

namespace bound {

namespace {

using Order = srm::PhaseCommand<double>;

/// What a gate cannot follow of an order, and what it needs; empty where it can.
std::string wrong(const Order& order) {
  const auto told = [](const char* name, double value) {
    return std::string(name) + " = " + nb::repr(nb::float_(value)).c_str() + ", need ";
  };
  double last = 0;
  for (const double t : order.t_edge) {
    if (!(t >= last)) return told("t_edge", t) + "edges that do not fall";
    last = t;
  }
  if (!(order.i_band >= 0)) return told("i_band", order.i_band) + "i_band >= 0";
  const std::pair<const char*, double> finite[] = {
      {"i_ref", order.i_ref}, {"theta_on", order.theta_on}, {"theta_off", order.theta_off}};
  for (const auto& [name, value] : finite) {
    if (!srm::is_finite(value)) return told(name, value) + "finite numbers";
  }
  return {};
}

/// A mistake of a function, by its name, on one line.
[[noreturn]] void refuse(const nb::object& function, const std::string& text) {
  const nb::object error = nb::module_::import_("reluctance.base.errors").attr("ParameterError");
  const std::string name = nb::str(function.attr("__name__")).c_str();
  PyErr_SetString(error.ptr(), (name + " returned " + text).c_str());
  throw nb::python_error();
}

template <int N>
srm::Command<double, N> taken(const nb::object& function, const nb::object& answer) {
  const std::string need = ", need a list of " + std::to_string(N) + " Order, one a phase";
  const auto text = [](nb::handle what) {
    return std::string(nb::repr(what).c_str()).substr(0, 80);
  };
  if (!nb::isinstance<nb::sequence>(answer)) {
    refuse(function, text(answer) + need);
  }
  const nb::sequence orders = nb::borrow<nb::sequence>(answer);
  if (nb::len(orders) != N) {
    refuse(function, std::to_string(nb::len(orders)) + " orders" + need);
  }
  srm::Command<double, N> command;
  for (int k = 0; k < N; ++k) {
    const nb::object order = orders[k];
    if (!nb::isinstance<Order>(order)) {
      refuse(function, text(order) + " for a phase" + need);
    }
    command[k] = nb::cast<Order>(order);
    if (const std::string found = wrong(command[k]); !found.empty()) {
      refuse(function, "an Order with " + found);
    }
  }
  return command;
}

AnyLaw python_law(int n_phases, nb::callable function) {
  return with_phases(n_phases, [&]<int N>() -> AnyLaw {
    return {AnyLaw::Any<double>(srm::CalledLaw<double, N>{
        [owner = guarded(std::move(function))](const srm::Measurement<double, N>& y, double tau_ref,
                                               srm::Learned<double>&) {
          const nb::gil_scoped_acquire lock;
          return taken<N>(*owner, (*owner)(Measurement::of(y), tau_ref));
        }})};
  });
}

void needs(const char* name, double value, const char* what) {
  throw std::invalid_argument(std::string(name) + " = " + nb::repr(nb::float_(value)).c_str() +
                              ", need " + what);
}

constexpr double longest = 1;  // of a sample; what is longer, or later in it, are microseconds [s]

/// A pulse of a mean voltage.
Order pwm(double duty, double T_s, double centre) {
  if (duty != duty) needs("duty", duty, "a number");
  if (!(T_s > 0 && T_s < longest)) needs("T_s", T_s, "the control period in seconds");
  if (!(centre >= 0 && centre <= 1)) needs("centre", centre, "a fraction of the sample, 0 to 1");
  return srm::modulate(duty, T_s, centre);
}

/// One leg between two instants, another one before and after.
Order pulse(srm::Leg outside, srm::Leg inside, double start, double end) {
  if (start >= longest) needs("start", start, "an instant of the sample in seconds");
  if (end >= longest) needs("end", end, "an instant of the sample in seconds");
  return srm::pulse(outside, inside, start, end);
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
  nb::class_<Measurement>(m, "Measurement", "One sample, as the sensors deliver it.")
      .def(
          "__init__",
          [](Measurement* self, const std::vector<double>& i, double theta_e, double omega_m,
             double u_dc, double i_source) {
            new (self) Measurement{i, theta_e, omega_m, u_dc, i_source};
          },
          nb::kw_only(), nb::arg("i"), nb::arg("theta_e"), nb::arg("omega_m"), nb::arg("u_dc"),
          nb::arg("i_source") = 0.0)
      .def_ro("i", &Measurement::i, "Phase currents, one a phase [A].")
      .def_ro("theta_e", &Measurement::theta_e,
              "Electrical angle of the first phase, in [0, 2 pi) [rad].")
      .def_ro("omega_m", &Measurement::omega_m, "Rotor speed [rad/s].")
      .def_ro("u_dc", &Measurement::u_dc, "dc-link voltage [V].")
      .def_ro("i_source", &Measurement::i_source, "Current of the source into the dc link [A].")
      .def_prop_ro("n_phases", [](const Measurement& y) { return y.i.size(); })
      .def_prop_ro(
          "columns",
          [](const Measurement& y) {
            std::vector<double> row = y.i;
            row.insert(row.end(), {y.theta_e, y.omega_m, y.u_dc, y.i_source});
            return row;
          },
          "The numbers in their order: i, theta_e, omega_m, u_dc, i_source.")
      .def("angle", &Measurement::angle, nb::arg("k"),
           "Electrical angle of phase k: 0 unaligned, pi aligned [rad].");
  auto order = nb::class_<Order>(m, "Order", "What one phase does until the next sample.");
  order.def(nb::init<>(), "All off: the leg demagnetizes.");
  order
      .def_static("hold", &srm::hold<double>, nb::arg("leg"), "One leg state for the whole sample.")
      .def_static("pulse", &pulse, nb::arg("outside"), nb::arg("inside"), nb::arg("start"),
                  nb::arg("end"),
                  "`inside` between two instants of the sample [s], `outside` before and after.")
      .def_static("pwm", &pwm, nb::arg("duty"), nb::arg("T_s"), nb::arg("centre") = 0.5,
                  "A pulse of the mean voltage duty u_dc, held within -u_dc and u_dc, centred at "
                  "this fraction of the sample T_s [s].")
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
  m.def("python_law", &python_law, nb::arg("n_phases"), nb::arg("step"),
        "A law in Python: step(measurement, tau_ref) is called at every sample and returns an "
        "Order for each phase.");
}

}  // namespace bound
