// Parameters of a drive from a flat list of doubles, field by field, checked as they are read.
//
// The list holds the numbers in the order of the field lists (base/fields.hpp). A table is its
// length and its values, a variant the index of its alternative and its fields. While reading, the
// names that were visited are hashed: the writer hashes the same names, so a blob of another
// version of any struct is told apart (python/reluctance/targets/export/blob.py writes).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "srm/base/fields.hpp"
#include "srm/sim/columns.hpp"
#include "srm/sim/tables.hpp"

namespace srm::c_api {

/// FNV-1a over bytes.
constexpr std::uint64_t hash_start = 14695981039346656037u;
constexpr std::uint64_t hashed(std::uint64_t hash, std::string_view bytes) {
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  return hash;
}

/// True where the compiler has a name for a value of an enumeration: `srm::Leg::magnetize`, and not
/// `(srm::Leg)7`.
template <auto value>
constexpr bool is_named() {
  const std::string_view text = __PRETTY_FUNCTION__;
  return text[text.find("value = ") + 8] != '(';
}
template <class E>
bool is_named(int value) {
  return [&]<int... v>(std::integer_sequence<int, v...>) {
    return ((value == v - 1 && is_named<static_cast<E>(v - 1)>()) || ...);
  }
  (std::make_integer_sequence<int, 10>{});  // -1 to 8: all enumerations of the core
}

/// A number of whatever type from a double; false where it cannot be one.
template <class V>
bool put(V& to, double value) {
  if constexpr (std::is_same_v<V, bool>) {
    if (value != 0 && value != 1) return false;
    to = value == 1;
  } else if constexpr (std::is_enum_v<V> || std::is_integral_v<V>) {
    if (!(std::fabs(value) < 2147483648.0) || value != std::trunc(value)) return false;
    const int whole = static_cast<int>(value);
    if constexpr (std::is_enum_v<V>) {
      if (!is_named<V>(whole)) return false;
    } else if (static_cast<int>(static_cast<V>(whole)) != whole) {
      return false;
    }
    to = static_cast<V>(whole);
  } else {
    to = static_cast<V>(value);
    return to - to == V(0);  // finite, also as a float
  }
  return true;
}

/// A function: no number.
template <class V>
concept Callable = requires(const V& v) {
  v(0.0);
};

/// Bytes of doubles, read one by one. A fault is kept, and zeros follow.
class Reader {
 public:
  Reader(const unsigned char* bytes, std::size_t size) : at_(bytes), left_(size / 8) {}

  template <class V>
  void read(V& value, Tables& memory) {
    if constexpr (Callable<V>) {
      visit("!");
    } else if constexpr (requires { value.read(*this, memory); }) {
      value.read(*this, memory);
    } else if constexpr (Listed<V>) {
      visit("(");
      fields_of(value, [&](auto... field) { (named(field, memory), ...); });
      visit(")");
    } else if constexpr (is_view<V>) {
      visit("[]");
      std::vector<typename V::Value> table(length());
      for (auto& element : table) number(element);
      value = memory.keep<typename V::Value>(table);
    } else if constexpr (requires { value.push_back(0.0); }) {
      visit("[]");
      value.resize(length());
      for (auto& element : value) number(element);
    } else if constexpr (Spread<V>) {
      visit("{");
      for (auto& element : value) number(element);
      visit("}");
    } else {
      number(value);
    }
  }

  template <class... Alternative>
  void read(std::variant<Alternative...>& value, Tables& memory) {
    visit("<");
    const double index = next();
    std::size_t j = 0;
    const bool found =
        ((index == static_cast<double>(j++)
              ? (value = Alternative{}, read(std::get<Alternative>(value), memory), true)
              : false) ||
         ...);
    if (!found) faulty();
    visit(">");
  }

  /// Names are hashed as they are visited.
  void visit(std::string_view what) { layout_ = hashed(layout_, what); }

  bool ended() const { return left_ == 0 && !short_; }
  std::uint64_t layout() const { return layout_; }
  /// The name of the first field whose number cannot be one; empty where all can.
  const std::string& fault() const { return fault_; }

 private:
  template <class V>
  void named(Field<V>& field, Tables& memory) {
    visit(field.name);
    visit(" ");
    const std::string outer = name_;
    name_ += name_.empty() ? field.name : std::string(".") + field.name;
    read(field.value, memory);
    name_ = outer;
  }

  double next() {
    double value = 0;
    if (left_ == 0) {
      short_ = true;
      return value;
    }
    std::memcpy(&value, at_, 8);
    at_ += 8;
    --left_;
    return value;
  }

  template <class V>
  void number(V& value) {
    if (!put(value, next())) faulty();
  }

  /// Of a table: no more than what is left can hold.
  std::size_t length() {
    const double n = next();
    if (n >= 0 && n <= static_cast<double>(left_) && n == std::trunc(n)) {
      return static_cast<std::size_t>(n);
    }
    faulty();
    return 0;
  }

  void faulty() {
    if (fault_.empty()) fault_ = name_.empty() ? "?" : name_;
  }

  const unsigned char* at_;
  std::size_t left_;
  bool short_ = false;
  std::uint64_t layout_ = hash_start;
  std::string name_, fault_;
};

}  // namespace srm::c_api
