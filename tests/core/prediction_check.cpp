// What the next sample brings, alone and with pairs: currents against an integration of the
// circuit, torque lines against the machine at their ends, and the model of pairs that add nothing
// against that of phases alone.
#include <cmath>
#include <vector>

#include "any_pairs.hpp"
#include "errors.hpp"
#include "srm/control/part/coupled_prediction.hpp"
#include "srm/machine/flux_map.hpp"
#include "srm/machine/lehuy.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr int N = 3;
constexpr double T_s = 5e-6, R = 0.72, u_dc = 240;
using M = LeHuy<double>;
using Vector = std::array<double, N>;
using Phases = std::array<PhasePrediction<double>, N>;

M machine() { return lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468); }

/// A guide that wants current over half of a turn.
struct Guide {
  std::vector<double> values = std::vector<double>(2 * 360);
  Guide() {
    for (int j = 0; j < 360; ++j) {
      const double theta = j * turn / 360;
      values[static_cast<std::size_t>(360 + j)] = std::fmax(0.25 * std::sin(theta - 0.3), 0);
    }
  }
  /// Near the flux linkages of three phases, whose torque it asks a little more of.
  Guide(const Vector& psi, double theta_e, double missing) : Guide() {
    for (int j = 0; j < 360; ++j) {
      for (int k = 0; k < N; ++k) {
        const double past = wrap(j * turn / 360 - phase_angle<N>(theta_e, k) + turn / 2) - turn / 2;
        if (std::fabs(past) > 0.5) continue;
        values[static_cast<std::size_t>(360 + j)] = psi[k] + missing + 0.02 * past;
      }
    }
  }
  Profile<double> at() const { return {AngleTable<double>{{values.data(), 720}, 2, 360, 1}.at(1)}; }
};

/// All phases at currents and an angle: flux linkages and torque, with pairs.
struct Model {
  AnyPairs any;
  M own = machine();

  explicit Model(double factor) {
    any.pairs.N_r = 4;
    any.pairs.factor = factor;
  }
  Vector psi(const Vector& i, double theta_e) const {
    Vector psi{};
    for (int k = 0; k < N; ++k) {
      psi[k] = i[k] > 0 ? own.at(i[k], phase_angle<N>(theta_e, k)).psi : 0;
    }
    for (int n = 0; n < 2; ++n) {
      const int a = any.first[n], b = any.second[n];
      const auto m = any.pairs.at(n, i[a], i[b], theta_e);
      psi[a] += m.psi_first;
      psi[b] += m.psi_second;
    }
    return psi;
  }
  double torque(const Vector& i, double theta_e) const {
    double tau = any.pairs.torque(i, theta_e);
    for (int k = 0; k < N; ++k) tau += own.at(i[k], phase_angle<N>(theta_e, k)).tau;
    return tau;
  }
  /// The currents that have these flux linkages, from a guess on.
  Vector currents(const Vector& wanted, double theta_e, Vector i) const {
    for (int round = 0; round < 30; ++round) {
      const Vector now = psi(i, theta_e);
      Square<double, N> L{};
      std::array<bool, N> taken{};
      Vector lacks{};
      for (int l = 0; l < N; ++l) {
        taken[l] = i[l] > 0;
        lacks[l] = wanted[l] - now[l];
        Vector more = i;
        more[l] += 1e-4;
        const Vector then = psi(more, theta_e);
        for (int k = 0; k < N; ++k) L[k][l] = (then[k] - now[k]) / 1e-4;
      }
      const Vector d = solved<double, N>(taken, L, lacks);
      for (int k = 0; k < N; ++k) i[k] += d[k];
    }
    return i;
  }
  /// Currents after a sample of mean voltages, by many small steps of their flux linkages.
  Vector later(Vector i, double theta_e, double omega_e, const Vector& u) const {
    Vector flux = psi(i, theta_e);
    constexpr int steps = 20;
    for (int n = 0; n < steps; ++n) {
      for (int k = 0; k < N; ++k) {
        if (i[k] > 0) flux[k] += T_s / steps * (u[k] - R * i[k]);
      }
      i = currents(flux, theta_e + omega_e * T_s * (n + 1) / steps, i);
    }
    return i;
  }
};

template <class Any>
Prediction<Any, N> prediction(const Any& of, const Guide& guide, int delay) {
  return {of, guide.at(), R, T_s, delay, T_s, 1e-3};
}

constexpr double duty[N] = {0.3, -0.4, 0.6};

/// Two that magnetize or demagnetize within the sample, and one at its ends.
Memory<double, N> memory() {
  Memory<double, N> m;
  m.ordered = {pulse(Leg::freewheel, Leg::magnetize, 1e-6, 1e-6 + 0.3 * T_s),
               pulse(Leg::freewheel, Leg::demagnetize, 1e-6, 1e-6 + 0.4 * T_s),
               pulse(Leg::magnetize, Leg::freewheel, 1e-6, 1e-6 + 0.4 * T_s)};
  return m;
}

