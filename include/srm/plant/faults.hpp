// What breaks in a drive: the list of faults, and what each makes of the plant.
//
// Every fault that is present changes a `Condition`, and the loop reads nothing else. The switches
// stand in a leg each: the upper one chops, the lower one carries a freewheeling current. Faults of
// the power stage are those of the asymmetric bridge.
//
// Shorted turns. A part s of the turns is bridged by R_f. With perfect coupling the machine sees
// the mean current i of all turns, psi' = u - R i as in good health, and the terminals carry in
// addition u/R_t with R_t = (R_f + s (1 - s) R)/s^2: the fault is a resistance across the winding.
// (From u = (1 - s)(R i_1 + psi') + v, v = s (R i_2 + psi') = R_f (i_1 - i_2), i = (1 - s) i_1 + s
// i_2.) Once the diodes block, the mean current decays through R_t.
//
// Open wire. The current ends in an arc of u_arc; no voltage can bring it back.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "srm/base/fields.hpp"
#include "srm/plant/bridge.hpp"

namespace srm {

/// The list: name and meaning. Python has the same names, with the keys of each.
#define SRM_BROKEN(X)                                                                  \
  X(open_wire, "a wire of the winding is open")                                        \
  X(upper_open, "the upper switch stays off")                                          \
  X(lower_open, "the lower switch stays off")                                          \
  X(upper_shorted, "the upper switch stays on")                                        \
  X(lower_shorted, "the lower switch stays on")                                        \
  X(diode_shorted, "the lower diode conducts both ways, with R")                       \
  X(turns_shorted, "a part of the turns is bridged by R")                              \
  X(winding_to_ground, "the upper end of the winding is at the negative rail, with R") \
  X(poor_contact, "R is in series with the winding")                                   \
  X(sensor_gain, "a current channel shows a multiple")                                 \
  X(sensor_offset, "a current channel shows too much")                                 \
  X(sensor_stuck, "a current channel stays at what it showed")                         \
  X(sensor_dead, "a current channel shows zero")                                       \
  X(encoder_off, "the angle is shown off: a jump, or a wrong zero")                    \
  X(encoder_frozen, "the angle stays at what it showed")                               \
  X(encoder_lost_counts, "a part of the counts is lost")                               \
  X(encoder_reversed, "the angle is shown in the other direction")                     \
  X(power_exchanged, "two phases drive each other's windings")                         \
  X(sensors_exchanged, "two phases show each other's currents")

enum class Broken : std::int8_t {
#define SRM_ONE(name, about) name,
  SRM_BROKEN(SRM_ONE)
#undef SRM_ONE
};

/// In a run.
inline constexpr int most_faults = 8;

inline constexpr double never_ends = std::numeric_limits<double>::infinity();

/// One fault, and when it is present.
struct BrokenPart {
  Broken kind{};
  int phase{}, other{};  // of winding, leg or channel; the second of two exchanged
  double value{};        // gain, offset [A], angle [rad, mechanical], part of turns or counts
  double R{};            // [ohm]
  double start{}, end = never_ends;  // [s]
  double theta_e = -1;  // it begins where its phase next passes this angle [rad]; < 0: at once
  SRM_FIELDS(kind, phase, other, value, R, start, end, theta_e)
};

/// A quantity as another one shows it.
struct Line {
  double slope = 1, offset = 0;

  double at(double x) const { return slope * x + offset; }
  /// Where x is shown; nowhere with a slope of 0.
  double inverse(double shown) const { return (shown - offset) / slope; }
  /// This one, seen through another.
  Line then(const Line& next) const { return {next.slope * slope, next.at(offset)}; }
};

enum class Switch : std::int8_t { works, open, shorted };

/// What has become of one phase.
struct BrokenPhase {
  Switch upper{}, lower{};
  bool open = false;         // its wire
  double G_turns{};          // across the winding [S]
  double G_link{};           // across the dc link while the upper switch is on [S]
  double G_ground{};         // the part of it that the current channel sees
  double R_contact{};        // in series with the winding [ohm]
  Line channel;              // of the current
  int ordered{}, watched{};  // whose orders drive this winding; whose current its gate compares

