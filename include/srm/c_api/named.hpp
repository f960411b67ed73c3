// The numbers of a struct under dotted names: `shaft.J`, `control.law.theta_on`,
// `reference.value_0`.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "srm/c_api/archive.hpp"

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
/// Most values of a table that have names of their own: one for each speed of a guide, not a map.
inline constexpr int short_table = 8;

/// Lists the numbers of a value. Of the tables that it views only short ones are, and where asked
/// for: their memory must belong to the value alone, and not be constant.
class Names : public FieldPath {
 public:
  explicit Names(std::vector<Number>& found, bool viewed = false)
      : found_(found), viewed_(viewed) {}

  void choice(auto& value) {
    std::visit([&](auto& chosen) { walk(*this, chosen); }, value);
  }
  template <class V>
  void table(V& value) {
    if constexpr (!is_view<V>) {
      array(value);
    } else if (viewed_ && value.size <= short_table) {
      for (int j = 0; j < value.size; ++j) {
        element(std::size_t(j), const_cast<typename V::Value&>(value.data[j]));
      }
    }
  }
  void array(auto& value) {
    for (std::size_t j = 0; j < value.size(); ++j) element(j, value[j]);
  }
  template <class V>
  void number(V& value) {
    add(at, &value, read_number<V>, write_number<V>);
  }

 private:
  template <class V>
  void element(std::size_t j, V& value) {
    add(at + '_' + std::to_string(j), &value, read_number<V>, write_number<V>);
  }
  [[gnu::noinline]] void add(std::string name, void* place, double (*read)(const void*),
                             bool (*write)(void*, double)) {
    found_.push_back({std::move(name), place, read, write});
  }

  std::vector<Number>& found_;
  bool viewed_;
};

/// The numbers of a value, tables that it only views left out.
template <class V>
void add_numbers(V& value, std::vector<Number>& found) {
  Names names(found);
  walk(names, value);
}

}  // namespace srm::c_api
