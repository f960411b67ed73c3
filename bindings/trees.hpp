// Archives of Python: what export writes C++ from, and numbers by their names.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "shower.hpp"

namespace bound {

namespace nb = nanobind;

/// Numbers in their kind.
inline nb::list listed(const srm::Numbers& place) {
  using enum srm::Numbers::Kind;
  nb::list list;
  for (std::size_t j = 0; j < place.count; ++j) {
    const double value = place.values[j];
    list.append(place.kind == real    ? nb::object(nb::float_(value))
                : place.kind == truth ? nb::object(nb::bool_(value != 0))
                                      : nb::object(nb::int_(static_cast<long long>(value))));
  }
  return list;
}

/// A control as a tree of names and numbers.
///
///   struct   {"type": C++ type, "fields": {name: node, ...}}
///   enum     {"type": C++ type, "value": int}
///   table    {"table": element type, "values": [...]}
///   array    [...];  numbers and truth values as they are
class Tree final : public srm::Archive {
 public:
  void open(const std::string& type) override { open_.push_back({type, {}, {}}); }
  void name(const char* field) override { open_.back().field = field; }
  void close() override {
    nb::dict node;
    node["type"] = open_.back().type;
    node["fields"] = open_.back().fields;
    open_.pop_back();
    put(node);
  }
  void numbers(const srm::Numbers& place) override {
    using enum srm::Numbers::Form;
    nb::list list = listed(place);
    nb::dict node;
    if (place.form == table) {
      node["table"] = place.type;
      node["values"] = list;
    } else if (place.kind == srm::Numbers::Kind::named) {
      node["type"] = place.type;
      node["value"] = list[0];
    } else {
      return put(place.form == one ? nb::object(list[0]) : nb::object(list));
    }
    put(node);
  }

  nb::object made() const { return made_; }

 private:
  struct Open {
    std::string type;
    nb::dict fields;
    std::string field;
  };

  void put(const nb::object& node) {
    if (open_.empty()) {
      made_ = node;
    } else {
      open_.back().fields[open_.back().field.c_str()] = node;
    }
  }

  std::vector<Open> open_;
  nb::object made_;
};

/// The tree of a value.
template <class S>
nb::object tree(const S& value) {
  Tree archive;
  show<S>(&value, archive);
  return archive.made();
}

/// Numbers by their names: a number, a list of an array, a tuple of a table, under NAME|kind the
/// alternative of a variant.
class ByName final : public srm::Archive {
 public:
  nb::dict found;

  void open(const std::string& type) override { place_.open(type); }
  void name(const char* field) override { place_.name(field); }
  void close() override { place_.close(); }
  void choose(std::size_t alternative) override {
    found[(place_.at + "|kind").c_str()] = alternative;
  }
  void numbers(const srm::Numbers& place) override {
    nb::list list = listed(place);
    const bool one = place.form == srm::Numbers::Form::one;
    const bool table = place.form == srm::Numbers::Form::table;
    found[place_.at.c_str()] = one     ? nb::object(list[0])
                               : table ? nb::object(nb::tuple(list))
                                       : nb::object(list);
  }

 private:
  srm::FieldPath place_;
};

}  // namespace bound
