// What an order may do to the flux linkage over a sample, and what a reading leaves of it.
#include <cmath>

#include "errors.hpp"
#include "srm/control/guard/flux_bounds.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr double T_s = 1e-4;
constexpr Leg down = Leg::demagnetize, still = Leg::freewheel, up = Leg::magnetize;

/// What an order may do over a sample, against the window at every angle that the rotor may have.
double expectations() {
  double worst = 0;
  int held = 0, off_ = 0, either = 0;
  for (int n = 0; n < 2000; ++n) {
    const double theta = std::fmod(0.7 + 1.618 * n, turn), on = std::fmod(2.3 * n, turn);
    const double to = wrap(on + 0.4 + std::fmod(0.9 * n, 5.0)), error = 0.01 * (n % 5);
    const double ahead = 0.6 * std::sin(n);
    PhaseCommand<double> c = regulate(5.0, 0.5, still);
    set_thresholds(c, Comparators::analog);
    c.gate = Gate::window;
    c.theta_on = on;
    c.theta_off = to;
    const double from = theta + std::fmin(ahead, 0) - error,
                 last = theta + std::fmax(ahead, 0) + error;
    int inside = 0;
    for (int j = 0; j <= 400; ++j) inside += conducts(wrap(from + (last - from) * j / 400), on, to);
    const Expected<double> e = expected(c, theta, ahead, error, 0.2, T_s);
    const bool is_held = e.least == 1 && e.most == -1, is_off = e.least == -1 && e.most == -1;
    worst = worst_of({worst, unless(is_held == (inside == 401)), unless(is_off == (inside == 0))});
    if (is_held) worst = worst_of({worst, off(e.below, 4.5 - 0.2), off(e.above, 6 + 0.2)});
    if (!is_held && !is_off) {
      worst =
          worst_of({worst, unless(e.least == -1 && e.most == 1 && !(e.below > 0) && e.above > 0)});
    }
    (is_held ? held : is_off ? off_ : either) += 1;
  }
  // A window begins with its first angle, and ends before its last.
  PhaseCommand<double> half = regulate(5.0, 0.5, still);
  half.gate = Gate::window;
  half.theta_off = 1;
  const auto least_most = [&](double theta_e, double ahead, double least, double most) {
    const Expected<double> e = expected(half, theta_e, ahead, 0.0, 0.2, T_s);
    worst = worst_of({worst, off(e.least, least), off(e.most, most)});
  };
  least_most(0, 0.5, 1, -1);
  least_most(0.5, 0.5, -1, 1);
  least_most(1, 0.5, -1, -1);
  least_most(1.5, -0.5, -1, -1);
  const auto timer = expected(pulse(still, up, 1e-5, 4e-5), 1.0, 0.1, 0.1, 0.2, T_s);
  PhaseCommand<double> full = hold<double>(up);  // all edges within the sample
  full.leg = {up, down, up, down, up};
  full.t_edge = {0.1 * T_s, 0.2 * T_s, 0.3 * T_s, 0.5 * T_s};
  worst = worst_of({worst, off(expected(full, 1.0, 0.1, 0.1, 0.2, T_s).least, 0.4)});
  PhaseCommand<double> none = regulate(0.0, 0.5, still), open{};
  none.gate = open.gate = Gate::window;
  none.theta_off = open.theta_off = 3;
  const auto without = expected(none, 1.0, 0.1, 0.1, 0.2, T_s);
  open.gate = Gate::off;
  open.i_ref = 5;
  const auto nothing = expected(open, 1.0, 0.1, 0.1, 0.2, T_s);
  return worst_of({worst, unless(held > 200 && off_ > 200 && either > 100), off(timer.least, 0.3),
                   off(timer.most, 0.3), off(without.least, -1), off(without.most, -1),
                   off(nothing.least, -1), off(nothing.most, -1)});
}

/// Between which flux linkages a sample leads, and what a reading leaves of them.
double flux_bounds() {
  const FluxBounds<double> flux{
      .R = 2, .T_s = T_s, .i_error = 0.5, .model_error = 0.1, .u_margin = 0.05};
  const double u = 200, volt_seconds = T_s * u;
  const auto leads = [&](const Expected<double>& order, double i0, double i1, double least,
                         double most) {
    FluxBounds<double>::State x{.least = 0.1, .most = 0.3};
    flux.advance(x, order, i0, i1, u);
    return worst_of({off(x.least, least), off(x.most, most)});
  };
  const Expected<double> half{0.5, 0.5, 1e30, -1e30}, band{1, -1, 5, 7};
  double worst = worst_of(
      {leads(half, 4, 3, 0.1 + 0.45 * volt_seconds - 2 * 4 * T_s, 0.3 + 0.55 * volt_seconds),
       leads(half, -4, -3, 0.1 + 0.45 * volt_seconds, 0.3 + 0.55 * volt_seconds),
       leads(band, 4, 4.9, 0.1 + 0.95 * volt_seconds - 2 * 4.9 * T_s, 0.3 + 1.05 * volt_seconds),
       leads(band, 4, 5, 0.1 - 1.05 * volt_seconds - 2 * 5 * T_s, 0.3 + 1.05 * volt_seconds),
       leads(band, 7.1, 8, 0.1 - 1.05 * volt_seconds - 2 * 8 * T_s, 0.3 - 0.95 * volt_seconds),
       leads(band, 7, 8, 0.1 - 1.05 * volt_seconds - 2 * 8 * T_s, 0.3 + 1.05 * volt_seconds)});
  FluxBounds<double>::State low{.least = 0.001, .most = 0.001};
  flux.advance(low, {-1, -1, 1e30, -1e30}, 1, 1, u);
  FluxBounds<double>::State again{.least = 0, .most = 0.001};
  flux.advance(again, {-1, 0.2, 1e30, -1e30}, 1, 1, u);
  worst =
      worst_of({worst, off(low.least, 0), off(low.most, 0), off(again.most, 1.05 * volt_seconds)});
  const auto narrows = [&](double least, double most, double psi, double to_least, double to_most) {
    FluxBounds<double>::State x{.least = least, .most = most};
    const int side = flux.narrow(x, 5, psi);  // wrong by 0.1 + 0.5/5 of psi
    return worst_of({off(side, 0), off(x.least, to_least), off(x.most, to_most)});
  };
  FluxBounds<double>::State x{.least = 0.1, .most = 0.3}, y = x;
  return worst_of({worst, narrows(0.1, 0.3, 0.2, 0.16, 0.24), narrows(0.2, 0.21, 0.2, 0.2, 0.21),
                   narrows(0, 0.3, 0.3, 0.24, 0.3), off(flux.narrow(x, 5, 0.1 / 1.2 - 1e-9), -1),
                   off(flux.narrow(y, 5, 0.3 / 0.8 + 1e-9), 1)});
}

}  // namespace

int main() {
  check("orders: what they may do over a sample", expectations(), 1e-12);
  check("flux linkage: bounds by voltage and reading", flux_bounds(), 1e-15);
  return failures == 0 ? 0 : 1;
}
