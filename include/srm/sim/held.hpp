// A plant whose legs stay as they are from one sample to the next: the same equations as in the
// loop, in one step a sample where the currents allow it. There are no gates, no dead time, no
// courses over time and no records, so it costs a third of the loop; environments that learn to
// switch legs take it by the million.
//
// A current that reaches zero within a step ends the step there, at the root of the parabola
// through the step's start, its slope and its end; so the blocked phase is right to a few
// billionths of the energy.
#pragma once

#include <cmath>
#include <utility>

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

/// How a held plant is stepped.
struct HeldStep {
  double dt_max;  // longest step [s]
  double spread;  // a step is halved while its midpoints are further apart [A]
};

template <Machine M, int N>
class HeldPlant {
 public:
  HeldPlant(Plant<M, N> plant, double theta_m) : plant_(std::move(plant)) {
    at_.x.theta_m = theta_m;
    at_.x.omega_m = plant_.shaft.omega.at(0);
    at_.x.u_dc = srm::start(plant_.source);
    legs_.fill(Leg::demagnetize);
    ordered_ = legs_;
  }

  /// Orders legs, and runs with them to t_end.
  void run(const AllLegs<N>& ordered, double tau_ref, double t_end, const HeldStep& how) {
    turn(ordered);
    while (t_ < t_end) {
      const double angle = plant_.machine.N_r * std::abs(at_.x.omega_m) / longest_angle;
      const double left = t_end - t_;
      const double pieces = std::ceil(left * std::max(1 / how.dt_max, angle) * (1 - 1e-9));
      const double h = step(left / std::max(pieces, 1.0), tau_ref, how.spread);
      t_ = pieces <= 1 && h == left ? t_end : t_ + h;
      if (!(h > shortest)) return;  // the numbers are none any more
    }
  }

  double t() const { return t_; }
  const State<N>& state() const { return at_.x; }
  const Sums& sums() const { return at_.q; }
  double turn_ons() const { return switchings_.turn_ons; }
  const Plant<M, N>& plant() const { return plant_; }
  const AllLegs<N>& legs() const { return legs_; }

 private:
  static constexpr double shortest = 1e-15;  // [s]

  // Longest step in electrical angle [rad], 20 us at 1500 rpm and four rotor poles. Against the
  // loop at 0.25 us, 2000 samples of random legs leave the currents right to 1e-6 of their limit,
  // and the sums to 1e-6 (tests/test_gym.py).
  static constexpr double longest_angle = 0.0131;

  struct Point {
    State<N> x;
    Sums q;
    SRM_FIELDS(x, q)
  };

  void turn(const AllLegs<N>& ordered) {
    if (ordered == ordered_) return;
    ordered_ = ordered;
    std::visit(
        [&](const auto& bridge) {
          const AllLegs<N> legs = bridge.legs(ordered);
          bridge.count(switchings_, legs_, legs, at_.x.u_dc, at_.x.i);
          legs_ = legs;
        },
        plant_.bridge);
  }

  // flatten: inlining the plant drops what is not summed.
  [[gnu::flatten]] Point slope(const State<N>& x, const Circuit<N>& circuit, double tau_ref) const {
    const Rates<N> r = rates(plant_, x, circuit, {t_, t_});
    const double error = r.tau - tau_ref;
    Point d{.x = r.dx,
            .q = {.tau = r.tau,
                  .error_squared = error * error,
                  .E_mech = r.tau * x.omega_m,
                  .E_dc = r.p_dc}};
    for (const double i : x.i) d.q.i_squared += i * i;
    return d;
  }

  /// The classic fourth-order step from k1; false where its midpoints are too far apart.
  bool trial(const Point& k1, const Circuit<N>& circuit, double tau_ref, double h, double spread,
             Point& end) const {
    const Point k2 = slope(moved(at_.x, k1.x, h / 2), circuit, tau_ref);
    const Point k3 = slope(moved(at_.x, k2.x, h / 2), circuit, tau_ref);
    for (int k = 0; k < N; ++k) {
      if (std::abs(k3.x.i[k] - k2.x.i[k]) * h / 2 > spread) return false;
    }
    const Point k4 = slope(moved(at_.x, k3.x, h), circuit, tau_ref);
    each([h](double a, double r1, double r2, double r3,
             double r4) { return a + h / 6 * (r1 + 2 * (r2 + r3) + r4); },
         end, at_, k1, k2, k3, k4);
    return true;
  }

  /// One step of at most h; returns its length.
  double step(double h, double tau_ref, double spread) {
    Circuit<N> circuit{.leg = legs_};
    for (int k = 0; k < N; ++k) circuit.flows[k] = conducts(legs_[k], at_.x.i[k]);
    circuit.shorted = at_.x.u_dc <= 0 && source_now(plant_, legs_, at_.x, t_).du_dc < 0;
    const Point k1 = slope(at_.x, circuit, tau_ref);
    Point end;
    while (!trial(k1, circuit, tau_ref, h, spread, end) && h > shortest) h /= 2;
    if (const double met = first_zero(k1, end, h); met < h) {
      h = met;
      trial(k1, circuit, tau_ref, h, never<double>, end);
    }
    for (int k = 0; k < N; ++k) {
      if (legs_[k] != Leg::magnetize && end.x.i[k] < spread) end.x.i[k] = 0;  // diodes block
    }
    if (end.x.u_dc < 0) end.x.u_dc = 0;  // the diodes of the bridge conduct
    at_ = end;
    return h;
  }

  /// When the first current falls to zero on the way to the end; h where none does.
  double first_zero(const Point& k1, const Point& end, double h) const {
    double first = h;
    for (int k = 0; k < N; ++k) {
      const double i0 = at_.x.i[k], i1 = end.x.i[k];
      if (legs_[k] == Leg::magnetize || i0 <= 0 || i1 > 0) continue;
      const double a = i1 - i0 - k1.x.i[k] * h, b = k1.x.i[k] * h;  // i0 + b s + a s^2
      const double root = std::sqrt(std::max(b * b - 4 * a * i0, 0.0));
      first = std::min(first, h * (2 * i0 / (root - b)));
    }
    return first;
  }

  Plant<M, N> plant_;
  Point at_{};
  AllLegs<N> legs_, ordered_;
  Switchings switchings_;
  double t_ = 0;
};

}  // namespace srm
