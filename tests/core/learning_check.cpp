// What a law that learns is made of, against independent sources: a line each, exit status 1 if any
// is broken.
#include <cmath>
#include <cstdio>
#include <random>

#include "any_pairs.hpp"
#include "errors.hpp"
#include "srm/control/frame/learning.hpp"
#include "srm/control/law/deadbeat.hpp"
#include "srm/machine/lehuy.hpp"
#include "srm/sim/gates.hpp"
#include "within.hpp"

using namespace srm;

namespace {

std::mt19937 draw(1);
double uniform(double least, double most) {
  return std::uniform_real_distribution<double>(least, most)(draw);
}

/// Rows without error give back the unknowns that they were made with, in either precision.
template <Real T>
double found_unknowns() {
  double worst = 0;
  for (int trial = 0; trial < 100; ++trial) {
    NormalEquations<T> sums;
    std::array<double, 4> wanted;
    for (double& x : wanted) x = uniform(-0.3, 0.3);
    for (int row = 0; row < 40; ++row) {
      std::array<T, 4> phi;
      double r = 0;
      for (int j = 0; j < 4; ++j) {
        phi[j] = static_cast<T>(uniform(-1, 1));
        r += static_cast<double>(phi[j]) * wanted[j];
      }
      sums.add(phi, static_cast<T>(r));
    }
    const auto d = sums.solve();
    for (int j = 0; j < 4; ++j) worst = std::fmax(worst, std::fabs(double(d[j]) - wanted[j]));
    sums.moved(d);
    for (const T g : sums.g) worst = std::fmax(worst, std::fabs(double(g)));
  }
  return worst;
}

/// A direction that no row shows does not move.
double unseen() {
  NormalEquations<double> sums;
  for (int row = 0; row < 40; ++row) sums.add({uniform(-1, 1), uniform(-1, 1), 0, 0}, 0.1);
  const auto d = sums.solve();
  return std::fabs(d[2]) + std::fabs(d[3]) + (NormalEquations<double>{}.solve()[0] == 0 ? 0 : 1);
}

/// Orders with up to four edges, some of them closer than the dead time by which turn-ons are
/// ordered earlier and come late: the seconds at each level against the gates of the simulation.
double level_seconds() {
  constexpr double T_s = 20e-6, t_dead = 1e-6, v_switch = 1.5, v_diode = 1;
  const Drops<double> drops{t_dead, v_switch, v_diode};
  double worst = 0;
  Gates<1> gates{};
  LateLeg<double> leg;
  for (int sample = 0; sample < 2000; ++sample) {
    Command<double, 1> order{};
    double t = 0;
    for (int n = 0; n <= max_edges; ++n) {
      order[0].leg[n] = static_cast<Leg>(int(uniform(-1, 2) + 1) - 1);
      if (n == max_edges) break;
      t += uniform(0, 1) < 0.5 ? uniform(0, 2e-6) : uniform(2e-6, 8e-6);
      order[0].t_edge[n] = t < T_s ? t : never<double>;
    }
    lead_turn_on<double, 1>(order, t_dead);
    const OrderFlux<double> sum = drops.of(order[0], leg, T_s);
    const double start = sample * T_s;
    gates.take(order, false, start);
    double level = 0, drop = 0, now = start;
    while (now < start + T_s) {
      gates.follow(0, now, 10, t_dead);
      gates.settle(now);
      const double next = std::fmin(gates.next_instant(0), start + T_s);
      const int seen = int(gates.levels()[0]);
      level += seen * (next - now);
      drop += ((1 + seen) * v_switch + (1 - seen) * v_diode) * (next - now);
      now = next;
    }
    worst = std::fmax(worst, std::fabs(sum.level - level) / T_s);
    worst = std::fmax(worst, std::fabs(sum.drop - drop) / (2 * T_s));
  }
  return worst;
}

/// A machine of flux k psi(b i) under a law that knows it, and under the law of psi that has
/// learned k and b: the same orders, at any currents, angle, speed, voltage and torque.
double same_orders() {
  constexpr int N = 3;
  using Law = Deadbeat<LeHuy<double>, N>;
  using Own = Deadbeat<WithInductance<LeHuy<double>>, N>;
  const auto believed = lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468);
  double worst = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const double k = uniform(0.8, 1.25), b = uniform(0.9, 1.1), R = uniform(0.6, 1.8);
    auto machine = believed;
    machine.L_u *= k * b;
    machine.L_sat *= k * b;
    machine.A *= k;
    machine.B *= b;
    machine.i_sat /= b;
    Law law{.machine = believed,
            .R = 0.3,
            .sharing = {},
            .feasible = always_feasible<double>(),
            .guide = {},
            .i_max = 100,
            .T_s = 20e-6,
            .delay = 1};
    law.sharing.shape = Shape::cubic;
    law.sharing.theta_on = 0.2;
    law.sharing.theta_ov = 0.7;
    const Own own{.machine = {believed, believed.N_r, 0.0},
                  .R = law.R,
                  .sharing = law.sharing,
                  .feasible = law.feasible,
                  .guide = {},
                  .i_max = law.i_max,
                  .T_s = law.T_s,
                  .delay = law.delay};
    Learning<Own> learning{.law = own, .fit = {}, .pairs = {}, .w_sw_torque = 0, .w_sw_voltage = 0};
    learning.fit.L_u = believed.L_u;
    learning.fit.i_least = 1e9;  // nothing more is learned
    learning.fit.T_s = law.T_s;
    Law knows = law;
    knows.machine = machine;
    knows.R = 0.3 * R;
    typename Law::State a;
    typename Learning<Own>::State x;
    x.fit.learned = {.R = R, .unaligned = k * b, .aligned = k * b, .saturated = k};
    for (int sample = 0; sample < 3; ++sample) {
      Measurement<double, N> y{
          .theta_e = uniform(0, 6.28), .omega_m = uniform(0, 200), .u_dc = 240};
      for (double& i : y.i) i = uniform(0, 60);
      const double tau = uniform(1, 20);
      const auto one = knows.step(a, y, tau), other = learning.step(x, y, tau);
      for (int n = 0; n < N; ++n) {
        for (int e = 0; e < 2; ++e) {
          const double t = one[n].t_edge[e], u = other[n].t_edge[e];
          if (t < law.T_s || u < law.T_s) worst = std::fmax(worst, std::fabs(t - u) / law.T_s);
        }
      }
    }
  }
  return worst;
}

