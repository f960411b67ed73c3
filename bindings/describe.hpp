// A controller as a tree of names and numbers: what its C++ source is written from.
//
// The tree is made from the very object that runs on the desk, so export has no second list of
// parameters. Each function takes its struct apart by structured binding: a field that is added
// to a struct and forgotten here does not compile. The target's source uses designated
// initialisers, so a wrong name or order does not compile there.
//
//   struct   {"type": C++ type, "fields": {name: node, ...}}
//   enum     {"type": C++ type, "value": int}
//   table    {"table": element type, "values": [...]}
//   array    [...];  numbers and truth values as they are
#pragma once

#include <nanobind/nanobind.h>

#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>

#include "srm/base/table.hpp"
#include "srm/control/angles.hpp"
#include "srm/control/deadbeat.hpp"
#include "srm/control/ditc.hpp"
#include "srm/control/drive_control.hpp"
#include "srm/control/edge_mpc.hpp"
#include "srm/control/finite_set_mpc.hpp"
#include "srm/control/paper_mpc.hpp"
#include "srm/control/pwm_current.hpp"
#include "srm/control/torque_sharing.hpp"
#include "srm/machine/flux_map.hpp"
#include "srm/machine/lehuy.hpp"

namespace bound {

namespace nb = nanobind;

/// A node that is made already.
inline nb::object described(const nb::object& node) { return node; }

template <class V>
  requires(std::is_arithmetic_v<V>)
nb::object described(V value) {
  return nb::cast(value);
}

template <class E>
  requires(std::is_enum_v<E>)
nb::object described_enum(const char* type, E value) {
  nb::dict node;
  node["type"] = type;
  node["value"] = int(value);
  return node;
}
inline nb::object described(srm::Leg v) { return described_enum("srm::Leg", v); }
inline nb::object described(srm::AngleWatch v) { return described_enum("srm::AngleWatch", v); }
inline nb::object described(srm::Carriers v) { return described_enum("srm::Carriers", v); }
inline nb::object described(srm::Shape v) { return described_enum("srm::Shape", v); }
inline nb::object described(srm::Motion v) { return described_enum("srm::Motion", v); }
inline nb::object described(srm::Comparators v) { return described_enum("srm::Comparators", v); }
inline nb::object described(srm::Outer v) { return described_enum("srm::Outer", v); }

template <class V>
nb::object described_table(const char* element, const V* values, int n) {
  nb::list list;
  for (int j = 0; j < n; ++j) list.append(values[j]);
  nb::dict node;
  node["table"] = element;
  node["values"] = list;
  return node;
}

template <srm::Real T, std::size_t n>
nb::object described(const std::array<T, n>& values) {
  nb::list list;
  for (const T value : values) list.append(value);
  return list;
}

/// A struct: names "a, b, c" for the values in their order. Defined last, where every overload of
/// `described` is known.
template <class... V>
nb::object described_fields(const std::string& type, std::string_view names, const V&... values);

/// "name<a, b, c>"
template <class... Arguments>
std::string template_id(const char* name, const Arguments&... arguments) {
  std::ostringstream text;
  const char* separator = "<";
  ((text << name << separator << arguments, separator = ", ", name = ""), ...);
  return text.str() + ">";
}

template <srm::Real T>
const char* type_name(T) {
  return std::is_same_v<T, float> ? "float" : "double";
}
template <srm::Real T>
std::string type_name(const srm::LeHuy<T>&) {
  return template_id("srm::LeHuy", type_name(T{}));
}
template <srm::Real T>
std::string type_name(const srm::FluxMap<T>&) {
  return template_id("srm::FluxMap", type_name(T{}));
}
/// The desk's map with its memory is a plain map on the target.
template <class M>
  requires requires(const M& m) { m.tables; }
std::string type_name(const M& m) {
  return type_name(m.map);
}

template <srm::Real T>
nb::object described(const srm::LeHuy<T>& m) {
  const auto& [N_r, L_u, L_sat, A, B, i_sat] = m;
  return described_fields(type_name(m), "N_r, L_u, L_sat, A, B, i_sat", N_r, L_u, L_sat, A, B,
                          i_sat);
}

template <srm::Real T>
nb::object described(const srm::FluxMap<T>& m) {
  const auto& [N_r, n_i, n_theta, n_slot, theta_span, cells_per_rad, slots_per_A, knot, piece,
               coefficient] = m;
  nb::object node = described_fields(
      type_name(m), "N_r, n_i, n_theta, n_slot, theta_span, cells_per_rad, slots_per_A", N_r, n_i,
      n_theta, n_slot, theta_span, cells_per_rad, slots_per_A);
  nb::object fields = node["fields"];
  fields["knot"] = described_table(type_name(T{}), knot, n_i);
  fields["piece"] = described_table("std::uint8_t", piece, n_slot);
  fields["coefficient"] =
      described_table(type_name(T{}), coefficient, n_i * (n_theta + 3) * srm::FluxMap<T>::n_power);
  return node;
}
template <class M>
  requires requires(const M& m) { m.tables; }
nb::object described(const M& m) {
  return described(m.map);
}

/// The table of the first speed has those of the others behind it.
template <srm::Real T>
nb::object described(const srm::Guide<T>& guide) {
  const auto& [first, omega, n_speeds, u_dc, drop] = guide;
  const auto& [values, rows, columns, level_max] = first;
  const char* element = type_name(T{});
  return described_fields(
      template_id("srm::Guide", element), "first, omega, n_speeds, u_dc, drop",
      described_fields(template_id("srm::AngleTable", element), "values, rows, columns, level_max",
                       described_table(element, values, n_speeds * rows * columns), rows, columns,
                       level_max),
      described_table(element, omega, n_speeds), n_speeds, u_dc, drop);
}

/// A law's numbers at the speeds of its guide.
template <srm::Real T>
nb::object described_per_speed(const srm::Guide<T>& guide, const T* values) {
  return described_table(type_name(T{}), values, guide.n_speeds);
}

template <srm::Real T>
nb::object described(const srm::Conduction<T>& c) {
  const auto& [theta_on, theta_off, omega_start] = c;
  return described_fields(template_id("srm::Conduction", type_name(T{})),
                          "theta_on, theta_off, omega_start", theta_on, theta_off, omega_start);
}

template <srm::Real T>
nb::object described(const srm::MeanTorque<T>& m) {
  const auto& [tau_max, i_ref] = m;
  return described_fields(template_id("srm::MeanTorque", type_name(T{})), "tau_max, i_ref", tau_max,
                          i_ref);
}

template <srm::Real T>
nb::object described(const srm::Sharing<T>& s) {
  const auto& [shape, theta_on, theta_ov, table] = s;
  return described_fields(template_id("srm::Sharing", type_name(T{})),
                          "shape, theta_on, theta_ov, table", shape, theta_on, theta_ov, table);
}

template <srm::Real T>
nb::object described(const srm::TorqueBands<T>& b) {
  const auto& [inner, outer] = b;
  return described_fields(template_id("srm::TorqueBands", type_name(T{})), "inner, outer", inner,
                          outer);
}

template <srm::Real T>
nb::object described(const srm::SpeedPi<T>& s) {
  const auto& [K_p, K_i, tau_min, tau_max, T_s] = s;
  return described_fields(template_id("srm::SpeedPi", type_name(T{})),
                          "K_p, K_i, tau_min, tau_max, T_s", K_p, K_i, tau_min, tau_max, T_s);
}

template <srm::Real T>
nb::object described(const srm::AngleTracker<T>& tracker) {
  const auto& [T_s, bandwidth, N_r] = tracker;
  return described_fields(template_id("srm::AngleTracker", type_name(T{})), "T_s, bandwidth, N_r",
                          T_s, bandwidth, N_r);
}

template <srm::Real T, int N>
nb::object described(const srm::Angles<T, N>& law) {
  const auto& [conduction, reference, i_band, chop, watch] = law;
  return described_fields(template_id("srm::Angles", type_name(T{}), N),
                          "conduction, reference, i_band, chop, watch", conduction, reference,
                          i_band, chop, watch);
}

template <class M, int N>
nb::object described(const srm::PwmCurrent<M, N>& law) {
  const auto& [machine, R, conduction, reference, bandwidth, T_s] = law;
  return described_fields(template_id("srm::PwmCurrent", type_name(machine), N),
                          "machine, R, conduction, reference, bandwidth, T_s", machine, R,
                          conduction, reference, bandwidth, T_s);
}

template <class M, int N>
nb::object described(const srm::TorqueSharing<M, N>& law) {
  const auto& [machine, sharing, i_max, i_band, t_ahead, chop] = law;
  return described_fields(template_id("srm::TorqueSharing", type_name(machine), N),
                          "machine, sharing, i_max, i_band, t_ahead, chop", machine, sharing, i_max,
                          i_band, t_ahead, chop);
}

template <class M, int N>
nb::object described(const srm::Ditc<M, N>& law) {
  const auto& [machine, conduction, bands, i_max] = law;
  return described_fields(template_id("srm::Ditc", type_name(machine), N),
                          "machine, conduction, bands, i_max", machine, conduction, bands, i_max);
}

template <class M, int N>
nb::object described(const srm::Deadbeat<M, N>& law) {
  const auto& [machine, R, sharing, i_max, T_s, delay, carriers] = law;
  return described_fields(template_id("srm::Deadbeat", type_name(machine), N),
                          "machine, R, sharing, i_max, T_s, delay, carriers", machine, R, sharing,
                          i_max, T_s, delay, carriers);
}

/// The target's capacities are what the parameters use: N_p and N_c themselves.
template <srm::Real T, int N, int Np_max, int Nc_max>
nb::object described(const srm::IncrementalMpc<T, N, Np_max, Nc_max>& mpc) {
  const auto& [N_p, N_c, r_w, a, b] = mpc;
  return described_fields(template_id("srm::IncrementalMpc", type_name(T{}), N, N_p, N_c),
                          "N_p, N_c, r_w, a, b", N_p, N_c, r_w, a, b);
}

template <class M, int N, int Np_max, int Nc_max>
nb::object described(const srm::PaperMpc<M, N, Np_max, Nc_max>& law) {
  const auto& [machine, guide, mpc, w_i, R, i_max, i_band, T_s, delay] = law;
  return described_fields(template_id("srm::PaperMpc", type_name(machine), N, mpc.N_p, mpc.N_c),
                          "machine, guide, mpc, w_i, R, i_max, i_band, T_s, delay", machine, guide,
                          mpc, w_i, R, i_max, i_band, T_s, delay);
}

template <class M, int N>
nb::object described(const srm::FiniteSetMpc<M, N>& law) {
  const auto& [machine, guide, horizon, w_psi, w_i, w_sw, t_end, R, i_max, T_s, delay] = law;
  return described_fields(template_id("srm::FiniteSetMpc", type_name(machine), N),
                          "machine, guide, horizon, w_psi, w_i, w_sw, t_end, R, i_max, T_s, delay",
                          machine, guide, horizon, described_per_speed(guide, w_psi), w_i, w_sw,
                          t_end, R, i_max, T_s, delay);
}

template <class M, int N>
nb::object described(const srm::EdgeMpc<M, N>& law) {
  const auto& [machine, guide, w_sw, psi_slack, R, i_max, T_s, delay] = law;
  return described_fields(template_id("srm::EdgeMpc", type_name(machine), N),
                          "machine, guide, w_sw, psi_slack, R, i_max, T_s, delay", machine, guide,
                          w_sw, described_per_speed(guide, psi_slack), R, i_max, T_s, delay);
}

template <class Law>
nb::object described(const srm::DriveControl<Law>& control) {
  const auto& [law, outer, speed, motion, tracker, comparators, t_dead] = control;
  const nb::object inside = described(law);
  const std::string type = nb::cast<std::string>(inside["type"]);
  return described_fields(template_id("srm::DriveControl", type),
                          "law, outer, speed, motion, tracker, comparators, t_dead", law, outer,
                          speed, motion, tracker, comparators, t_dead);
}

template <class... V>
nb::object described_fields(const std::string& type, std::string_view names, const V&... values) {
  nb::dict fields;
  const auto add = [&](const nb::object& value) {
    const auto comma = names.find(", ");
    fields[nb::str(names.data(), std::min(comma, names.size()))] = value;
    names.remove_prefix(comma == names.npos ? names.size() : comma + 2);
  };
  (add(described(values)), ...);
  nb::dict node;
  node["type"] = type;
  node["fields"] = fields;
  return node;
}

}  // namespace bound
