// The supervised step: the order of the states, a fault and its clearing, and the angles at which
// the protection asks the machine.
#include <cmath>
#include <limits>

#include "srm/control/guard/protection.hpp"
#include "srm/control/guard/supervised.hpp"
#include "within.hpp"

using namespace srm;

namespace {

constexpr float T_s = 50e-6F;

/// A machine that keeps the largest angle at which it is asked.
struct Asked {
  using Scalar = float;
  int N_r = 4;
  float* most;
  Magnetics<float> at(float i, float theta_e) const {
    if (!(theta_e >= 0)) *most = 1e9F;
    *most = std::fmax(*most, theta_e);
    return {.psi = 1e-3F * i, .W_c = 0, .tau = 0, .L_inc = 1e-3F, .psi_theta = 0};
  }
};

constexpr Protection<float> protection{
    .flux = {.R = 0.1F, .T_s = T_s, .i_error = 0.1F, .model_error = 10, .u_margin = 10},
    .levels = {.i_trip = 100, .u_dc_min = 10, .u_dc_max = 400, .omega_max = 1e4F, .angle_slack = 9},
    .advance = {},
    .i_zero = 1,
    .delay = 0,
    .frozen = 0};

/// Greatest angle [rad] at which N phases are judged while phase 0 is at angles where the angle of
/// another one is just below zero.
template <int N>
float greatest_angle() {
  float most = 0;
  const Asked machine{.most = &most};
  for (int k = 1; k < N; ++k) {
    float theta_e = static_cast<float>(k) * (two_pi<float> / N);
    for (int step = 0; step < 4; ++step) {
      theta_e = std::nextafter(theta_e, 0.0F);
      Protection<float>::State<N> x;
      Measurement<float, N> y{.theta_e = theta_e, .u_dc = 100};
      y.i.fill(5);
      for (int sample = 0; sample < 2; ++sample) {
        protection.admits(x, machine, y, 0.0F, protection.levels);
        protection.remember(x, machine.N_r, y, Command<float, N>{}, protection.levels);
      }
    }
  }
  return most;
}

/// Magnetizes phase 0, and reports what it is told to.
struct Plain {
  using Scalar = float;
  static constexpr int n_phases = 3;
  struct State {
    Fault<float> fault;
    int starts = 0, steps = 0;
    float reference = 0;
  };
  struct Tuning {};
  Status found = Status::ok;  // at every sample of `run`
  bool stays = false;         // while the legs are off as well
  float omega_m = 0;          // that it has found itself
  Tuning tuning() const { return {}; }
  bool motors() const { return true; }
  float speed(const State&, const Measurement<float, 3>&) const { return omega_m; }
  void step(State& x, const Measurement<float, 3>&, float reference, Command<float, 3>& orders,
            Tuning) const {
    ++x.steps;
    x.reference = reference;
    x.fault.status = found;
    orders = {};
    orders[0] = hold<float>(Leg::magnetize);
  }
  void start(State& x) const { ++x.starts; }
  void watch(State& x, const Measurement<float, 3>&, Tuning) const {
    if (stays) x.fault.status = found;
  }
  void forget(State& x) const { x.fault = {}; }
  void lose(State& x) const { forget(x); }
  const Fault<float>& fault(const State& x) const { return x.fault; }
  bool latched(const State& x) const { return x.fault.status != Status::ok; }
};

/// A drive that is sampled at a full dc link.
struct Bench {
  Supervised<Plain> drive{.sequence = {.T_s = T_s,
                                       .u_ready = 100,
                                       .t_precharge = 1,
                                       .n_settle = 3,
                                       .n_calibrate = 4,
                                       .i_offset = 2,
                                       .t_command = 4.5F * T_s,
                                       .u_chop_on = 300,
                                       .u_chop_off = 290,
                                       .reference_max = 1,
                                       .omega_none = 100},
                          .control = {}};
  Supervised<Plain>::State x{};
  Request<float> ask{.enable = true};
  Command<float, 3> orders{};
  Outputs out{};
  int wrongly_bridged = 0;  // [samples]