/// A law with a cost of turn-ons, which remembers what it was asked.
struct Priced {
  using Scalar = double;
  static constexpr int n_phases = 3;
  struct State {
    Measurement<double, 3> seen;
    double asked;
  };
  WithInductance<LeHuy<double>> machine;
  double R, i_max, w_sw;
  Command<double, 3> step(State& x, const Measurement<double, 3>& y, double tau_ref) const {
    x = {y, tau_ref};
    return {};
  }
};

/// The law in the units of the believed machine, and what it is asked there: the cost of a turn-on
/// grows by the powers that are stated, to 0.1 % each.
double other_units() {
  const auto believed = lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468);
  double worst = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const double k = uniform(0.8, 1.25), b = uniform(0.65, 1.55), u = uniform(0.8, 1.2);
    const double of_torque = uniform(-1, 2), of_voltage = uniform(-1, 2), w = uniform(1, 3);
    Learning<Priced> learning{.law = {{believed, 4, 0.0}, 0.3, 100, w},
                              .fit = {},
                              .pairs = {},
                              .w_sw_torque = of_torque,
                              .w_sw_voltage = of_voltage};
    learning.fit.L_u = believed.L_u;
    learning.fit.i_least = 1e9;
    learning.fit.T_s = 20e-6;
    Learning<Priced>::State x;
    x.fit.learned = {.R = 1.5, .unaligned = u * k * b, .aligned = k * b, .saturated = k};
    learning.step(x, {.i = {1, 2, 3}, .theta_e = 1, .omega_m = 50, .u_dc = 240}, 10);
    const double price = w * std::pow(b / k, of_torque) * std::pow(1 / k, of_voltage);
    const double apart = std::fabs(std::log(x.alike.w_sw / price));
    const double at_most =
        std::fabs(std::log(b / k) * of_torque) + std::fabs(std::log(k) * of_voltage);
    worst = worst_of({worst, apart - 1e-3 * at_most, off(x.alike.R, 0.3 * 1.5 / (k * b)),
                      off(x.alike.i_max, 100 * b), off(x.law.seen.i[2], 3 * b),
                      off(x.law.seen.u_dc, 240 / k), off(x.law.seen.omega_m, 50),
                      off(x.law.asked, 10 * b / k),
                      off(x.alike.machine.L_more, believed.L_u * (u - 1) / 2)});
  }
  return worst;
}