struct Point {
  Vector i;
  double theta_e, omega_m;
};
constexpr Point points[] = {{{40, 30, 12}, 1.2, 150},
                            {{20, 35, 25}, 2.9, -90},
                            {{15, 11, 50}, 4.4, 200},
                            {{30, 10, 22}, 5.8, 60}};

/// The sample under way is bridged: currents, and flux linkages that belong to them.
template <class Any>
double bridged(const Model& model, const Any& of) {
  const Guide guide;
  double worst = 0;
  for (const Point& p : points) {
    auto remembered = memory();
    const double omega_e = 4 * p.omega_m, end = wrap(p.theta_e + omega_e * T_s);
    const Measurement<double, N> y{
        .i = p.i, .theta_e = p.theta_e, .omega_m = p.omega_m, .u_dc = u_dc};
    const Phases x = prediction(of, guide, 1).at(y, 1, remembered);
    const Vector there =
        model.later(p.i, p.theta_e, omega_e, {duty[0] * u_dc, duty[1] * u_dc, duty[2] * u_dc});
    const Vector psi = model.psi({x[0].i, x[1].i, x[2].i}, end);
    for (int k = 0; k < N; ++k) {
      const double way = std::fabs(there[k] - p.i[k]) + 0.1;
      worst = worst_of({worst, off(x[k].i, there[k]) / way,
                        off(remembered.i_expected[k], x[k].i) * 1e9, off(x[k].psi, psi[k])});
    }
  }
  return worst;
}

/// A slope of the torque over the flux linkage of phase k.
double slope(const Model& model, Vector psi, int k, double theta_e, const Vector& guess) {
  const auto torque = [&](double more) {
    Vector moved = psi;
    moved[k] += more;
    return model.torque(model.currents(moved, theta_e, guess), theta_e);
  };
  return (torque(1e-5) - torque(-1e-5)) / 2e-5;
}

/// Torque at the end of its lines is that of the machine there, where each flux linkage follows its
/// guide, or takes all of the voltage far from it; and so is each slope over a flux linkage.
/// missing: of the guide's flux linkage [Wb].
template <class Any>
double torque_lines(const Model& model, const Any& of, double missing) {
  double worst = 0;
  for (const Point& p : points) {
    Memory<double, N> none;
    const double end = wrap(p.theta_e + 4 * p.omega_m * T_s);
    const Vector &i = p.i, psi = model.psi(i, p.theta_e);
    const Guide guide = missing < 1 ? Guide(psi, p.theta_e, missing) : Guide();
    Vector goal, goal_next;
    for (int k = 0; k < N; ++k) {
      goal[k] = guide.at().at(phase_angle<N>(p.theta_e, k));
      goal_next[k] = guide.at().at(phase_angle<N>(end, k));
    }
    const Measurement<double, N> y{
        .i = i, .theta_e = p.theta_e, .omega_m = p.omega_m, .u_dc = u_dc};
    const Phases x = prediction(of, guide, 0).at(y, 1, none);
    Vector moved = psi;
    double tau = 0, tau_end = 0;
    for (int k = 0; k < N; ++k) {
      const double back = goal_next[k] - psi[k], most = u_dc * T_s;
      const double move =
          std::fabs(back) > most ? std::copysign(most, back) : goal_next[k] - goal[k];
      moved[k] += move;
      tau += x[k].tau;
      tau_end += x[k].tau + x[k].drift * T_s + x[k].gain * move;
      worst = worst_of({worst, off(x[k].goal_rate * T_s, goal_next[k] - goal[k]),
                        1e3 * off(x[k].psi - x[k].goal, psi[k] - goal[k]),
                        unless(x[k].idle == (std::fmax(goal[k], goal_next[k]) < 1e-3))});
    }
    const double expected = model.torque(model.currents(moved, end, i), end),
                 now = model.torque(i, p.theta_e);
    worst = worst_of(
        {worst, off(tau, now) * 1e3, off(tau_end, expected) / (std::fabs(expected - now) + 0.1)});
    for (int k = 0; k < N; ++k) {
      const double gain = (slope(model, psi, k, p.theta_e, i) + slope(model, moved, k, end, i)) / 2;
      worst = worst_of({worst, off(x[k].gain, gain) / (std::fabs(gain) + 1)});
    }
  }
  return worst;
}

