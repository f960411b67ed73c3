// A law from Python: its parameters by its field list (base/fields.hpp).
#pragma once

#include <tuple>

#include "bindings.hpp"
#include "describe.hpp"
#include "srm/control/part/guide.hpp"

namespace bound {

/// What Python gives for a field of type V.
template <class V>
struct Given {
  using type = V;  // int, enum, struct in double
};
template <>
struct Given<float> {
  using type = double;
};
template <class V, std::size_t n>
struct Given<std::array<V, n>> {
  using type = std::array<double, n>;
};
template <class V>
struct Given<srm::View<V>> {
  using type = std::vector<double>;
};
template <srm::Real T, template <class> class S>
struct Given<S<T>> {
  using type = S<double>;
};
template <srm::Real T>
struct Given<srm::Guide<T>> {
  using type = srm::Held<srm::Guide<double>>;
};

/// The fields of a default S as a tuple of Field: their names and types.
template <class S>
auto field_list(S& s) {
  return srm::fields_of(s, [](auto... field) { return std::tuple(field...); });
}

/// Any instance of a law: all have the same fields.
template <template <class, int> class Law>
using Sample = Law<srm::LeHuy<double>, 2>;

/// 1 where the first field of a law is its machine, which is the setting's; else 0.
template <template <class, int> class Law>
inline constexpr std::size_t has_machine = requires(Sample<Law> law) {
  law.machine;
}
? 1 : 0;

/// What Python gives for field n of a law, the machine left out.
template <template <class, int> class Law, std::size_t n>
using GivenField = typename Given<std::remove_reference_t<
    decltype(std::tuple_element_t<n + has_machine<Law>,
                                  decltype(field_list(std::declval<Sample<Law>&>()))>::value)>>::
    type;

/// The number of fields that Python gives for a law.
template <template <class, int> class Law>
inline constexpr std::size_t given_fields =
    std::tuple_size_v<decltype(field_list(std::declval<Sample<Law>&>()))> - has_machine<Law>;

/// The law from a machine and what Python gives for its other fields.
template <template <class, int> class Law, int N, class M, class... Value>
Law<M, N> filled(const M& machine, srm::Tables& tables, const Value&... value) {
  Law<M, N> law{};
  if constexpr (has_machine<Law> == 1) law.machine = machine;
  const auto fields = field_list(law);
  [&]<std::size_t... n>(std::index_sequence<n...>) {
    (srm::assign(std::get<n + has_machine<Law>>(fields).value, value, tables), ...);
  }
  (std::index_sequence_for<Value...>());
  if constexpr (requires { law.is_consistent(); }) {
    if (!law.is_consistent()) throw std::invalid_argument("need a value for each speed");
  }
  return law;
}

/// The law of a precision, number of phases and machine model.
template <srm::Real T, int N, template <class> class M, class Make>
[[gnu::cold]] AnyLaw kept_law(const srm::Held<M<double>>& model, const Make& make) {
  using Law = decltype(make.template operator()<T, N>(std::declval<const M<T>&>(),
                                                      std::declval<srm::Tables&>()));
  srm::Tables tables;
  M<T> own;
  srm::assign(own, model.value, tables);
  const Law* const law = tables.keep_one(make.template operator()<T, N>(own, tables));
  const std::shared_ptr<const Law> held(tables.owner(), law);
  return {AnyLaw::Any<T>(srm::called(held)), held, &described_field<Law>, model};
}

/// A law that Python can hold. `make.template operator()<T, N>(machine, memory)` returns the law as
/// it is; its tables are kept in the memory.
template <class Make>
AnyLaw any_law(const AnyMachine& machine, int n_phases, bool single, const Make& make) {
  return std::visit(
      [&]<template <class> class M>(const srm::Held<M<double>>& model) {
        return with_phases(n_phases, [&]<int N>() {
          return single ? kept_law<float, N>(model, make) : kept_law<double, N>(model, make);
        });
      },
      machine);
}

/// Python's function that makes a law: the machine model as the control believes it, the number of
/// phases, whether in single precision, then the fields of the law but its machine.
template <template <class, int> class Law>
void bind_law(nb::module_& m, const char* name, const char* doc) {
  Sample<Law> sample{};
  const auto list = field_list(sample);
  [&]<std::size_t... n>(std::index_sequence<n...>) {
    m.def(
        name,
        [](const AnyMachine& model, int n_phases, bool single, const GivenField<Law, n>&... value) {
          return any_law(model, n_phases, single,
                         [&]<class T, int N, class M>(const M& machine, srm::Tables& tables) {
                           return filled<Law, N>(machine, tables, value...);
                         });
        },
        nb::arg("machine"), nb::arg("n_phases"), nb::arg("single"), nb::kw_only(),
        nb::arg(std::get<n + has_machine<Law>>(list).name)..., doc);
  }
  (std::make_index_sequence<given_fields<Law>>());
}

}  // namespace bound
