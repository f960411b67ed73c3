// The parts of the plant as trees of names and numbers, as describe.hpp has them of a controller.
//
//   vector   {"table": "double", "values": [...]}
//   variant  {"variant": index, "value": node}
//   a function has no number: None
#pragma once

#include <variant>

#include "describe.hpp"

namespace bound {

template <class V>
nb::object described_part(const V& value) {
  nb::dict node;
  if constexpr (requires(const V& v) { v(0.0); }) {
    if (value) throw std::invalid_argument("a load given as a function cannot leave Python");
    return nb::none();
  } else if constexpr (srm::Listed<V>) {
    nb::dict fields;
    srm::fields_of(
        value, [&](auto... field) { ((fields[field.name] = described_part(field.value)), ...); });
    node["fields"] = fields;
    return node;
  } else if constexpr (requires(V grown) { grown.push_back(0.0); }) {
    node["table"] = "double";
    node["values"] = nb::cast(value);
    return node;
  } else {
    return described(value);
  }
}

template <class... Alternative>
nb::object described_part(const std::variant<Alternative...>& value) {
  nb::dict node;
  node["variant"] = value.index();
  node["value"] = std::visit([](const auto& part) { return described_part(part); }, value);
  return node;
}

}  // namespace bound
