// Power converters: what the windings see of the switches, with the drops of switches and diodes.
//
// A bridge sees the legs that are ordered for all phases at once, so that phases may share
// switches. To add one: a struct with the functions of SharedSwitchBridge, and its name in `Bridge`
// at the end of this file. One whose phases share nothing may have those of a single phase too, as
// AsymmetricBridge has: then each phase can take integration steps of its own.
#pragma once

#include <array>
#include <cstddef>
#include <variant>

#include "srm/base/fields.hpp"
#include "srm/base/leg.hpp"

namespace srm {

/// Of N phases.
template <std::size_t N>
using AllLegs = std::array<Leg, N>;
template <std::size_t N>
using PerPhase = std::array<double, N>;

/// What lies between the dc link and a winding of current i, where the currents of all phases add
/// up to i_sum: u = level u_dc - v - R i - R_shared i_sum. Valid for i > 0, and for a magnetized
/// leg at any current.
struct Path {
  double level{}, v{}, R{};  // [1], [V], [ohm]
};
template <std::size_t N>
struct Paths {
  std::array<Path, N> phase{};
  double R_shared{};  // of a device that carries the currents of all phases [ohm]
};

/// On-state voltages: threshold [V] and slope [ohm] of a switch and of a diode.
struct Devices {
  double v_switch{}, R_switch{}, v_diode{}, R_diode{};
  SRM_FIELDS(v_switch, R_switch, v_diode, R_diode)

  /// A path through so many of them.
  Path path(Leg leg, int switches, int diodes) const {
    return {static_cast<double>(leg), switches * v_switch + diodes * v_diode,
            switches * R_switch + diodes * R_diode};
  }
};

/// What the switches have done so far. A switching loss that is linear in current and voltage needs
/// no more than the sums of u_dc i over the instants.
struct Switchings {
  double turn_ons = 0;  // of all switches
  double S_on = 0;      // sum of u_dc i over turn-ons [VA]
  double S_off = 0;     // over turn-offs
  SRM_FIELDS(turn_ons, S_on, S_off)

  /// So many switches turn on (or off where negative) at current i.
  void count(int switches, double u_dc, double i) {
    if (switches == 0) return;
    const double S = switches * u_dc * i;
    if (switches > 0) {
      turn_ons += switches;
      S_on += S;
    } else {
      S_off -= S;
    }
  }
};

/// Two switches and two diodes a phase; no phase is in another's way.
struct AsymmetricBridge {
  static constexpr const char* about = "Two switches and two diodes a phase.";
  Devices device;
  SRM_FIELDS(device)

  static constexpr int n_switches(int n_phases) { return 2 * n_phases; }

  /// The legs that the windings see.
  template <std::size_t N>
  AllLegs<N> legs(const AllLegs<N>& ordered) const {
    return ordered;
  }

  /// Magnetize puts two switches in the path, freewheel one switch and one diode, demagnetize two
  /// diodes.
  Path path(Leg leg) const {
    const int switches = 1 + static_cast<int>(leg);
    return device.path(leg, switches, 2 - switches);
  }

  template <std::size_t N>
  Paths<N> paths(const AllLegs<N>& legs) const {
    Paths<N> p;
    for (std::size_t k = 0; k < N; ++k) p.phase[k] = path(legs[k]);
    return p;
  }

  void count(Switchings& sum, Leg before, Leg after, double u_dc, double i) const {
    sum.count(static_cast<int>(after) - static_cast<int>(before), u_dc, i);
  }

  template <std::size_t N>
  void count(Switchings& sum, const AllLegs<N>& before, const AllLegs<N>& after, double u_dc,
             const PerPhase<N>& i) const {
    for (std::size_t k = 0; k < N; ++k) count(sum, before[k], after[k], u_dc, i[k]);
  }
};

/// The (n + 1)-switch or Miller converter: all phases share one upper switch and one lower diode.
///
/// The upper switch is on while any phase is magnetized. Until it turns off, a phase that is to be
/// demagnetized can only freewheel: currents cannot be commutated independently. T. J. E. Miller,
/// Switched Reluctance Motors and Their Control, Oxford 1993, ch. 6.
struct SharedSwitchBridge {
  static constexpr const char* about = "All phases share one upper switch (Miller converter).";
  Devices device;
  SRM_FIELDS(device)

  static constexpr int n_switches(int n_phases) { return n_phases + 1; }

  template <std::size_t N>
  static bool upper_on(const AllLegs<N>& legs) {
    for (const Leg leg : legs) {
      if (leg == Leg::magnetize) return true;
    }
    return false;
  }

  template <std::size_t N>
  AllLegs<N> legs(const AllLegs<N>& ordered) const {
    AllLegs<N> seen = ordered;
    if (upper_on<N>(ordered)) {
      for (Leg& leg : seen) {
        if (leg == Leg::demagnetize) leg = Leg::freewheel;
      }
    }
    return seen;
  }

  /// The shared switch, or the shared diode while it is off, carries the currents of all phases. A
  /// freewheeling current takes the own diode while the upper switch is on.
  template <std::size_t N>
  Paths<N> paths(const AllLegs<N>& legs) const {
    const bool upper = upper_on<N>(legs);
    Paths<N> p;
    for (std::size_t k = 0; k < N; ++k) {
      const int own = lower_on(legs[k], upper);
      p.phase[k] = device.path(legs[k], own, 1 - own);
      p.phase[k].v += upper ? device.v_switch : device.v_diode;
    }
    p.R_shared = upper ? device.R_switch : device.R_diode;
    return p;
  }

  template <std::size_t N>
  void count(Switchings& sum, const AllLegs<N>& before, const AllLegs<N>& after, double u_dc,
             const PerPhase<N>& i) const {
    const bool was = upper_on<N>(before), is = upper_on<N>(after);
    double through = 0;
    for (std::size_t k = 0; k < N; ++k) {
      sum.count(lower_on(after[k], is) - lower_on(before[k], was), u_dc, i[k]);
      through += i[k];
    }
    sum.count(is - was, u_dc, through);
  }

 private:
  static int lower_on(Leg leg, bool upper) {
    return leg == Leg::magnetize || (leg == Leg::freewheel && !upper) ? 1 : 0;
  }
};

using Bridge = std::variant<AsymmetricBridge, SharedSwitchBridge>;

/// A bridge in which every phase is by itself: it knows the path and the switchings of one leg.
template <class B>
concept PhaseByPhase = requires(const B bridge, Switchings& sum) {
  bridge.path(Leg::freewheel);
  bridge.count(sum, Leg::freewheel, Leg::magnetize, 1.0, 1.0);
};
inline bool is_phase_by_phase(const Bridge& bridge) {
  return std::visit([]<class B>(const B&) { return PhaseByPhase<B>; }, bridge);
}

/// True while the leg carries or can build up current: the diodes block the reverse direction.
constexpr bool conducts(Leg leg, double i) { return i > 0 || leg == Leg::magnetize; }

}  // namespace srm
