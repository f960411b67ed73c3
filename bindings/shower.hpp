// A value of the core as it leaves Python: shown to an archive, with the C++ names of its types.
//
// What is shown is the very object that runs on the desk, by the field list of each struct, so
// export has no list of parameters of its own. The target's source uses designated initialisers, so
// a wrong name or order does not compile there.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "srm/control/frame/drive_control.hpp"
#include "srm/control/law/paper_mpc.hpp"
#include "srm/sim/called_law.hpp"
#include "srm/sim/walk.hpp"

namespace bound {

/// From the compiler's own text: "... [with S = NAME; ...]".
inline std::string name_in(const std::string& text) {
  const auto from = text.find("S = ") + 4;
  return text.substr(from, text.find_first_of(";]", from) - from);
}

/// The name of a type as C++ source.
template <class S>
[[gnu::cold]] std::string type_text() {
  return name_in(__PRETTY_FUNCTION__);
}

template <class S>
std::string type_name(const S&) {
  return type_text<S>();
}

/// The target's capacities are what the parameters use: N_p and N_c themselves.
template <class M, int N, int Np_max, int Nc_max>
std::string type_name(const srm::PaperMpc<M, N, Np_max, Nc_max>& law) {
  return "srm::PaperMpc<" + type_text<M>() + ", " + std::to_string(N) + ", " +
         std::to_string(law.N_p) + ", " + std::to_string(law.N_c) + ">";
}

/// A law behind a call, as it is: without a `show` it has no form outside Python.
struct ShownLaw {
  std::shared_ptr<const void> made{};
  void (*show)(const void* made, srm::Archive&) = nullptr;
  std::string type{};
};

/// Shows an archive what a walk comes to; in the place of a call the law itself.
class Shower {
 public:
  explicit Shower(srm::Archive& to, const ShownLaw* law = nullptr) : archive(to), law_(law) {}

  srm::Archive& archive;

  template <class S>
  void open(const S& value) {
    archive.open(type_name(value));
  }
  template <srm::Real T, int N>
  void open(const srm::DriveControl<srm::CalledLaw<T, N>>&) {
    archive.open("srm::DriveControl<" + law_->type + ">");
  }
  void name(const char* field) { archive.name(field); }
  void close() { archive.close(); }

  template <class V>
  void choice(const V& value) {
    archive.choose(value.index());
    std::visit([&](const auto& chosen) { srm::walk(*this, chosen); }, value);
    archive.chosen();
  }
  void table(const auto& values) {
    using Value = std::remove_cvref_t<decltype(*values.begin())>;
    const bool byte = std::is_same_v<Value, std::uint8_t>;
    all(values, Form::table, byte ? "std::uint8_t" : type_text<Value>());
  }
  void array(const auto& values) { all(values, Form::array, {}); }
  template <class V>
  void number(const V& value) {
    const double number = static_cast<double>(value);
    archive.numbers({&number, 1, Form::one, kind<V>, std::is_enum_v<V> ? type_text<V>() : ""});
  }
  template <srm::Real T, int N>
  void number(const srm::CalledLaw<T, N>&) {
    law_->show(law_->made.get(), archive);
  }
  template <class V>
  void function(const V& value) {
    if (value) throw std::invalid_argument("a load given as a function cannot leave Python");
    archive.function();
  }

 private:
  using Form = srm::Numbers::Form;
  using Kind = srm::Numbers::Kind;

  template <class V>
  static constexpr Kind kind = std::is_same_v<V, bool> ? Kind::truth
                               : std::is_enum_v<V>     ? Kind::named
                               : std::is_integral_v<V> ? Kind::whole
                                                       : Kind::real;

  void all(const auto& values, Form form, std::string type) {
    const std::vector<double> list(values.begin(), values.end());
    using Value = std::remove_cvref_t<decltype(*values.begin())>;
    archive.numbers({list.data(), list.size(), form, kind<Value>, std::move(type)});
  }

  const ShownLaw* law_;
};

/// Shows an archive a value of which only the place is known.
template <class S>
[[gnu::cold]] void show(const void* at, srm::Archive& archive) {
  Shower shower(archive);
  srm::walk(shower, *static_cast<const S*>(at));
}

}  // namespace bound
