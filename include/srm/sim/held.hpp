// A plant whose legs stay as they are from one sample to the next: the same steps as in the loop,
// one a sample where the currents allow it. There are no gates, no dead time, no courses over time
// and no records, so it costs a third of the loop; environments that learn to switch legs take it
// by the million. A step ends where a current reaches zero.
#pragma once

#include <cmath>
#include <utility>

#include "srm/sim/guard.hpp"
#include "srm/sim/sampling.hpp"

namespace srm {

/// What an episode has cost since its start.
struct Sums {
  double tau{};            // [N m s]
  double error_squared{};  // of (tau - tau_ref) [N^2 m^2 s]
  double i_squared{};      // of all phases [A^2 s]
  double E_mech{};         // tau omega_m [J]
  double E_dc{};           // drawn from the dc link by the bridge [J]
  SRM_FIELDS(tau, error_squared, i_squared, E_mech, E_dc)
};

/// Adds a step of length h from rates r0 to r1.
template <int N>
void add(Sums& q, const Rates<N>& r0, const Rates<N>& r1, double tau_ref, double h) {
  const double tau = integral(r0.tau, r1.tau, h);
  q.tau += tau;
  q.error_squared +=
      integral(r0.tau * r0.tau, r1.tau * r1.tau, h) - tau_ref * (2 * tau - h * tau_ref);
  for (int k = 0; k < N; ++k) q.i_squared += integral(r0.i[k] * r0.i[k], r1.i[k] * r1.i[k], h);
  q.E_mech += integral(r0.tau * r0.omega_m, r1.tau * r1.omega_m, h);
  q.E_dc += integral(r0.u_dc * r0.i_dc, r1.u_dc * r1.i_dc, h);
}

/// How a held plant is stepped.
struct HeldStep {
  double dt_max;  // longest step [s]
  Scale scale;    // currents and voltages are resolved to a small part of this
};

template <Motor M, int N>
class HeldPlant {
 public:
  HeldPlant(Plant<M, N> plant, double theta_m) : plant_(std::move(plant)) {
    at().x.theta_m = theta_m;
    at().x.omega_m = plant_.shaft.omega.at(0);
    at().x.u_dc = srm::start(plant_.source);
    legs_.fill(Leg::demagnetize);
    ordered_ = legs_;
    circuit_.paths = paths(plant_, legs_);
  }

  /// Orders legs, and runs with them to t_end.
  void run(const AllLegs<N>& ordered, double tau_ref, double t_end, const HeldStep& how) {
    turn(ordered);
    while (t_ < t_end) {
      const double angle = plant_.machine.N_r * std::abs(state().omega_m) / longest_angle;
      const double left = t_end - t_;
      const double pieces = std::ceil(left * std::max(1 / how.dt_max, angle) * (1 - 1e-9));
      const double h = step(left / std::max(pieces, 1.0), tau_ref, how);
      t_ = pieces <= 1 && h == left ? t_end : t_ + h;
      if (!(h > shortest_step)) return;  // the numbers are none any more
    }
  }

  double t() const { return t_; }
  const State<N>& state() const { return points_[here_].x; }
  const Sums& sums() const { return sums_; }
  double turn_ons() const { return switchings_.turn_ons; }
  const Plant<M, N>& plant() const { return plant_; }
  const AllLegs<N>& legs() const { return legs_; }

 private:
  Point<N>& at() { return points_[here_]; }
  Point<N>& end() { return points_[1 - here_]; }

  void turn(const AllLegs<N>& ordered) {
    if (ordered == ordered_) return;
    ordered_ = ordered;
    std::visit(
        [&](const auto& bridge) {
          const AllLegs<N> legs = bridge.legs(ordered);
          bridge.count(switchings_, legs_, legs, at().x.u_dc, at().x.i);
          legs_ = legs;
        },
        plant_.bridge);
    circuit_.paths = paths(plant_, legs_);
    rated_ = false;
  }

  /// The circuit of the next step, its magnetics and its rates.
  Settled<N> settled() {
    const State<N>& x = at().x;
    for (int k = 0; k < N; ++k) {
      const bool flows = conducts(legs_[k], x.i[k]);
      if (flows == circuit_.flows[k]) continue;
      circuit_.flows[k] = flows;
      if (flows) {
        at().jets[k] = plant_.machine.jet(x.i[k], electrical_angle(plant_, x.theta_m, k));
      }
      rated_ = false;
    }
    const bool shorted = x.u_dc <= 0 && source_now(plant_, legs_, x, t_).du_dc.now < 0;
    if (shorted != circuit_.shorted) rated_ = false;
    circuit_.shorted = shorted;
    if (!rated_) rates(plant_, x, at().jets, circuit_, {t_, t_}, at().rates);
    Settled<N> s{.circuit = circuit_, .t = t_, .d2i = {}};
    const Rates<N>& r = at().rates;
    for (int k = 0; k < N; ++k) {
      if (circuit_.flows[k]) s.d2i[k] = bend(at().jets[k], r.i[k], r.v[k], r.omega_m);
    }
    return s;
  }

  bool may_block(int k) const { return circuit_.flows[k] && legs_[k] != Leg::magnetize; }

  /// One step of at most h; returns its length.
  double step(double h, double tau_ref, const HeldStep& how) {
    const Settled<N> s = settled();
    Guard zero;
    double when = h;
    for (int k = 0; k < N; ++k) {
      if (!may_block(k)) continue;
      const double t = arrival(-at().x.i[k], at().rates.i[k].rate, s.d2i[k]);
      if (!(t < when)) continue;
      zero = {k, 0, -1};
      when = t;
    }
    Trial y = srm::step(plant_, at(), s, how.scale, when, zero, h, end());
    while ((!y.fine || y.spread > spread_part) && y.h > shortest_step) {
      zero = {};
      y = srm::step(plant_, at(), s, how.scale, y.h / 2, zero, y.h / 2, end());
    }
    for (int k = 0; k < N; ++k) {  // not foreseen
      if (!may_block(k) || (y.landed && zero.k == k) || !(end().x.i[k] < 0)) continue;
      const double i0 = at().x.i[k], part = i0 / (i0 - end().x.i[k]);
      zero = {k, 0, -1};
      y = srm::step(plant_, at(), s, how.scale, part * y.h, zero, y.h, end());
      if (!y.landed) y = srm::step(plant_, at(), s, how.scale, part * y.h, Guard{}, y.h, end());
    }
    add(sums_, at().rates, end().rates, tau_ref, y.h);
    here_ = 1 - here_;
    rated_ = true;
    for (int k = 0; k < N; ++k) {
      if (may_block(k) && at().x.i[k] < 0) at().x.i[k] = 0;
    }
    if (at().x.u_dc < 0) {  // the diodes of the bridge conduct
      at().x.u_dc = 0;
      rated_ = false;
    }
    return y.h;
  }

  Plant<M, N> plant_;
  std::array<Point<N>, 2> points_;  // this one and the end of the step, in turns
  int here_ = 0;
  Sums sums_;
  AllLegs<N> legs_, ordered_;
  Circuit<N> circuit_;
  bool rated_ = false;  // the rates are those of this point and circuit
  Switchings switchings_;
  double t_ = 0;
};

}  // namespace srm
