// From the names in a blob to the templates of the core: which kinds a library can hold.
//
// By default all of them. A library for one drive names what it needs before it includes this file:
//   #define SRM_LAWS EdgeMpc
//   #define SRM_MACHINES FluxMap
//   #define SRM_PHASES 4
//   #define SRM_PRECISIONS double
// A law from outside the tree has its header included before, and is named the same way. Not all of
// them need to be there with each other:
//   #define SRM_TOGETHER(law, machine, phases) (phases == 3 || law == "Ditc")
// Nor what stands around a law (blob.hpp):
//   #define SRM_AROUND(around, machine, phases) (around == "frame" || phases == 3)
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <string_view>

#include "srm/c_api/blob.hpp"
#include "srm/c_api/drive_unit.hpp"
#include "srm/control/laws.hpp"
#include "srm/machine/machines.hpp"

#ifndef SRM_LAWS
#define SRM_LAWS SRM_BUILT_IN_LAWS, SRM_LAWS_OF_PAIRS
#endif
#ifndef SRM_MACHINES
#define SRM_MACHINES SRM_BUILT_IN_MACHINES
#endif
#ifndef SRM_PHASES
#define SRM_PHASES 2, 3, 4, 5, 6
#endif
#ifndef SRM_PRECISIONS
#define SRM_PRECISIONS float, double
#endif

#ifndef SRM_TOGETHER
#define SRM_TOGETHER(law, machine, phases) true
#endif
#ifndef SRM_AROUND
#define SRM_AROUND(around, machine, phases) true
#endif

namespace srm::c_api {

/// The name of a template of which S is made: `TorqueSharing` of srm::TorqueSharing<...>.
template <class S>
constexpr std::string_view template_name() {
  std::string_view text = __PRETTY_FUNCTION__;
  text.remove_prefix(text.find("S = ") + 4);
  text = text.substr(0, text.find('<'));
  const auto scope = text.rfind("::");
  return scope == std::string_view::npos ? text : text.substr(scope + 2);
}

/// Whether a law computes with pairs of phases; its name then ends in `OfPairs`.
template <class Law>
constexpr bool of_pairs() {
  return std::string_view(__PRETTY_FUNCTION__).find("WithPairs<") != std::string_view::npos;
}

/// The name of a law: a template of srm::laws.
template <class Law>
struct LawName {
  static constexpr std::string_view end = of_pairs<Law>() ? "OfPairs" : "";
  static constexpr auto letters = [] {
    constexpr std::string_view name = template_name<Law>();
    std::array<char, name.size() + end.size()> all{};
    std::copy(end.begin(), end.end(), std::copy(name.begin(), name.end(), all.begin()));
    return all;
  }();
  static constexpr std::string_view text{letters.data(), letters.size()};
};

struct Made {
  Outcome outcome{SRM_NOT_BUILT};
  std::unique_ptr<Unit> unit{};
};

/// Laws that are looked through for the one of a blob.
template <template <class, int> class... Law>
struct Laws {
  template <class M, int N>
  static std::unique_ptr<LawPart<typename M::Scalar, N>> law(std::string_view name) {
    std::unique_ptr<LawPart<typename M::Scalar, N>> found;
    const auto look = [&]<class One>() {
      if constexpr (together<One, M, N>()) {
        if (LawName<One>::text == name) found = std::make_unique<LawOf<One>>();
      }
    };
    (look.template operator()<Law<M, N>>(), ...);
    return found;
  }

  template <class M, int N>
  static constexpr bool any() {
    return (together<Law<M, N>, M, N>() || ...);
  }

 private:
  template <class One, class M, int N>
  static constexpr bool together() {
    [[maybe_unused]] constexpr std::string_view law = LawName<One>::text;
    [[maybe_unused]] constexpr std::string_view machine = template_name<M>();
    return (may_couple<M> || !of_pairs<One>()) && SRM_TOGETHER(law, machine, N);
  }
};

}  // namespace srm::c_api

namespace srm::laws {

/// Those of this library, from here or from outside the tree.
using Chosen = c_api::Laws<SRM_LAWS>;

}  // namespace srm::laws

namespace srm::c_api {

/// The unit of a blob with this machine model and number of phases.
template <Machine M, int N>
Made made(const Blob& blob, srm_part part, std::unique_ptr<ControlPart<N>> control) {
  LoopParameters<M, N> given{};
  Tables memory;
  Reader reader(blob.parameters, blob.size, memory);
  walk(reader, given);
  reader.name("control");
  control->walk(reader);
  if (reader.hash != blob.layout) return {{SRM_WRONG_VERSION, "fields"}};
  if (!reader.ended()) return {{SRM_NOT_A_BLOB, "numbers"}};
  if (!reader.fault().empty()) return {{SRM_BAD_PARAMETER, reader.fault()}};
  return {{},
          std::make_unique<DriveUnit<M, N>>(std::move(given), std::move(memory), std::move(control),
                                            part, blob.checksum)};
}

/// Whether controls with parameters P are there for a machine.
template <class P, Machine M, int N>
constexpr bool is_built() {
  [[maybe_unused]] constexpr std::string_view around = c_api::around<P>(),
                                              machine = template_name<M>();
  return SRM_AROUND(around, machine, N);
}

template <class L, int N, class T, template <class> class... M>
void find_machine(const Blob& blob, srm_part part, Made& found) {
  const auto look = [&]<class Own, class Plants>() {
    if constexpr (L::template any<Own, N>()) {
      if (template_name<Own>() != blob.machine) return;
      auto law = L::template law<Own, N>(blob.law);
      if (!law) return;
      std::unique_ptr<ControlPart<N>> control;
      const auto look_around = [&]<class P>() {
        if constexpr (is_built<P, Own, N>()) {
          if (around<P>() == blob.around) control = std::make_unique<ControlOf<P>>(std::move(law));
        }
      };
      look_around.template operator()<PointedControl<T, N>>();
      look_around.template operator()<PointedDrive<Own, N>>();
      look_around.template operator()<DiagnosedDrive<Own, N>>();
      if (control) found = made<Plants, N>(blob, part, std::move(control));
    }
  };
  (look.template operator()<M<T>, M<double>>(), ...);
}

template <class L, int N, class... T>
void find_precision(const Blob& blob, srm_part part, Made& found) {
  ((blob.precision == (sizeof(T) == 4 ? "float" : "double")
        ? find_machine<L, N, T, SRM_MACHINES>(blob, part, found)
        : void()),
   ...);
}

template <class L, int... N>
void find_phases(const Blob& blob, srm_part part, Made& found) {
  ((blob.n_phases == N ? find_precision<L, N, SRM_PRECISIONS>(blob, part, found) : void()), ...);
}

inline std::string kind_text(const Blob& blob) {
  return blob.law + ", " + blob.machine + ", " + std::to_string(blob.n_phases) + " phases, " +
         blob.precision + ", " + blob.around;
}

inline Made made(const unsigned char* bytes, std::size_t size, srm_part part) {
  Blob blob;
  if (const srm_status status = parse(bytes, size, blob); status != SRM_OK) return {{status}};
  Made found{{SRM_NOT_BUILT, kind_text(blob)}};
  find_phases<laws::Chosen, SRM_PHASES>(blob, part, found);
  return found;
}

}  // namespace srm::c_api
