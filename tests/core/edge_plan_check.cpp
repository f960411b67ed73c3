// The plan of switching instants: exits from the bands by their straight lines, costs by their
// integrals, the best change of legs by trying every one.
#include <cmath>

#include "errors.hpp"
#include "srm/control/part/edge_plan.hpp"
#include "within.hpp"

using namespace srm;

namespace {

using Plan = EdgePlan<double, 3>;

/// A number in -1..1 that follows from n.
double drawn(int n) { return std::sin(1.7 * n + 0.3 * n * n); }

/// Two phases that conduct, with any numbers; what stands in the place of a third counts for
/// nothing.
Plan any_plan(int n) {
  Plan p{};
  p.n_active = 2;
  p.drift = 2 * drawn(n);
  p.phases[2] = {1, 1, 2, 50, {60, 70, 80}, {70, 80, 90}};
  for (int j = 0; j < 2; ++j) {
    Plan::Active& a = p.phases[j];
    a.k = 2 * j;
    a.lowest = drawn(n + 11 * j) > 0.5 ? 0 : 1;
    a.highest = a.lowest + 1;
    a.spread = drawn(n + 3 + j);
    p.spread_squared += a.spread * a.spread;
    for (int level = 0; level < 3; ++level) {
      a.tau_rate[level] = 3 * (level - 1) * drawn(n + 5 + j) + drawn(n + 7);
      a.z_rate[level] = 2 * (level - 1) + drawn(n + 9 + j);
    }
  }
  return p;
}

Plan::Point any_point(int n) {
  return {1.5 * drawn(n), drawn(n + 1), {1.2 * drawn(n + 2), 1.2 * drawn(n + 3), 1e3}};
}

/// The integral of 3 (e^2 - 1) while the legs stay: until the error is at the edge that it runs
/// to, or for a pulse where it is past that edge or almost there.
double dwell(double e, double slope) {
  double t = 1;
  if (slope != 0) {
    const double to = ((slope > 0 ? 1 : -1) - e) / slope;
    if (to >= 0.05 && to < 1) t = to;
  }
  double sum = 0;  // Simpson's rule: exact for a square
  for (int n = 0; n <= 2; ++n) sum += (n == 1 ? 4 : 1) * std::pow(e + slope * t * n / 2, 2);
  return t * (sum / 2 - 3);
}

double dwells() {
  double worst = 0;
  for (double e = -2.5; e < 2.5; e += 0.107) {
    for (double slope : {-20.0, -3.0, -0.7, 0.0, 0.4, 2.0, 30.0}) {
      worst = worst_of({worst, off(Plan::dwell(e, slope), dwell(e, slope)) / 1e3});
    }
  }
  return worst;
}

/// The first instant, by small steps, at which the error leaves its band on the side that it runs
/// to.
double torque_exits() {
  double worst = 0;
  for (double e = -2.05; e < 2.1; e += 0.1) {
    for (double slope : {-3.0, -0.7, 0.4, 2.0}) {
      double t = 0;
      while (t < 2 && (e + slope * t) * slope < 1.3 * std::fabs(slope)) t += 1e-3;
      worst = worst_of({worst, off(Plan::torque_exit(e, slope, 1.3, 2), std::fmin(t, 2)) - 1e-3});
    }
    worst = worst_of({worst, off(Plan::torque_exit(e, 0, 1.3, 2), 2)});
  }
  return worst;
}

/// The first instant at which the torque or the flux linkage of a phase leaves its band towards
/// the side where another level waits.
double stays() {
  double worst = 0;
  int by_flux = 0, level_out = 0;
  for (int n = 0; n < 300; ++n) {
    const Plan p = any_plan(n);
    const Plan::Point x = any_point(n);
    for (int legs = 0; legs < 9; ++legs) {
      const Plan::Levels level{legs % 3, legs / 3, 0};
      const Plan::Point d = p.slopes(level);
      bool may = true;
      for (int j = 0; j < 2; ++j) {
        may = may && level[j] >= p.phases[j].lowest && level[j] <= p.phases[j].highest;
      }
      double first = may ? Plan::torque_exit(x.e, d.e, 1.2, 3) : 0;
      for (int j = 0; j < 2 && may; ++j) {
        const Plan::Active& a = p.phases[j];
        const double away = x.z[j] - a.spread * x.along, rate = d.z[j] - a.spread * d.along;
        const bool other = rate > 0 ? level[j] > a.lowest : level[j] < a.highest;
        const double to = std::fmax(((rate > 0 ? 1 : -1) - away) / rate, 0);
        if (other && to < first) {
          first = to;
          ++by_flux;
        }
      }
      level_out += !may;
      worst = worst_of({worst, off(p.stay(x, d, level, 1.2, 3), first)});
    }
  }
  return worst_of({worst, unless(by_flux > 100 && level_out > 100)});
}

/// Slopes are sums over the phases; a point moves along them.
double straight_lines() {
  double worst = 0;
  for (int n = 0; n < 50; ++n) {
    const Plan p = any_plan(n);
    const Plan::Levels level{n % 3, n / 3 % 3, 0};
    const Plan::Point d = p.slopes(level);
    Plan::Point x = any_point(n);
    const Plan::Point from = x;
    const double along = p.phases[0].tau_rate[level[0]] + p.phases[1].tau_rate[level[1]];
    p.advance(x, d, 0.3);
    worst = worst_of({worst, off(d.along, along), off(d.e, p.drift + along),
                      off(x.e, from.e + 0.3 * d.e), off(x.along, from.along + 0.3 * along),
                      off(x.z[2], 1e3)});
    for (int j = 0; j < 2; ++j) {
      worst = worst_of({worst, off(x.z[j], from.z[j] + 0.3 * p.phases[j].z_rate[level[j]])});
    }
  }
  return worst;
}

/// What legs cost from a point on, by the words at the head of edge_plan.hpp.
double cost(const Plan& p, const Plan::Point& x, const Plan::Levels& level,
            const Plan::Levels& before) {
  const Plan::Point d = p.slopes(level);
  double sum = dwell(x.e, d.e);
  for (int j = 0; j < p.n_active; ++j) {
    const double along = x.along + d.along;
    const double away = x.z[j] + d.z[j] - p.phases[j].spread * along;
    sum += 3 * Plan::w_flux * away * away + std::abs(level[j] - before[j]);
  }
  return sum;
}

/// The legs that are best to go on with: those that may stay, or one phase at another level.
double changes() {
  double worst = 0;
  int changed = 0, kept = 0, forced = 0, used_up = 0;
  for (int n = 0; n < 1500; ++n) {
    const Plan p = any_plan(n);
    const Plan::Point x = any_point(n);
    const Plan::Levels last{n % 3, n / 3 % 3, 0};
    const Plan::Levels edges{n % 7 == 0 ? max_edges : max_edges - 1, n % 5 == 0 ? max_edges : 0, 0};
    Plan::Levels start = last;
    for (int j = 0; j < 2; ++j) {
      const Plan::Active& a = p.phases[j];
      if (edges[j] < max_edges) start[j] = std::max(a.lowest, std::min(last[j], a.highest));
    }
    Plan::Levels best = start;
    double least = cost(p, x, start, start);
    for (int j = 0; j < 2; ++j) {
      for (int l = p.phases[j].lowest; l <= p.phases[j].highest && edges[j] < max_edges; ++l) {
        Plan::Levels other = start;
        other[j] = l;
        const double c = cost(p, x, other, start);
        if (c < least) {
          least = c;
          best = other;
        }
      }
    }
    Plan::Levels level = last;
    Plan::Point d = p.slopes(last);
    const bool said = p.change(level, x, d, edges);
    const Plan::Point slopes = p.slopes(level);
    worst = worst_of({worst, off(cost(p, x, level, start), least), unless(said == (level != last)),
                      off(d.e, slopes.e), off(d.along, slopes.along), off(d.z[0], slopes.z[0]),
                      off(d.z[1], slopes.z[1]), off(level[2], 0)});
    for (int j = 0; j < 2; ++j) worst = worst_of({worst, off(level[j], best[j])});
    (best != start ? changed : kept) += 1;
    forced += start != last;
    used_up += edges[0] == max_edges;
  }
  return worst_of({worst, unless(changed > 200 && kept > 200 && forced > 200 && used_up > 100)});
}

}  // namespace

int main() {
  check("cost of going on: the integral of the error", dwells(), 1e-12);
  check("the error leaves its band", torque_exits(), 1e-9);
  check("legs stay until a band is left", stays(), 1e-12);
  check("slopes and points", straight_lines(), 1e-14);
  check("the change of legs that costs least", changes(), 1e-11);
  return failures == 0 ? 0 : 1;
}
