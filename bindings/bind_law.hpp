// A law from Python: its parameters by its field list (base/fields.hpp).
#pragma once

#include <tuple>

#include "bindings.hpp"
#include "called_machine.hpp"
#include "other_forms.hpp"
#include "srm/control/part/reference_profile.hpp"

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
struct Given<srm::ReferenceProfile<T>> {
  using type = srm::Held<srm::ReferenceProfile<double>>;
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

/// The law of a precision and number of phases.
template <Forms here, srm::Real T, int N, class Make>
[[gnu::cold]] AnyLaw law_of(const AnyMachine& machine, const Make& make) {
  return with_machine<here, T>(machine, [&]<class M>(const M& own, srm::Tables& memory) -> AnyLaw {
    const auto* const law = memory.keep_one(make.template operator()<T, N>(own, memory));
    using Law = std::remove_cvref_t<decltype(*law)>;
    const std::shared_ptr<const Law> held(memory.owner(), law);
    return {AnyLaw::Any<T>(srm::called(held)),
            {held, &show<Law>, with_own_name<T>(type_name(*law), machine)},
            machine};
  });
}

/// Makes a law that Python can hold.
template <class Make>
using MakesLaw = AnyLaw(const AnyMachine&, int n_phases, bool single, const Make&);

/// `make.template operator()<T, N>(machine, memory)` returns the law as it is. Where its form is
/// not here, `others` is asked.
template <Forms here, class Make, class Others>
AnyLaw any_law(const AnyMachine& machine, int n_phases, bool single, const Make& make,
               const Others& others) {
  const auto of = [&]<class T>() {
    return with_phases(n_phases, [&]<int N>() -> AnyLaw {
      if constexpr (has_form_of<here, Make::seldom, T, N>) {
        return law_of<here, T, N>(machine, make);
      } else {
        return others()(machine, n_phases, single, make);
      }
    });
  };
  return single ? of.template operator()<float>() : of.template operator()<double>();
}

/// What Python gives for the fields of a law, the machine left out.
template <template <class, int> class Law, class = std::make_index_sequence<given_fields<Law>>>
struct GivenFields;
template <template <class, int> class Law, std::size_t... n>
struct GivenFields<Law, std::index_sequence<n...>> {
  std::tuple<const GivenField<Law, n>&...> value;

  /// Makes the law.
  template <class T, int N, class M>
  Law<M, N> operator()(const M& machine, srm::Tables& memory) const {
    return filled<Law, N>(machine, memory, std::get<n>(value)...);
  }
};

/// Python's function that makes a law: the machine model as the control believes it, the number of
/// phases, whether in single precision, then what `more` names, and the fields of the law but its
/// machine. Make is made of the same.
template <template <class, int> class Law, Forms here, class Make, class... More>
void bind_made(nb::module_& m, const char* name, const char* doc,
               const std::array<const char*, sizeof...(More)>& more, const Place& place) {
  const auto others = [=] { return other_form<MakesLaw<Make>>(name, place.file_name()); };
  if constexpr (here == Forms::other) {
    const auto made = [](const AnyMachine& model, int n_phases, bool single, const Make& make) {
      return any_law<here>(model, n_phases, single, make,
                           []() -> MakesLaw<Make>* { return nullptr; });
    };
    add_other_form<MakesLaw<Make>>(name, made);
  } else {
    Sample<Law> sample{};
    const auto list = field_list(sample);
    [&]<std::size_t... j, std::size_t... n>(std::index_sequence<j...>, std::index_sequence<n...>) {
      m.def(
          name,
          [others](const AnyMachine& model, int n_phases, bool single, const More&... given,
                   const GivenField<Law, n>&... value) {
            return any_law<here>(model, n_phases, single, Make{given..., {{value...}}}, others);
          },
          nb::arg("machine"), nb::arg("n_phases"), nb::arg("single"), nb::kw_only(),
          nb::arg(more[j])..., nb::arg(std::get<n + has_machine<Law>>(list).name)..., doc);
    }
    (std::index_sequence_for<More...>(), std::make_index_sequence<given_fields<Law>>());
  }
}

template <template <class, int> class Law>
struct GivenAlone {
  static constexpr bool seldom = false;  // forms.hpp

  GivenFields<Law> law;

  /// Makes the law.
  template <class T, int N, class M>
  auto operator()(const M& machine, srm::Tables& memory) const {
    return law.template operator()<T, N>(machine, memory);
  }
};

template <template <class, int> class Law, Forms here = forms_here>
void bind_law(nb::module_& m, const char* name, const char* doc,
              const Place& place = Place::current()) {
  bind_made<Law, here, GivenAlone<Law>>(m, name, doc, {}, place);
}

}  // namespace bound