  bool upper_on(Leg ordered_leg) const { return on(upper, ordered_leg == Leg::magnetize); }

  /// The leg that the switches make of an ordered one.
  Leg leg(Leg ordered_leg) const {
    if (open) return Leg::demagnetize;
    const bool low = on(lower, ordered_leg != Leg::demagnetize);
    return static_cast<Leg>(upper_on(ordered_leg) + low - 1);
  }

 private:
  static bool on(Switch part, bool is_ordered) {
    return part == Switch::works ? is_ordered : part == Switch::shorted;
  }
};

/// What has become of the drive.
template <int N>
struct Condition {
  std::array<BrokenPhase, N> phase;
  std::array<int, N> channel;  // whose current each channel shows
  Line rotor;                  // of the angle, mechanical [rad]
  bool sound = true;           // nothing is broken
  bool leaks = false;          // current flows past a winding
  bool crossed = false;        // a comparator watches another winding than its own

  Condition() {
    for (int k = 0; k < N; ++k) phase[k].ordered = phase[k].watched = channel[k] = k;
  }

  /// One fault more. R_winding: of a phase [ohm]; kept: what the sensor showed when it began.
  void add(const BrokenPart& part, double R_winding, double kept) {
    BrokenPhase& p = phase[part.phase];
    const double s = part.value;
    sound = false;
    switch (part.kind) {
      case Broken::open_wire:
        p.open = true;
        break;
      case Broken::upper_open:
        p.upper = Switch::open;
        break;
      case Broken::lower_open:
        p.lower = Switch::open;
        break;
      case Broken::upper_shorted:
        p.upper = Switch::shorted;
        break;
      case Broken::lower_shorted:
        p.lower = Switch::shorted;
        break;
      case Broken::turns_shorted:
        p.G_turns += s * s / (part.R + s * (1 - s) * R_winding);
        break;
      case Broken::diode_shorted:
        p.G_link += 1 / part.R;
        break;
      case Broken::winding_to_ground:
        p.G_link += 1 / part.R;
        p.G_ground += 1 / part.R;
        break;
      case Broken::poor_contact:
        p.R_contact += part.R;
        break;
      case Broken::sensor_gain:
        p.channel = p.channel.then({s, 0});
        break;
      case Broken::sensor_offset:
        p.channel = p.channel.then({1, s});
        break;
      case Broken::sensor_stuck:
        p.channel = {0, kept};
        break;
      case Broken::sensor_dead:
        p.channel = {0, 0};
        break;
      case Broken::encoder_off:
        rotor = rotor.then({1, s});
        break;
      case Broken::encoder_frozen:
        rotor = {0, kept};
        break;
      case Broken::encoder_lost_counts:
        rotor = rotor.then({1 - s, s * kept});
        break;
      case Broken::encoder_reversed:
        rotor = rotor.then({-1, 0});
        break;
      case Broken::power_exchanged:
        std::swap(p.ordered, phase[part.other].ordered);
        break;
      case Broken::sensors_exchanged:
        std::swap(channel[part.phase], channel[part.other]);
        break;
    }
  }

  /// After all of them.
  void complete() {
    for (int k = 0; k < N; ++k) {
      phase[k].watched = channel[phase[k].ordered];
      crossed = crossed || phase[k].watched != k;
      leaks = leaks || phase[k].G_turns > 0 || phase[k].G_link > 0;
    }
  }

  /// Whose gate watches the current of winding k.
  int watcher(int k) const {
    for (int g = 0; g < N; ++g) {
      if (phase[g].watched == k) return g;
    }
    return k;
  }
};

}  // namespace srm