/// What the neighbours of a phase add, as sums over its pairs at the currents that are believed;
/// its slope by a difference over the size of all currents. At the start of a stroke it is that of
/// the first turn-on between two samples.
double neighbours() {
  constexpr int N = 3;
  using Fit = StrokeFit<double>;
  const AnyPairs any;
  const auto machine = lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468);
  const Fit fit{.drops = {},
                .edges = {},
                .L_u = 1e-3,
                .i_least = 0.5,
                .i_missing = 0.1,
                .psi_least = 1,
                .T_s = 20e-6,
                .delay = 0};
  double worst = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Fit::State<N> x;
    x.learned.aligned = 1.1;
    x.learned.saturated = 0.8;
    Fit::Neighbours<N> found{};
    Measurement<double, N> y{.theta_e = uniform(0, turn), .u_dc = 100};
    std::array<double, N> i{};
    for (int k = 0; k < N; ++k) {
      y.i[k] = trial % 3 == k ? uniform(0, 0.5) : uniform(0.6, 4);
      i[k] = y.i[k] > 0.5 ? 1.1 / 0.8 * (y.i[k] + 0.1) : 0;
      found.now[k] = {uniform(-1, 1), uniform(-1, 1)};
      x.strokes[k].now.idle_level = -uniform(0, 1) * fit.T_s;
    }
    const auto before = found.now;
    const auto psi = [&](int k, double size) {
      double sum = 0;
      for (int n = 0; n < any.pairs.n_pairs(); ++n) {
        const int a = any.first[n], b = any.second[n];
        if (i[a] == 0 && i[b] == 0) continue;
        const auto m = any.pairs.at(n, size * i[a], size * i[b], y.theta_e);
        sum += (k == a ? m.psi_first : 0) + (k == b ? m.psi_second : 0);
      }
      return sum;
    };
    fit.observe<true>(x, found, machine, any.pairs, 0.7, y);
    for (int k = 0; k < N; ++k) {
      const double slope = (psi(k, 1 + 1e-6) - psi(k, 1 - 1e-6)) / 2e-6;
      const double part = -x.strokes[k].now.idle_level / fit.T_s;
      const double start = before[k].psi + part * (psi(k, 1) - before[k].psi);
      worst = worst_of({worst, off(found.now[k].psi, psi(k, 1)) / (1 + std::fabs(psi(k, 1))),
                        off(found.now[k].slope, slope) / (1 + std::fabs(slope)),
                        off(found.start[k].psi, start) / (1 + std::fabs(start)),
                        off(found.added(k).slope, found.now[k].slope - found.start[k].slope),
                        off(found.added(k).psi, psi(k, 1) - start)});
    }
  }
  return worst;
}

/// Where rows show one size of the map alone, the other two are believed to be equal to it, and the
/// resistance to be as given: but for what regularises, a tenth of the belief.
double beliefs() {
  using Fit = StrokeFit<double>;
  Fit::State<3> x;
  x.learned.R = 1.2;
  x.learned.unaligned = 0.8;
  x.learned.aligned = 1.1;
  x.learned.saturated = 0.9;
  x.sums.add({0, 0, 1, 0}, 0.05);
  const auto d = Fit::with_belief(x).solve();
  const double part = Fit::belief / (Fit::belief + NormalEquations<double>::weak);
  return worst_of({off(d[0], part * (1 - 1.2)), off(d[1], part * (1.15 - 0.8)), off(d[2], 0.05),
                   off(d[3], part * (1.15 - 0.9))});
}

}  // namespace

int main() {
  check("least squares give back the unknowns, double", found_unknowns<double>(), 1e-4);
  check("least squares give back the unknowns, float", found_unknowns<float>(), 1e-4);
  check("what no row shows does not move", unseen(), 0);
  check("seconds at each level are those of the gates", level_seconds(), 1e-9);
  check("k psi(b i): the orders of the law that knows it", same_orders(), 1e-9);
  check("what the neighbours of a phase add", neighbours(), 1e-6);
  check("what rows do not show is as believed", beliefs(), 1e-5);
  check("a law in other units", other_units(), 1e-12);
  return failures > 0 ? 1 : 0;
}
