// A struct lists its fields once, beside itself. Python arguments, change of precision, export
// constants and column names read that list and no other.
//
//   struct SpeedPi {
//     T K_p;  // [N m s/rad]
//     T K_i;  // [N m/rad]
//     SRM_FIELDS(K_p, K_i)
//   };
//
// The list must name every member in its order: `fields_of` refuses to compile where one is
// missing.
#pragma once

#include <utility>

namespace srm {

/// One field: its name everywhere, and the value in one object.
template <class V>
struct Field {
  const char* name;
  V& value;
};
template <class V>
Field(const char*, V&) -> Field<V>;

/// A struct with a field list.
template <class S>
concept Listed = requires(S& s) {
  S::fields(s, [](auto...) {});
};

namespace detail {

struct Anything {  // converts to the type of any member
  template <class V>
  constexpr operator V() const;
};

// Release 14 of clang-format does not know how to lay out a conjunction of requirements.
// clang-format off
/// S takes these values in braces, and not one more: they are all of its members.
template <class S, class... V>
concept MadeOf = requires { S{std::declval<V>()...}; } &&
                 !requires(Anything more) { S{std::declval<V>()..., more}; };
// clang-format on

}  // namespace detail

/// Calls use(Field...) with all fields of s, in their order. S may be const.
template <class S, class F>
constexpr decltype(auto) fields_of(S& s, F&& use) {
  return S::fields(s, [&]<class... V>(Field<V>... field) -> decltype(auto) {
    static_assert(detail::MadeOf<std::remove_const_t<S>, std::remove_const_t<V>...>,
                  "SRM_FIELDS must list every member of the struct, in its order");
    return use(field...);
  });
}

}  // namespace srm

// The preprocessor walks a list by rescanning: 3^4 = 81 passes, so a struct has at most 81 fields.
#define SRM_RESCAN(...) SRM_RESCAN3(SRM_RESCAN3(SRM_RESCAN3(__VA_ARGS__)))
#define SRM_RESCAN3(...) SRM_RESCAN2(SRM_RESCAN2(SRM_RESCAN2(__VA_ARGS__)))
#define SRM_RESCAN2(...) SRM_RESCAN1(SRM_RESCAN1(SRM_RESCAN1(__VA_ARGS__)))
#define SRM_RESCAN1(...) SRM_RESCAN0(SRM_RESCAN0(SRM_RESCAN0(__VA_ARGS__)))
#define SRM_RESCAN0(...) __VA_ARGS__
#define SRM_PARENTHESES ()
#define SRM_EACH_FIELD(name, ...) \
  ::srm::Field{#name, self.name} __VA_OPT__(, SRM_EACH_AGAIN SRM_PARENTHESES(__VA_ARGS__))
#define SRM_EACH_AGAIN() SRM_EACH_FIELD

#define SRM_FIELDS(...)                                             \
  static constexpr decltype(auto) fields(auto& self, auto&& list) { \
    return list(SRM_RESCAN(SRM_EACH_FIELD(__VA_ARGS__)));           \
  }
