// A controller as a tree of names and numbers (describe.hpp).
#pragma once

#include "bindings.hpp"
#include "called_machine.hpp"
#include "describe.hpp"
#include "srm/control/frame/frame.hpp"

namespace bound {

/// A DriveControl as a tree, with the law itself and not the call that stands for it on the desk.
template <class T>
nb::object described_control(const nb::dict& law, const srm::Frame<T>& frame) {
  nb::dict node, fields;
  fields["law"] = law;
  fields["frame"] = described(frame);
  node["type"] = nb::str(("srm::DriveControl<" + nb::cast<std::string>(law["type"]) + ">").c_str());
  node["fields"] = fields;
  return node;
}

/// The machine model of a law in its precision.
template <class T>
nb::object described_machine(const AnyMachine& machine) {
  return std::visit(
      []<template <class> class M>(const srm::Held<M<double>>& model) {
        srm::Tables memory;
        M<T> own;
        srm::assign(own, model.value, memory);
        return described(own);
      },
      machine);
}

/// Both, as far as they are known of a law.
template <class T>
nb::dict described_controller(const AnyLaw& law, const srm::Frame<T>& frame) {
  nb::dict tree;
  const nb::object made = with_own_name<T>(law.describe(law.made.get()), law.machine);
  tree["control"] = described_control(nb::cast<nb::dict>(made), frame);
  tree["machine"] = described_machine<T>(law.machine);
  return tree;
}

}  // namespace bound
