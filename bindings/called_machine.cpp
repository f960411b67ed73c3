#include "called_machine.hpp"

namespace bound {

template <srm::Real T>
CalledMachine<T> called(const AnyMachine& machine, srm::Tables& memory) {
  return std::visit(
      [&]<template <class> class M>(const srm::Held<M<double>>& model) -> CalledMachine<T> {
        M<T> own;
        srm::assign(own, model.value, memory);
        const auto at = [](const void* self, T i, T theta_e) {
          return static_cast<const M<T>*>(self)->at(i, theta_e);
        };
        return {own.N_r, srm::may_couple<M<T>>, memory.keep_one(own), at, &show<M<T>>};
      },
      machine);
}

template CalledMachine<float> called(const AnyMachine&, srm::Tables&);
template CalledMachine<double> called(const AnyMachine&, srm::Tables&);

}  // namespace bound
