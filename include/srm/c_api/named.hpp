// The numbers of a struct under dotted names: `shaft.J`, `control.law.theta_on`,
// `reference.value_0`.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "srm/c_api/unpack.hpp"

namespace srm::c_api {

/// A number somewhere in a struct; its place must stay.
struct Number {
  std::string name;
  void* place;
  double (*read)(const void*);
  bool (*write)(void*, double);  // false where the value cannot be one of its type

  double get() const { return read(place); }
  bool set(double value) const { return write(place, value); }
};

// Kept out of line: inlined into each field, the handling of text was half of a browser's module.
[[gnu::noinline]] inline std::size_t enter(std::string& name, const char* field) {
  const std::size_t before = name.size();
  if (before > 0) name += '.';
  name += field;
  return before;
}
[[gnu::noinline]] inline std::size_t enter(std::string& name, std::size_t j) {
  const std::size_t before = name.size();
  name += '_';
  name += std::to_string(j);
  return before;
}

template <class V>
double read_number(const void* place) {
  return static_cast<double>(*static_cast<const V*>(place));
}
template <class V>
bool write_number(void* place, double to) {
  V trial{};
  if (!put(trial, to)) return false;
  *static_cast<V*>(place) = trial;
  return true;
}
[[gnu::noinline]] inline void add(std::vector<Number>& found, const std::string& name, void* place,
                                  double (*read)(const void*), bool (*write)(void*, double)) {
  found.push_back({name, place, read, write});
}

template <class V>
void numbers(V& value, std::string& name, std::vector<Number>& found);

template <class... Alternative>
void numbers(std::variant<Alternative...>& value, std::string& name, std::vector<Number>& found) {
  std::visit([&](auto& chosen) { numbers(chosen, name, found); }, value);
}

/// Adds the numbers of a value, tables that it only views left out.
template <class V>
void numbers(V& value, std::string& name, std::vector<Number>& found) {
  const auto below = [&](auto& part, auto key) {
    const std::size_t before = enter(name, key);
    numbers(part, name, found);
    name.resize(before);
  };
  if constexpr (Callable<V> || is_view<V>) {
    return;
  } else if constexpr (requires { value.list(name, found); }) {
    value.list(name, found);
  } else if constexpr (Listed<V>) {
    fields_of(value, [&](auto... field) { (below(field.value, field.name), ...); });
  } else if constexpr (Spread<V>) {
    for (std::size_t j = 0; j < value.size(); ++j) below(value[j], j);
  } else {
    add(found, name, &value, read_number<V>, write_number<V>);
  }
}

/// Most values of a table that have names of their own: one for each speed of a guide, not a map.
inline constexpr int short_table = 8;

template <class V>
void viewed_below(Field<V>& field, std::string& name, std::vector<Number>& found);

/// Adds the numbers of short tables that a value views. The memory behind them must belong to the
/// value alone, and not be constant.
template <class V>
void viewed_numbers(V& value, std::string& name, std::vector<Number>& found) {
  if constexpr (is_view<V>) {
    for (int j = 0; value.size <= short_table && j < value.size; ++j) {
      const std::size_t before = enter(name, std::size_t(j));
      numbers(const_cast<typename V::Value&>(value.data[j]), name, found);
      name.resize(before);
    }
  } else if constexpr (requires { value.list_viewed(name, found); }) {
    value.list_viewed(name, found);
  } else if constexpr (Listed<V>) {
    fields_of(value, [&](auto... field) { (viewed_below(field, name, found), ...); });
  }
}

template <class V>
void viewed_below(Field<V>& field, std::string& name, std::vector<Number>& found) {
  if constexpr (Listed<V> || is_view<V> || requires { field.value.list_viewed(name, found); }) {
    const std::size_t before = enter(name, field.name);
    viewed_numbers(field.value, name, found);
    name.resize(before);
  }
}

/// The numbers of a value under the name `of`.
template <class V>
void add_numbers(V& value, const char* of, std::vector<Number>& found) {
  std::string name = of;
  numbers(value, name, found);
}

/// Those of the short tables that it views.
template <class V>
void add_viewed_numbers(V& value, const char* of, std::vector<Number>& found) {
  std::string name = of;
  viewed_numbers(value, name, found);
}

}  // namespace srm::c_api
