// A machine model behind one call: forms that nobody waits for are compiled once, and not for each
// machine model.
#pragma once

#include "bindings.hpp"
#include "describe.hpp"

namespace bound {

template <srm::Real T>
struct CalledMachine {
  using Scalar = T;

  int N_r;  // rotor poles
  const void* model;
  srm::Magnetics<T> (*call)(const void* model, T i, T theta_e);
  nb::object (*tree)(const void* model);

  srm::Magnetics<T> at(T i, T theta_e) const { return call(model, i, theta_e); }
  nb::object described() const { return tree(model); }
};

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

/// `tree` with the name of the model itself for that of the call in all types.
template <srm::Real T>
nb::object with_own_name(const nb::object& tree, const AnyMachine& machine) {
  return std::visit(
      [&]<template <class> class M>(const srm::Held<M<double>>&) {
        return renamed(tree, type_text<CalledMachine<T>>(), type_text<M<T>>());
      },
      machine);
}

}  // namespace bound
