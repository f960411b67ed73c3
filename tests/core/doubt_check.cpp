// One sample in doubt: what begins a doubt and what waits, what is compared, how long a doubt
// lasts, and what is said of what is left of the explanations when it ends.
#include "doubted.hpp"

using namespace srm;
using namespace doubted;

namespace {

/// A sample in doubt, of a map that contradicts nothing: bounds of the phases, and what is left.
template <int N>
struct Doubt {
  Diagnosis<double> d = diagnosis();
  Protection<double> p = protection(0);
  typename Diagnosis<double>::template State<N> x;
  typename Protection<double>::template State<N> guard;
  Measurement<double, N> y{.theta_e = 1, .omega_m = 0, .u_dc = u_dc};

  explicit Doubt(int delay = 0) {
    d.flux.map_error = 1e3;
    d.flux.R_error = 0;
    d.patience = 100;
    p = protection(delay);
    p.flux.R = 0;
    guard.has_last = true;
    Command<double, N> still{};
    for (auto& order : still) order = hold<double>(Leg::freewheel);
    for (int n = 0; n < 2; ++n) d.remember(x, p, still);
    x.u_dc = u_dc;
    x.doubted = 4;
    x.first = {Status::current_too_low, 1, 3.0, 2.0};
    x.left = {.offset = 4, .reversed = 8, .phase = 2, .power = 1, .sensors = 1, .both = 1};
  }
  void flows(int k, double i0, double i1) { guard.i[k] = i0, y.i[k] = i1; }
  bool ends() { return d.finds(x, guard, p, machine(), y); }
};

/// What is said of each set of explanations once the doubt ends: by its patience, and by a current
/// that comes up to the limit; and whether it ends before.
template <int N>
double conclusions() {
  double worst = 0;
  for (int set = 0; set < 64; ++set) {
    for (int by : {0, 1, 2}) {  // nothing, patience, current
      Doubt<N> s;
      const auto bit = [set](int n) { return static_cast<std::uint8_t>(set >> n & 1); };
      s.x.left = {.offset = bit(0) * 4U,
                  .reversed = bit(1) * 8U,
                  .phase = static_cast<std::uint8_t>(bit(2) * 2),
                  .power = bit(3),
                  .sensors = bit(4),
                  .both = bit(5)};
      if (by == 1) s.x.doubted = 100;
      if (by == 2) s.flows(0, 60, 110);
      const bool off = bit(0) != 0, phase = bit(2) != 0, mirrors = N == 3 && bit(5) != 0,
                 reversed = bit(1) != 0 || mirrors,
                 pairs = bit(3) + bit(4) + (mirrors ? 0 : bit(5)) > 0;
      const bool one = off + phase + reversed + pairs <= 1;
      const Status said = phase && (by == 2 || !(off || reversed || pairs))
                              ? Status::current_too_low
                          : by == 2 && pairs ? Status::phases_exchanged
                          : off              ? Status::angle_off
                          : reversed         ? Status::angle_reversed
                          : pairs            ? Status::phases_exchanged
                                             : Status::angle_lost;
      const bool ends = s.ends();
      worst += unless(ends == (by > 0 || one) && s.guard.latched == ends);
      if (ends) worst += unless(s.guard.fault.status == said);
      if (ends) worst += unless(s.guard.fault.phase == (phase ? 1 : -1));
    }
  }
  return worst;
}

/// The doubt lasts for `patience` samples, of which every fourth asks most and ends nothing; and
/// until a round of trials leaves a phase and an angle that no other phase can tell.
double patience() {
  double worst = 0;
  for (unsigned doubted = 90; doubted < 120; ++doubted) {
    Doubt<3> s;
    s.x.doubted = doubted;
    worst += unless(s.ends() == (doubted >= 100 && doubted % 4 != 1));
    worst += unless(s.x.doubted == doubted + 1);
  }
  for (int tried : {2, 3, 4, 5}) {
    for (int other = 0; other < 6; ++other) {  // what else is left
      Doubt<3> s;
      s.x.left = {.offset = other == 1 ? 3U : 1U,
                  .reversed = other == 2 ? 1U : 0U,
                  .phase = 2,
                  .power = other == 3,
                  .sensors = other == 4,
                  .both = other == 5};
      s.x.tried = 254;
      s.x.trial.tried = static_cast<std::uint8_t>(254 + tried);
      worst += unless(s.ends() == (other == 0 && tried > 3));
      worst += unless(s.x.tried == (other == 0 ? 254 : s.x.trial.tried));
    }
  }
  return worst;
}

/// A current that would pass i_max before legs that are switched off now can act; a phase with
/// more flux linkage than it has there.
double limits() {
  double worst = 0;
  for (int delay : {0, 1}) {
    for (int k = 0; k < 3; ++k) {
      for (double more : {-1e-9, 0.0, 1e-9}) {
        Doubt<3> s(delay);
        const double i = i_max - 10 * (1 + delay) + more;
        s.flows(k, i - 10, i);
        worst += unless(s.ends() == (more > 0));
        Doubt<3> rich;
        rich.x.phase[k].any = {rich.d.flux.psi_max + more, 1e3};
        worst += unless(rich.ends() == (more > 0 && k == 1));  // the phase in doubt
      }
    }
  }
  return worst;
}

/// A phase without a reading that has more flux linkage than any angle explains is no angle's; one
/// that is unlike the others is neither an angle nor exchanged.
double no_angles() {
  double worst = 0;
  for (double i : {i_zero, i_zero + 1e-9}) {
    for (double more : {0.0, 1e-9}) {
      Doubt<3> s;
      s.flows(1, i, i);
      s.x.phase[1].any = {s.d.flux.psi_zero + more, 1e3};
      s.ends();
      const bool none = i == i_zero && more > 0;
      worst += unless((s.x.left.offset == 0) == none && (s.x.left.reversed == 0) == none &&
                      (s.x.left.both == 0) == none && s.x.left.power == 1);
    }
  }
  for (int unlike : {0, 1}) {
    for (int phase : {0, 2}) {
      Doubt<3> s;
      s.x.unlike = unlike;
      s.x.left.phase = static_cast<std::uint8_t>(phase);
      s.ends();
      const bool none = unlike == 1 && phase == 2;
      const Explanations& left = s.x.left;
      worst += unless((left.offset == 0 && left.reversed == 0 && left.both == 0 &&
                       left.power == 0 && left.sensors == 0) == none);
      worst += unless((left.offset == 4 && left.power == 1 && left.sensors == 1) == !none);
    }
  }
  return worst;
}

/// What two phases can have had by then, were they exchanged: by the flux linkage of the one less
/// all that a resistance can have taken, and the current of the other.
double begins() {
  double worst = 0;
  for (double i : {i_zero, i_zero + 1e-9, 11.78, 11.79, 148.41, 148.42}) {
    Doubt<3> s;
    s.d.flux.R_error = 0.5;
    s.p.flux.R = 2;
    s.x.doubted = 1;
    s.x.left.sensors = 0;  // one of them is enough, with phase 0
    for (int k = 0; k < 3; ++k) {
      s.flows(k, k == 0 ? i : 20, k == 0 ? i : 20);
      s.x.phase[k].age = 4 + k;
      s.x.phase[k].any = {1.0 + k, 10};
    }
    s.x.forth[2] = s.x.back[2] = {7, 8};
    s.ends();
    const double flows = i * 1.01 + 0.1;
    const double most = i <= i_zero      ? s.d.flux.psi_zero
                        : flows <= 12    ? s.d.trial.psi
                        : flows <= i_max ? s.d.flux.psi_max
                                         : never<double>;
    // Phase k has lost R i by now, and its flux linkage is followed for a sample more.
    const auto taken = [&](int k) { return s.x.phase[k].age * T_s * 2 * 1.5 * 300; };
    worst = worst_of({worst, off(s.x.forth[0].most, most), off(s.x.back[0].most, s.d.flux.psi_max),
                      off(s.x.forth[0].least, s.x.phase[1].any.least - taken(1)),
                      off(s.x.back[0].least, std::fmax(s.x.phase[0].any.least - taken(0), 0)),
                      off(s.x.forth[2].least, 7), off(s.x.back[2].most, 8)});
  }
  return worst;
}

/// A contradiction waits where a phase that flows has it while the law runs, and its flux linkage
/// is known as well as that of others may change it; else the doubt begins. So it does when another
/// phase contradicts as well, or the same one in a window that an angle nearby does not explain.
double waits() {
  double worst = 0;
  const auto contradicts = [](Doubt<3>& s, int k, double i, double part) {
    const double psi = machine().at(i, phase_angle<3>(0.9, k)).psi;
    s.flows(k, i, i);
    s.x.phase[k].any = s.x.phase[k].shown = {part * psi, part * psi};
  };
  const auto begun = [] {
    Doubt<3> s;
    s.d.flux.map_error = 0.02;
    s.y.theta_e = 0.9;
    s.x.doubted = 0;
    s.x.first = {};
    s.x.left = {};
    for (auto& phase : s.x.phase) phase.left = 0;
    return s;
  };
  for (int k = 0; k < 3; ++k) {
    for (double part : {0.7, 1.4}) {
      for (int rounds : {0, 1}) {
        for (double left : {0.0, psi_error, 1.001 * psi_error}) {
          Doubt<3> s = begun();
          contradicts(s, k, 20, part);
          s.x.phase[k].left = left;
          s.x.trial.rounds = rounds;
          s.ends();
          const bool near = rounds == 0 && left <= psi_error;
          worst += unless(s.x.near == (near ? k : -1) && s.x.doubted == (near ? 0 : 1));
          worst += unless(s.x.first.phase == k);
          // The search of an angle begins with what the phase has at least, or at most.
          const double any = part * machine().at(20, phase_angle<3>(0.9, k)).psi;
          const double more = 0.02 + 0.01 + 0.1 / 20;
          worst += unless(s.x.search.turn == 2 * k + (part < 1) && s.x.search.i == 20 &&
                          s.x.search.theta_e == 0.9);
          worst += unless(off(s.x.search.psi, part > 1 ? (any - psi_error) / (1 + more)
                                                       : (any + psi_error) / (1 - more)) < 1e-12);
          worst += unless(s.x.first.status ==
                          (part > 1 ? Status::current_too_low : Status::current_too_high));
          const int others = 7 & ~(1 << k);
          const Explanations& e = s.x.left;
          worst += unless(near || (e.phase == 1 << k && e.power == others && e.sensors == others &&
                                   e.both == others));
          worst += unless(near || (e.offset == 0xffffff && e.reversed == 0xffffff));
        }
      }
    }
    Doubt<3> dead = begun();
    dead.x.phase[k].any = dead.x.phase[k].shown = {0.1, 0.1};
    dead.ends();
    worst += unless(dead.x.doubted == 1 && dead.x.first.status == Status::dead_current_sensor);
    worst += unless(dead.x.search.turn == 2 * k && dead.x.search.i == i_zero + 0.1);
    worst += unless(off(dead.x.search.psi, (0.1 - psi_error) / 1.02) < 1e-12);
    for (int other = 0; other < 3; ++other) {
      if (other == k) continue;
      Doubt<3> both = begun();
      both.x.near = k;
      both.x.first = {Status::current_too_low, static_cast<std::int8_t>(k), 0, 0};
      contradicts(both, other, 20, 1.4);
      both.ends();
      const Explanations& e = both.x.left;
      worst += unless(both.x.doubted == 1 && both.x.near == -1 && both.x.first.phase == k);
      worst += unless(e.phase == 0 && e.power == 1 << other && e.sensors == 1 << other &&
                      e.both == 1 << other);
    }
  }
  return worst;
}

/// What is heard of a phase: where it shows a current and its flux linkage is followed. Once it has
/// left a window, the wait for it is over; that for another phase is not.
double hearings() {
  double worst = 0;
  for (double i : {i_zero, i_zero + 1e-9, 20.0}) {
    for (double least : {0.0, 1e-3}) {
      Doubt<3> s;
      s.x.doubted = 0;
      s.flows(1, i, i);
      s.x.phase[1].any = s.x.phase[1].shown = {least, 1e3};
      s.ends();
      worst += unless(s.x.likeness.sums[1].n == (i > i_zero && least > 0 ? 1 : 0));
    }
  }
  {  // the middle of what the voltage says, and what the reading means
    Doubt<3> s;
    s.d.flux.map_error = 0.02;
    s.d.theta_error = 0;
    s.x.doubted = 0;
    s.flows(1, 20, 20);
    const double psi = machine().at(20, phase_angle<3>(1.0, 1)).psi;
    s.x.phase[1].any = s.x.phase[1].shown = {0.9 * psi, 1.3 * psi};
    s.x.phase[1].taken = 0.3, s.x.phase[1].left = 0.2, s.x.phase[1].age = 6;
    s.ends();
    const auto& sum = s.x.likeness.sums[1];
    worst = worst_of({worst, off(sum.psi, 1.1 * psi) * 1e9, off(sum.map, psi) * 1e9});
    worst += unless(sum.taken == 0.3 && sum.left == 0.2 && sum.age == 7 && sum.i == 20);
  }
  for (int near = 0; near < 3; ++near) {
    for (int k = 0; k < 3; ++k) {
      for (int heard : {2, 3}) {
        Doubt<3> s;
        s.x.doubted = 0;
        s.x.near = near;
        s.x.near_theta = 1;
        s.d.likeness.u_error = 0.01;
        s.x.first = {Status::current_too_low, static_cast<std::int8_t>(near), 0, 0};
        const int window = static_cast<int>(phase_angle<3>(1.0, k) * 12 / turn);
        s.x.likeness.sums[k] = {.n = heard,
                                .window = (window + 1) % 12,
                                .age = 3,
                                .psi = 1,
                                .map = 1,
                                .taken = 0,
                                .left = 0,
                                .i = 3};
        s.flows(near, 20, 20);
        s.x.phase[near].any = s.x.phase[near].shown = {1e-3, 1e3};
        s.ends();
        const bool over = k == near && heard == 3;
        // What an error of the voltage makes of the ratio: three samples at full voltage, over 1
        // Wb.
        const double by_voltage = s.x.likeness.ratio[(window + 1) % 12][k].u;
        worst += off(by_voltage, heard == 3 ? 0.01 * T_s * u_dc * 3 : 0) * 1e9;
        worst += unless(s.x.near == (over ? -1 : near) && s.x.doubted == (over ? 1 : 0));
      }
    }
    // Where the next phase has been at its angle by now, or the patience is over.
    const double far = turn / 3 + turn / 12;
    for (double turned : {0.0, far - 1e-9, far + 1e-9, 1e-9 - far, -1e-9 - far}) {
      for (int waited : {100, 101}) {
        Doubt<3> s;
        s.x.doubted = 0;
        s.x.near = near;
        s.x.near_theta = wrap(1 - turned);
        s.x.near_at = 1000;
        s.x.likeness.now = 1000 + static_cast<std::uint32_t>(waited) - 1;
        s.x.first = {Status::current_too_low, static_cast<std::int8_t>(near), 0, 0};
        s.flows(near, 20, 20);
        s.x.phase[near].any = s.x.phase[near].shown = {1e-3, 1e3};
        s.ends();
        const bool over = std::fabs(turned) > far || waited > 100;
        worst += unless(s.x.doubted == (over ? 1 : 0));
      }
    }
  }
  return worst;
}

/// Of two phases that may be exchanged, of which one comparison alone says something: it leaves
/// the exchange that has its flux linkage and drops the other. Two comparisons are looked at in a
/// sample.
double comparisons() {
  double worst = 0;
  for (int j : {0, 2}) {
    for (bool forth : {true, false}) {
      for (bool power : {true, false}) {
        Doubt<3> s;
        const std::uint8_t with = static_cast<std::uint8_t>(1 << j);
        s.d.flux.map_error = 0.02;
        s.d.flux.psi_max = s.d.flux.psi_zero = 1e3;
        s.y.theta_e = 0.9;
        for (int k = 0; k < 3; ++k) s.flows(k, 20, 20);
        for (auto& phase : s.x.phase) phase.any = phase.shown = {0, 1e3};  // says nothing
        for (auto& span : s.x.forth) span = {0, 1e3};
        s.x.back = s.x.forth;
        // Orders of `from` with the current of `to`: it is winding `to` where cables are exchanged.
        const int from = forth ? 1 : j, to = forth ? j : 1;
        const double psi = machine().at(20, phase_angle<3>(0.9, power ? to : from)).psi;
        (forth ? s.x.forth : s.x.back)[j] = {psi, psi};
        s.x.left.power = s.x.left.sensors = with;
        s.x.left.both = 0;
        for (int n = 0; n < 40; ++n) {
          const int pair = s.x.pair;
          const bool asks = s.x.doubted % 4 == 1;
          s.ends();
          const int moved = (s.x.pair - pair + 12) % 12;
          worst += unless(s.x.pair >= 0 && s.x.pair < 12);
          worst += unless(asks ? moved == 1 || moved == 2 : moved == 0);
        }
        worst += unless(s.x.left.power == (power ? with : 0));
        worst += unless(s.x.left.sensors == (power ? 0 : with));
        worst += unless(s.x.left.phase == 2 && s.x.left.offset == 4 && s.x.left.reversed == 8);
      }
    }
  }
  return worst;
}

/// Likewise of cables behind the sensors: a phase then has the angle of the other.
double cables() {
  double worst = 0;
  for (int j : {0, 2}) {
    for (int asked : {1, j}) {
      for (bool matches : {true, false}) {
        Doubt<3> s;
        const auto with = static_cast<std::uint8_t>(1 << j);
        const int to = asked == 1 ? j : 1;
        s.d.flux.map_error = 0.02;
        s.d.flux.psi_max = s.d.flux.psi_zero = 1e3;
        s.y.theta_e = 0.9;
        for (int k = 0; k < 3; ++k) s.flows(k, 20, 20);
        for (auto& phase : s.x.phase) phase.any = phase.shown = {0, 1e3};  // says nothing
        const double psi = machine().at(20, phase_angle<3>(0.9, matches ? to : asked)).psi;
        s.x.phase[asked].any = {psi, psi};
        s.x.left = {.offset = 0, .reversed = 0, .phase = 2, .power = 0, .sensors = 0, .both = with};
        for (int n = 0; n < 24; ++n) {
          const int both = s.x.both;
          const bool asks = s.x.doubted % 4 == 3 && s.x.left.both != 0;
          s.ends();
          const int moved = (s.x.both - both + 6) % 6;
          worst += unless(s.x.both >= 0 && s.x.both < 6);
          worst += unless(asks ? moved == 1 || moved == 2 : moved == 0);
        }
        worst += unless(s.x.left.both == (matches ? with : 0) && s.x.left.phase == 2);
      }
    }
  }
  return worst;
}

}  // namespace

int main() {
  check("what waits, and what is a doubt at once", waits(), 0);
  check("what is heard, and how long a contradiction waits", hearings(), 1e-6);
  check("one comparison of two phases", comparisons(), 0);
  check("one comparison of two cables", cables(), 0);
  check("what is said of what is left, of three phases", conclusions<3>(), 0);
  check("and of four", conclusions<4>(), 0);
  check("how long a doubt lasts", patience(), 0);
  check("no current beyond the greatest one", limits(), 0);
  check("what is no angle", no_angles(), 0);
  check("bounds of phases that may be exchanged [Wb]", begins(), 1e-12);
  return failures == 0 ? 0 : 1;
}
