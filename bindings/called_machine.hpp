// A machine model behind one call: forms that nobody waits for are compiled once, and not for each
// machine model.
#pragma once

#include "bindings.hpp"
#include "srm/machine/with_pairs.hpp"

namespace bound {

template <srm::Real T>
struct CalledMachine {
  using Scalar = T;

  int N_r;       // rotor poles
  bool couples;  // whether machines of the model may have pairs
  const void* model;
  srm::Magnetics<T> (*call)(const void* model, T i, T theta_e);
  void (*show)(const void* model, srm::Archive&);

  srm::Magnetics<T> at(T i, T theta_e) const { return call(model, i, theta_e); }
  /// A walk comes to the model itself.
  template <class A>
  void walk(A& shower) const {
    show(model, shower.archive);
  }
};

/// Whether machines of a model may have pairs.
template <srm::Machine M>
bool couples(const M&) {
  return srm::may_couple<M>;
}
template <srm::Real T>
bool couples(const CalledMachine<T>& machine) {
  return machine.couples;
}

/// The model in the precision of a controller, kept in the memory.
template <srm::Real T>
CalledMachine<T> called(const AnyMachine& machine, srm::Tables& memory);

/// `use(machine, memory)` with the machine in the precision of a controller, its tables kept in the
/// memory. Forms other than the usual ones are given the call.
template <Forms here, srm::Real T, class Use>
auto with_machine(const AnyMachine& machine, const Use& use) {
  srm::Tables memory;
  if constexpr (here == Forms::other) {
    return use(called<T>(machine, memory), memory);
  } else {
    return std::visit(
        [&]<template <class> class M>(const srm::Held<M<double>>& model) {
          M<T> own;
          srm::assign(own, model.value, memory);
          return use(own, memory);
        },
        machine);
  }
}

/// The name of a type with that of the model itself in the place of the call.
template <srm::Real T>
std::string with_own_name(std::string type, const AnyMachine& machine) {
  const std::string call = type_text<CalledMachine<T>>();
  const std::string own = std::visit(
      []<template <class> class M>(const srm::Held<M<double>>&) { return type_text<M<T>>(); },
      machine);
  for (auto at = type.find(call); at != std::string::npos; at = type.find(call)) {
    type.replace(at, call.size(), own);
  }
  return type;
}

}  // namespace bound
