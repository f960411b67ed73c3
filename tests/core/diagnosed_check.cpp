// A control that says what broke: what the diagnosis finds, and an angle that has left the one by
// the flux linkages, each ends the sample in which it is found.
#include "doubted.hpp"
#include "srm/control/guard/diagnosed.hpp"

using namespace srm;
using namespace doubted;

namespace {

/// A control that magnetizes the first phase in each sample that is not ended.
struct Plain {
  using Scalar = double;
  using T = double;
  static constexpr int N = 3;
  struct Tuning {};
  struct Control {
    Coupling<double> pairs() const { return {}; }
  };
  struct State {
    Protection<double>::State<N> guard;
  };

  LeHuy<double> machine;
  Protection<double> protection;
  Control control;
  SRM_FIELDS(machine, protection)

  template <Uses used, class Diagnose>
  Status step(State& x, const Measurement<T, N>& y, T, Command<T, N>& orders, const Tuning&,
              const Diagnose& diagnose) const {
    orders = {};
    if (!diagnose.finds(y)) orders[0] = hold<double>(Leg::magnetize);
    return x.guard.fault.status;
  }
};

/// A sample, of a map that contradicts nothing: whether a doubt of a phase ends in it, whether the
/// angle is followed, and by which zero the sensor seems to be off [rad].
struct Sample {
  Diagnosed<Plain> drive{{machine(), protection(0), {}}, diagnosis(), {}};
  Diagnosed<Plain>::State x{};
  Command<double, 3> orders{};

  Sample(bool doubt_ends, bool follows, double zero) {
    drive.diagnosis.flux.map_error = 1e3;
    drive.diagnosis.patience = 100;
    drive.flux_angle = {.T_s = follows ? T_s : 0,
                        .acceleration = 1,
                        .theta_step = 0.01,
                        .theta_error = 0.02,
                        .zero_drift = 0,
                        .tau_drift = 0,
                        .omega_error = 1,
                        .map_error = 0.1,
                        .R_error = 0.1,
                        .psi_error = psi_error,
                        .i_noise = 0.1,
                        .i_zero = i_zero,
                        .alike = 100};
    x.guarded.guard.has_last = true;
    for (int n = 0; n < 2; ++n) drive.diagnosis.remember(x.diagnosis, drive.guarded.protection, {});
    x.diagnosis.u_dc = u_dc;
    if (doubt_ends) {
      x.diagnosis.doubted = 100;
      x.diagnosis.first = {Status::current_too_low, 1, 3.0, 2.0};
      x.diagnosis.left.no_angle();
      x.diagnosis.left.phase = 2;
    }
    x.flux_angle.x = {1, 0, 0, 1, 1, zero};
    x.flux_angle.begun = true;
  }
  Status step() {
    return drive.step<Uses{}>(x, {.i = {}, .theta_e = 1 + x.flux_angle.x[5], .u_dc = u_dc}, 1,
                              orders, {});
  }
  bool ended() const { return orders[0].leg[0] != Leg::magnetize; }
};

double ends() {
  double worst = 0;
  for (bool doubt : {false, true}) {
    for (bool follows : {false, true}) {
      for (double zero : {0.0, 0.0199, 0.0201, -0.0201}) {
        Sample s(doubt, follows, zero);
        const bool leaves = follows && std::fabs(zero) > 0.02;
        const Status said = doubt    ? Status::current_too_low
                            : leaves ? Status::angle_off
                                     : Status::ok;
        worst += unless(s.step() == said);
        worst += unless(s.ended() == (doubt || leaves));
        worst += unless(s.x.guarded.guard.latched == (doubt || leaves));
      }
    }
  }
  return worst;
}

/// A fault that is latched keeps its name when the angle leaves as well.
double first_of_two() {
  Sample s(false, true, 0.1);
  s.x.guarded.guard.latched = true;
  s.x.guarded.guard.fault = {Status::over_current, 2, 400, 300};
  return unless(s.step() == Status::over_current && s.x.guarded.guard.fault.phase == 2);
}

/// What is told of the angle: nothing where it is not followed; a control that starts, starts it.
double told() {
  double worst = 0;
  for (bool follows : {false, true}) {
    Sample s(false, follows, 0.01);
    s.step();
    const FluxEstimate<double> said = s.drive.estimate(s.x);
    worst = worst_of({worst, off(said.theta_hat, follows ? 1 : 0) * 1e9,
                      off(said.psi_scale_hat, follows ? 1 : 0) * 1e9,
                      off(said.zero_hat, follows ? 0.01 : 0) * 1e9});
  }
  return worst;
}

}  // namespace

int main() {
  check("a fault that is found ends its sample", ends(), 0);
  check("the first of two faults keeps its name", first_of_two(), 0);
  check("the angle that is followed is told", told(), 1e-3);
  return failures != 0;
}
