// Structs as rows of numbers: the columns and their names are the fields, arrays spread out.
#pragma once

#include <string>
#include <type_traits>
#include <vector>

#include "srm/base/fields.hpp"

namespace srm {

/// A value with elements: spread over as many columns.
template <class V>
concept Spread = requires(V& value) {
  value[0];
};

template <class V>
constexpr double* write_columns(const V& value, double* row) {
  if constexpr (Listed<V>) {
    fields_of(value, [&](auto... field) { ((row = write_columns(field.value, row)), ...); });
    return row;
  } else if constexpr (Spread<V>) {
    for (const auto& element : value) row = write_columns(element, row);
    return row;
  } else {
    *row = static_cast<double>(value);
    return row + 1;
  }
}

template <class V>
constexpr const double* read_columns(V& value, const double* row) {
  if constexpr (Listed<V>) {
    fields_of(value, [&](auto... field) { ((row = read_columns(field.value, row)), ...); });
    return row;
  } else if constexpr (Spread<V>) {
    for (auto& element : value) row = read_columns(element, row);
    return row;
  } else if constexpr (std::is_enum_v<V>) {
    value = static_cast<V>(static_cast<int>(*row));
    return row + 1;
  } else {
    value = static_cast<V>(*row);
    return row + 1;
  }
}

/// Number of columns that a value fills.
template <class V>
constexpr int columns_of(const V& value) {
  if constexpr (Listed<V>) {
    return fields_of(value, [](auto... field) { return (0 + ... + columns_of(field.value)); });
  } else if constexpr (Spread<V>) {
    return static_cast<int>(value.size()) * columns_of(value[0]);
  } else {
    return 1;
  }
}

/// A name for each column: that of the field; for arrays with _0, _1, ... behind it.
template <class V>
void column_names(const V& value, const std::string& name, std::vector<std::string>& names) {
  if constexpr (Listed<V>) {
    fields_of(value, [&](auto... field) { (column_names(field.value, field.name, names), ...); });
  } else if constexpr (Spread<V>) {
    for (std::size_t j = 0; j < value.size(); ++j) {
      column_names(value[j], name + "_" + std::to_string(j), names);
    }
  } else {
    names.push_back(name);
  }
}

template <class S>
std::vector<std::string> column_names(const S& s) {
  std::vector<std::string> names;
  column_names(s, "", names);
  return names;
}

}  // namespace srm
