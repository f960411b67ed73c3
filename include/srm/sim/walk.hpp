// What a parameter is made of, by the field lists: one walk for whoever reads, writes or names it.
#pragma once

#include <cstddef>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "srm/base/fields.hpp"
#include "srm/sim/columns.hpp"
#include "srm/sim/tables.hpp"

namespace srm {

/// A function: no number.
template <class V>
concept Callable = requires(const V& v) {
  v(0.0);
};

/// A table with a memory of its own.
template <class V>
concept Growing = requires(std::remove_const_t<V>& v) {
  v.push_back(0.0);
};

template <class V>
inline constexpr bool is_variant = false;
template <class... Alternative>
inline constexpr bool is_variant<std::variant<Alternative...>> = true;

/// Shows an archive what a value is made of, in the order of the field lists:
///
///   open(value), name(field), close()   a struct, and before each field its name
///   choice(value)                       a variant; the archive walks on into what it holds
///   table(value), array(value)          numbers, as many as there are, or a fixed count
///   number(value), function(value)      what it has come to
template <class A, class V>
[[gnu::cold]] void walk(A& archive, V& value) {
  using Plain = std::remove_const_t<V>;
  if constexpr (requires { value.walk(archive); }) {
    value.walk(archive);
  } else if constexpr (is_variant<Plain>) {
    archive.choice(value);
  } else if constexpr (Callable<V>) {
    archive.function(value);
  } else if constexpr (Listed<V>) {
    archive.open(value);
    fields_of(value, [&](auto... field) {
      ((archive.name(field.name), walk(archive, field.value)), ...);
    });
    archive.close();
  } else if constexpr (is_view<Plain> || Growing<V>) {
    archive.table(value);
  } else if constexpr (Spread<V>) {
    archive.array(value);
  } else {
    archive.number(value);
  }
}

/// Where a walk is: `shaft.J`. Not inlined: the handling of text was half of a browser's module.
class FieldPath {
 public:
  std::string at;

  void open(const auto&) { outer_.push_back(at.size()); }
  [[gnu::noinline]] void close() {
    at.resize(outer_.back());
    outer_.pop_back();
  }
  [[gnu::noinline]] void name(const char* field) {
    at.resize(outer_.empty() ? 0 : outer_.back());
    if (!at.empty()) at += '.';
    at += field;
  }
  void function(const auto&) {}

 private:
  std::vector<std::size_t> outer_;  // lengths of the names around
};

/// Numbers of one place, without their type.
struct Numbers {
  enum class Form { one, array, table };
  enum class Kind { real, whole, truth, named };

  const double* values;
  std::size_t count;
  Form form;
  Kind kind;
  std::string type{};  // C++ of an enumeration, or of the elements of a table
};

/// An archive that is shown values without their types.
class Archive {
 public:
  virtual ~Archive() = default;

  virtual void open(const std::string& type) = 0;
  virtual void name(const char* field) = 0;
  virtual void close() = 0;
  virtual void numbers(const Numbers& place) = 0;
  virtual void choose(std::size_t) {}  // an alternative of a variant, which comes next
  virtual void chosen() {}             // and that was it
  virtual void function() {}
};

}  // namespace srm
