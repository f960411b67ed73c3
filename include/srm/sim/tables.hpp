// Parameters from double to the precision of a control law, with the memory of their tables.
#pragma once

#include <concepts>
#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>
#include <vector>

#include "srm/base/fields.hpp"
#include "srm/base/view.hpp"

namespace srm {

/// A value and the owner of the tables that it views. Copies share them; they never change.
template <class S>
struct Held {
  S value;
  std::shared_ptr<const void> memory;
};

/// Keeps copies of tables for as long as a copy of `owner` lives.
class Tables {
 public:
  template <class V, class Values>
  View<V> keep(const Values& values) {
    auto table = std::make_shared<std::vector<V>>();
    for (const auto& value : values) table->push_back(static_cast<V>(value));
    tables_->push_back(table);
    return {table->data(), static_cast<int>(table->size())};
  }

  /// A copy of a value, which needs no destructor.
  template <class S>
  const S* keep_one(const S& value) {
    static_assert(std::is_trivially_destructible_v<S> && alignof(S) <= alignof(std::max_align_t));
    return ::new (room(sizeof(S))) S(value);
  }

  std::shared_ptr<const void> owner() const { return tables_; }

 private:
  void* room(std::size_t bytes) {
    const std::size_t n = (bytes + sizeof(std::max_align_t) - 1) / sizeof(std::max_align_t);
    auto table = std::make_shared<std::vector<std::max_align_t>>(n);
    tables_->push_back(table);
    return table->data();
  }

  std::shared_ptr<std::vector<std::shared_ptr<const void>>> tables_ =
      std::make_shared<std::vector<std::shared_ptr<const void>>>();
};

/// For structs without tables.
struct NoTables {};

template <class V>
inline constexpr bool is_view = false;
template <class V>
inline constexpr bool is_view<View<V>> = true;

/// `to` becomes `from` in its own precision, field by field. Tables are copied into `memory`.
template <class To, class From, class Keep = NoTables>
constexpr void assign(To& to, const From& from, Keep&& memory = {}) {
  if constexpr (std::same_as<To, From> && std::same_as<std::remove_cvref_t<Keep>, NoTables>) {
    to = from;
  } else if constexpr (requires { from.memory; }) {
    assign(to, from.value, memory);
  } else if constexpr (Listed<To>) {
    fields_of(to, [&](auto... target) {
      fields_of(from, [&](auto... source) { (assign(target.value, source.value, memory), ...); });
    });
  } else if constexpr (is_view<To>) {
    to = memory.template keep<typename To::Value>(from);
  } else if constexpr (requires { to[0]; }) {
    for (std::size_t j = 0; j < to.size(); ++j) assign(to[j], from[j], memory);
  } else {
    to = static_cast<To>(from);
  }
}

}  // namespace srm