  /// Samples until the state is reached, at most 20; each with a new command where one comes.
  int until(Mode mode, bool commands = true, float u_dc = 120) {
    Measurement<float, 3> y{.u_dc = u_dc};
    y.i.fill(0.5F);
    for (int n = 1; n <= 20; ++n) {
      ask.sequence += commands;
      out = drive.step(x, y, ask, orders);
      const Mode now = out.mode;
      const bool charged = now == Mode::calibrate || now == Mode::ready || now == Mode::run;
      wrongly_bridged += out.precharged != charged;
      if (out.mode == mode) return n;
    }
    return 99;
  }
  bool off() const {
    for (const PhaseCommand<float>& order : orders) {
      for (const Leg leg : order.leg) {
        if (leg != Leg::demagnetize) return false;
      }
    }
    return true;
  }
};

}  // namespace

int main() {
  const double turn = double(std::nextafter(two_pi<float>, 0.0F));
  check("3 phases: no angle is judged beyond a turn [rad]", double(greatest_angle<3>()), turn);
  check("5 phases", double(greatest_angle<5>()), turn);

  Bench b;
  check("off to precharge at once", std::abs(b.until(Mode::precharge) - 1), 0);
  check("precharge waits for the dc link", std::abs(b.until(Mode::calibrate, true, 90) - 99), 0);
  check("and for three good samples", std::abs(b.until(Mode::calibrate) - 3), 0);
  check("calibrate averages four", std::abs(b.until(Mode::ready) - 4), 0);
  check("no leg is on, the gates are off", !b.off() || b.out.gate_enable, 0);
  check("ready waits for a command", std::abs(b.until(Mode::run, false) - 99), 0);
  check("a command starts the control once", b.until(Mode::run) - b.x.control.starts, 0);
  check("and its order stands", b.off() || !b.out.gate_enable, 0);
  check("offset of the sensors [A]", double(std::fabs(b.x.states.offset[1] - 0.5F)), 1e-6);
  b.ask.reference = 0.5F;
  b.until(Mode::run);
  check("all torque at standstill, as the control sees it",
        double(std::fabs(b.x.control.reference - 0.5F)), 0);
  b.drive.control.omega_m = 97.5F;  // the board shows no speed
  b.until(Mode::run);
  check("half of it at the speed that the control has found",
        double(std::fabs(b.x.control.reference - 0.25F)), 1e-6);
  b.ask.reference = std::numeric_limits<float>::quiet_NaN();
  b.until(Mode::run);
  check("a reference that is no number is the protection's", !std::isnan(b.x.control.reference), 0);
  check("no command for 4.5 periods is a fault", std::abs(b.until(Mode::fault, false) - 5), 0);
  check("which switches off", !b.off() || b.out.gate_enable, 0);
  b.ask.clear = true;
  check("it does not clear while enabled", std::abs(b.until(Mode::off) - 99), 0);
  check("it is the first cause that stays", b.drive.fault(b.x).status != Status::command_timeout,
        0);
  b.ask.enable = false;
  check("it clears when it is not", std::abs(b.until(Mode::off) - 1), 0);
  b.ask = {.enable = true};
  check("the drive starts again", b.until(Mode::run) == 99 || b.x.control.starts != 2, 0);
  b.drive.control.found = Status::over_current;
  b.drive.control.stays = true;
  check("a fault of the control ends the run", std::abs(b.until(Mode::fault) - 1), 0);
  check("within that sample", !b.off() || b.out.gate_enable, 0);
  b.ask = {.clear = true};
  check("it stays while the cause does", std::abs(b.until(Mode::off) - 99), 0);
  b.drive.control.stays = false;
  check("and clears with it", std::abs(b.until(Mode::off) - 1), 0);
  b.drive.control.found = Status::ok;
  b.ask = {.enable = true};
  b.until(Mode::run);
  b.ask.tripped = true;
  check("a hardware trip is a fault", std::abs(b.until(Mode::fault) - 1), 0);
  check("of its own name", b.drive.fault(b.x).status != Status::hardware_trip, 0);
  check("the resistor is bridged while the dc link is charged", b.wrongly_bridged, 0);
  return failures != 0;
}