/// A phase that starts besides two that conduct: what they induce is a voltage that it lacks, and
/// at full voltage the torque is that of the machine.
double starts_with_pairs(const Model& model) {
  const Guide guide;
  const WithPairs<M> of{machine(), 4, model.any.pairs};
  double worst = 0;
  for (int k = 0; k < N; ++k) {
    const double theta_e = wrap(1.2 + k * turn / N), omega_m = 150;
    const double end = wrap(theta_e + 4 * omega_m * T_s);
    Vector i{30, 25, 20};
    i[k] = 0;
    Memory<double, N> none;
    const Measurement<double, N> y{.i = i, .theta_e = theta_e, .omega_m = omega_m, .u_dc = u_dc};
    const Phases x = prediction(of, guide, 0).at(y, 1, none);
    const Vector psi = model.psi(i, theta_e);
    Vector alone = psi, all = psi;
    double tau_end = 0;
    for (int l = 0; l < N; ++l) {
      const double goal = guide.at().at(phase_angle<N>(theta_e, l)),
                   next = guide.at().at(phase_angle<N>(end, l));
      const double most = u_dc * T_s, back = next - psi[l];
      double move = std::fabs(back) > most ? std::copysign(most, back) : next - goal;
      if (l == k) move = most;
      if (l != k) alone[l] += move;
      all[l] += move;
      tau_end += x[l].tau + x[l].drift * T_s + x[l].gain * (move + x[l].bias * T_s);
    }
    const Vector others = model.currents(alone, end, i);  // phase k has none
    const double induced = (model.psi(others, end)[k] - psi[k]) / T_s;
    Vector guess = others;
    guess[k] = 1;
    const double expected = model.torque(model.currents(all, end, guess), end),
                 now = model.torque(i, theta_e);
    worst = worst_of({worst, unless(!x[k].idle), off(x[k].psi, 0),
                      off(x[k].bias, -induced) / (std::fabs(induced) + 1),
                      off(tau_end, expected) / (std::fabs(expected - now) + 0.1)});
  }
  return worst;
}

/// A phase of its own: the current's slopes, and a start that takes all of the voltage.
double own_lines() {
  const Guide guide;
  const M m = machine();
  Memory<double, N> none;
  const double theta_e = 1.4, omega_m = 120, end = theta_e + 4 * omega_m * T_s;
  const Measurement<double, N> y{
      .i = {0, 25, 0}, .theta_e = theta_e, .omega_m = omega_m, .u_dc = u_dc};
  const Phases x = prediction(m, guide, 0).at(y, 1, none);
  const double theta = phase_angle<N>(theta_e, 1);
  const auto at = m.at(25, theta);
  double i = 0.1;
  for (int round = 0; round < 30; ++round)
    i += (u_dc * T_s - m.at(i, end).psi) / m.at(i, end).L_inc;
  double worst = worst_of(
      {off(x[1].i_gain, 1 / at.L_inc), off(x[1].i_drift * at.L_inc, -omega_m * at.psi_theta),
       off(x[0].gain * u_dc * T_s, m.at(i, end).tau) * 10, off(x[0].tau, 0), off(x[0].psi, 0)});
  // Neither current nor a guide: nothing at all.
  const PhasePrediction<double>& idle = x[2];
  worst = worst_of(
      {worst, unless(idle.idle), off(idle.psi, 0), off(idle.gain, 0), off(idle.goal_rate, 0)});
  // Diodes let no flux linkage build up backwards.
  PhasePrediction<double> p{};
  p.bias = 3;
  worst = worst_of(
      {worst, off(p.rate(-1, 200, 2), 0), off(p.rate(0, 200, 2), 0), off(p.rate(1, 200, 2), 203)});
  p.psi = 0.1;
  p.i = 10;
  return worst_of({worst, off(p.rate(-1, 200, 2), -217), off(p.rate(0, 200, 2), -17)});
}

/// Torque of the other sense, on a rotor that turns the other way, is the same in a mirror.
double mirrored() {
  const Guide guide;
  double worst = 0;
  for (int delay : {0, 1}) {
    auto a = memory(), b = memory();
    const Measurement<double, N> y{.i = {20, 30, 25}, .theta_e = 1.1, .omega_m = 100, .u_dc = u_dc};
    Measurement<double, N> z = y;
    z.theta_e = wrap(-y.theta_e);
    z.omega_m = -y.omega_m;
    std::swap(z.i[1], z.i[2]);
    std::swap(b.ordered[1], b.ordered[2]);
    const Phases x = prediction(machine(), guide, delay).at(y, 1, a),
                 m = prediction(machine(), guide, delay).at(z, -1, b);
    for (int k = 0; k < N; ++k) {
      const auto &p = x[k], &q = m[k == 0 ? 0 : 3 - k];
      worst = worst_of({worst, off(p.tau, q.tau), off(p.psi, q.psi), off(p.i, q.i),
                        off(p.gain, q.gain) / 1e2, off(p.drift, q.drift) / 1e5, off(p.goal, q.goal),
                        off(p.goal_rate, q.goal_rate) / 1e2});
    }
  }
  return worst;
}

