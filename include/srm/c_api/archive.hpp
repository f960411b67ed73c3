// Parameters of a drive as a flat list of doubles: written field by field, and checked as they are
// read.
//
// The list holds the numbers in the order of the field lists (sim/walk.hpp). A table is its length
// and its values, a variant the index of its alternative and its fields. Reader and writer hash the
// names that they come to, so a blob of another version of any struct is told apart.
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

#include "srm/sim/walk.hpp"

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

/// Where a walk is, and the hash of all that it came to.
class Layout : public FieldPath {
 public:
  std::uint64_t hash = hash_start;

  void mark(std::string_view what) { hash = hashed(hash, what); }
  void open(const auto& value) {
    mark("(");
    FieldPath::open(value);
  }
  void close() {
    mark(")");
    FieldPath::close();
  }
  void name(const char* field) {
    mark(field);
    mark(" ");
    FieldPath::name(field);
  }
  void function(const auto&) { mark("!"); }
};

/// Bytes of doubles, read one by one. A fault is kept, and zeros follow. Tables go to the memory.
class Reader : public Layout {
 public:
  Reader(const unsigned char* bytes, std::size_t size, Tables& memory)
      : at_(bytes), left_(size / 8), memory_(memory) {}

  template <class... Alternative>
  void choice(std::variant<Alternative...>& value) {
    mark("<");
    const double index = next();
    std::size_t j = 0;
    const bool found =
        ((index == static_cast<double>(j++)
              ? (value = Alternative{}, walk(*this, std::get<Alternative>(value)), true)
              : false) ||
         ...);
    if (!found) faulty();
    mark(">");
  }

  template <class V>
  void table(V& value) {
    mark("[]");
    if constexpr (is_view<V>) {
      std::vector<typename V::Value> table(length());
      for (auto& element : table) number(element);
      value = memory_.keep<typename V::Value>(table);
    } else {
      value.resize(length());
      for (auto& element : value) number(element);
    }
  }

  void array(auto& values) {
    mark("{}");
    for (auto& element : values) number(element);
  }

  void number(auto& value) {
    if (!put(value, next())) faulty();
  }

  bool ended() const { return left_ == 0 && !short_; }
  /// The name of the first field whose number cannot be one; empty where all can.
  const std::string& fault() const { return fault_; }

 private:
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
    if (fault_.empty()) fault_ = at.empty() ? "?" : at;
  }

  const unsigned char* at_;
  std::size_t left_;
  Tables& memory_;
  bool short_ = false;
  std::string fault_;
};

/// The list of doubles that a reader reads.
class Writer final : public Archive {
 public:
  Layout layout;
  std::vector<double> list;

  void open(const std::string& type) override { layout.open(type); }
  void name(const char* field) override { layout.name(field); }
  void close() override { layout.close(); }
  void numbers(const Numbers& place) override {
    using enum Numbers::Form;
    if (place.form == array) layout.mark("{}");
    if (place.form == table) {
      layout.mark("[]");
      list.push_back(static_cast<double>(place.count));
    }
    list.insert(list.end(), place.values, place.values + place.count);
  }
  void choose(std::size_t alternative) override {
    layout.mark("<");
    list.push_back(static_cast<double>(alternative));
  }
  void chosen() override { layout.mark(">"); }
  void function() override { layout.function(0); }
};

}  // namespace srm::c_api
