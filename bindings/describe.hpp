// A controller as a tree of names and numbers: what its C++ source is written from.
//
// The tree is made from the very object that runs on the desk and from the field list of each
// struct, so export has no list of parameters of its own. The target's source uses designated
// initialisers, so a wrong name or order does not compile there.
//
//   struct   {"type": C++ type, "fields": {name: node, ...}}
//   enum     {"type": C++ type, "value": int}
//   view     {"table": element type, "values": [...]}
//   array    [...];  numbers and truth values as they are
#pragma once

#include <nanobind/nanobind.h>

#include <initializer_list>
#include <string>
#include <type_traits>

#include "srm/base/fields.hpp"
#include "srm/base/view.hpp"
#include "srm/control/law/paper_mpc.hpp"
#include "srm/sim/tables.hpp"

namespace bound {

namespace nb = nanobind;

/// From the compiler's own text: "... [with S = NAME; ...]".
inline std::string name_in(const std::string& text) {
  const auto from = text.find("S = ") + 4;
  return text.substr(from, text.find_first_of(";]", from) - from);
}

/// The name of a type as C++ source.
template <class S>
[[gnu::cold]] std::string type_text() {
  return name_in(__PRETTY_FUNCTION__);
}

/// Of the elements of a view.
template <class V>
std::string element_name() {
  using Value = typename V::Value;
  return std::is_same_v<Value, std::uint8_t> ? "std::uint8_t" : type_text<Value>();
}

template <class S>
std::string type_name(const S&) {
  return type_text<S>();
}

/// The target's capacities are what the parameters use: N_p and N_c themselves.
template <class M, int N, int Np_max, int Nc_max>
std::string type_name(const srm::PaperMpc<M, N, Np_max, Nc_max>& law) {
  return "srm::PaperMpc<" + type_text<M>() + ", " + std::to_string(N) + ", " +
         std::to_string(law.N_p) + ", " + std::to_string(law.N_c) + ">";
}

/// A field of a struct: its name, where it is, and what makes a tree of it.
struct DescribedField {
  const char* name;
  const void* at;
  nb::object (*tree)(const void*);
};

/// The tree of a struct. Not a template: the structs are many.
inline nb::dict described_struct(const std::string& type,
                                 std::initializer_list<DescribedField> list) {
  nb::dict node, fields;
  for (const DescribedField& field : list) fields[field.name] = field.tree(field.at);
  node["type"] = type;
  node["fields"] = fields;
  return node;
}

/// A tree with one name for another in all its texts.
inline nb::object renamed(const nb::object& node, const std::string& from, const std::string& to) {
  if (nb::isinstance<nb::str>(node)) return node.attr("replace")(from, to);
  if (!nb::isinstance<nb::dict>(node)) return node;
  nb::dict all;
  for (const auto& [key, value] : nb::borrow<nb::dict>(node)) {
    all[key] = renamed(nb::borrow(value), from, to);
  }
  return all;
}

template <class V>
nb::object described(const V& value);

/// The tree of a field, whichever struct it is of.
template <class V>
[[gnu::cold]] nb::object described_field(const void* at) {
  return described(*static_cast<const V*>(at));
}

template <class V>
[[gnu::cold]] nb::object described(const V& value) {
  if constexpr (requires { value.described(); }) {
    return value.described();
  } else if constexpr (srm::Listed<V>) {
    return srm::fields_of(value, [&]<class... F>(srm::Field<F>... field) -> nb::object {
      return described_struct(type_name(value),
                              {{field.name, &field.value, &described_field<F>}...});
    });
  } else if constexpr (std::is_enum_v<V>) {
    nb::dict node;
    node["type"] = type_text<V>();
    node["value"] = int(value);
    return node;
  } else if constexpr (requires { value.begin(); }) {  // a view or an array
    nb::list list;
    for (const auto element : value) list.append(element);
    if constexpr (!srm::is_view<V>) {
      return list;
    } else {
      nb::dict node;
      node["table"] = element_name<V>();
      node["values"] = list;
      return node;
    }
  } else {
    return nb::cast(value);
  }
}

}  // namespace bound