/// Part of what the last prediction missed becomes a voltage, up to a tenth of the dc link; none
/// where the diodes block.
template <class Any>
double biases(const Any& of) {
  const Guide guide;
  const M m = machine();
  double worst = 0;
  for (double missed : {-9.0, -0.3, 0.2, 9.0}) {
    auto remembered = memory();
    remembered.i_expected = {40 - missed, 30 - missed, 0};
    remembered.bias = {2, 1, 5};
    const Measurement<double, N> y{.i = {40, 30, 12}, .theta_e = 1.2, .omega_m = 150, .u_dc = u_dc};
    const Phases x = prediction(of, guide, 1).at(y, 1, remembered);
    for (int k = 0; k < 2; ++k) {
      const double L = m.at(y.i[k], phase_angle<N>(1.2, k)).L_inc;
      const double bias = std::fmin(std::fmax((k == 0 ? 2 : 1) + missed * L / T_s / 8, -24), 24);
      worst = worst_of({worst, off(remembered.bias[k], bias), off(x[k].bias, bias)});
    }
    worst = worst_of({worst, off(remembered.bias[2], 5)});
  }
  auto remembered = memory();
  remembered.bias = {2, 1, 5};
  const Measurement<double, N> y{.theta_e = 1.2, .omega_m = 150, .u_dc = u_dc};
  const Phases x = prediction(of, guide, 1).at(y, 1, remembered);
  return worst_of({worst, off(remembered.bias[1], 0), off(x[1].i, 0),
                   unless(x[0].i > 0 && remembered.bias[0] == 2)});
}

/// Pairs that add nothing: the lines of phases alone, with phases that start and that are idle.
double without_pairs() {
  const Guide guide;
  const Model model(0);
  const WithPairs<M> of{machine(), 4, model.any.pairs};
  double worst = 0;
  for (double sense : {1.0, -1.0}) {
    for (double theta_e = 0.05; theta_e < turn; theta_e += 0.31) {
      for (int flows = 0; flows < 8; ++flows) {
        Memory<double, N> a, b;
        Measurement<double, N> y{.theta_e = theta_e, .omega_m = 110, .u_dc = u_dc};
        for (int k = 0; k < N; ++k) y.i[k] = flows >> k & 1 ? 20 + 5 * k : 0;
        const Phases x = prediction(machine(), guide, 0).at(y, sense, a),
                     z = prediction(of, guide, 0).at(y, sense, b);
        for (int k = 0; k < N; ++k) {
          const auto &p = x[k], &q = z[k];
          worst = worst_of({worst, unless(p.idle == q.idle), off(p.tau, q.tau), off(p.psi, q.psi),
                            off(p.i, q.i)});
          if (p.idle && !(p.i > 0)) continue;
          worst = worst_of({worst, off(p.goal, q.goal), off(p.goal_rate, q.goal_rate) / 1e2,
                            off(p.i_gain, q.i_gain) / 1e3});
          const double gained = T_s * u_dc, end = p.gain * gained + p.drift * T_s;
          worst = worst_of({worst, off(end, q.gain * gained + q.drift * T_s)});  // at full voltage
          if (!(p.i > 0)) continue;
          worst = worst_of({worst, off(p.gain, q.gain) / 1e2, off(p.drift, q.drift) / 1e5,
                            off(p.i_drift, q.i_drift) / 1e5});
        }
      }
    }
  }
  return worst;
}

}  // namespace

int main() {
  const Model alone(0), pairs(4e-11);
  const WithPairs<M> coupled{machine(), 4, pairs.any.pairs}, none{machine(), 4, alone.any.pairs};
  check("the sample under way, phases alone [of the way]", bridged(alone, machine()), 5e-4);
  check("the sample under way, pairs [of the way]", bridged(pairs, coupled), 0.01);
  check("torque lines at the guide, phases alone", torque_lines(alone, machine(), 1e-4), 2e-4);
  check("torque lines far from it, phases alone", torque_lines(alone, machine(), 1), 1e-3);
  check("torque lines at the guide, pairs", torque_lines(pairs, coupled, 1e-4), 5e-3);
  check("torque lines far from it, pairs", torque_lines(pairs, coupled, 1), 1e-2);
  check("a phase that starts, pairs", starts_with_pairs(pairs), 2e-3);
  check("slopes of a phase alone, its start", own_lines(), 1e-6);
  check("torque of the other sense", mirrored(), 1e-9);
  check("voltage that the model misses, phases alone", biases(machine()), 1e-12);
  check("voltage that the model misses, pairs", biases(none), 1e-12);
  check("pairs that add nothing", without_pairs(), 1e-9);
  const WithPairs<FluxMap<double>> of_a_map{{}, 4, pairs.any.pairs};
  check("no current, by whatever map [A]", of_a_map.no_current() - coupled.no_current(), 0);
  return failures == 0 ? 0 : 1;
}
