// The control laws against their own rules: a line per law, exit status 1 if any is broken.
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "srm/control/frame/speed_pi.hpp"
#include "srm/control/guard/guarded.hpp"
#include "srm/control/law/angles.hpp"
#include "srm/control/law/deadbeat.hpp"
#include "srm/control/law/ditc.hpp"
#include "srm/control/law/pwm_current.hpp"
#include "srm/control/law/torque_sharing.hpp"
#include "srm/machine/lehuy.hpp"
#include "within.hpp"

using namespace srm;

namespace {

template <Real T>
constexpr T rad(double degrees) {
  return static_cast<T>(degrees * 3.14159265358979323846 / 180);
}

template <Real T>
LeHuy<T> paper_machine() {
  return lehuy<T>(4, T(0.67e-3), T(23.62e-3), T(0.15e-3), T(450), T(0.468));
}

constexpr std::initializer_list<Shape> shapes = {Shape::linear, Shape::cubic, Shape::sinusoidal,
                                                 Shape::exponential, Shape::table};

/// A sharing with a table that overshoots one, as an optimised one may.
template <Real T>
Sharing<T> sharing_of(Shape shape, double on_deg, double ov_deg) {
  Sharing<T> s{.shape = shape, .theta_on = rad<T>(on_deg), .theta_ov = rad<T>(ov_deg)};
  for (int j = 0; j <= 32; ++j) {
    const double x = j / 32.0;
    s.table[j] = static_cast<T>(x + 0.2 * std::sin(6.283185307179586 * x * x));
  }
  s.table[32] = T(1);
  return s;
}

/// Laws with usual parameters for the paper's machine; current laws hold 80 A.
template <Real T, int N>
Conduction<T> conduction() {
  return {.theta_on = rad<T>(-10),
          .theta_off = rad<T>(360.0 / N + 20),
          .brake_on = rad<T>(340 - 360.0 / N),
          .brake_off = rad<T>(200)};
}
template <Real T, int N>
Angles<T, N> angles(AngleWatch watch, Leg chop) {
  return {.conduction = conduction<T, N>(),
          .reference = constant_current(T(80)),
          .i_band = T(2),
          .chop = chop,
          .watch = watch};
}
template <Real T, int N>
PwmCurrent<LeHuy<T>, N> pwm_current() {
  return {.machine = paper_machine<T>(),
          .R = T(0.72),
          .conduction = conduction<T, N>(),
          .reference = constant_current(T(80)),
          .bandwidth = T(6000),
          .T_s = T(20e-6)};
}
template <Real T, int N>
TorqueSharing<LeHuy<T>, N> torque_sharing(Shape shape) {
  return {.machine = paper_machine<T>(),
          .sharing = sharing_of<T>(shape, 10, 160 - 360.0 / N),
          .feasible = always_feasible<T>(),
          .guide = {},
          .R = T(0.72),
          .i_max = T(200),
          .i_band = T(1),
          .T_s = T(20e-6)};
}
template <Real T, int N>
Ditc<LeHuy<T>, N> ditc() {
  return {.machine = paper_machine<T>(),
          .conduction = conduction<T, N>(),
          .turn_on = {},
          .bands = {.inner = T(0.5), .outer = T(1)},
          .feasible = always_feasible<T>(),
          .guide = {},
          .psi_band = T(0),
          .R = T(0.72),
          .i_max = T(200),
          .T_s = T(5e-6)};
}
template <Real T, int N>
Deadbeat<LeHuy<T>, N> deadbeat(int delay, Carriers carriers) {
  return {.machine = paper_machine<T>(),
          .R = T(0.72),
          .sharing = sharing_of<T>(Shape::cubic, 10, 160 - 360.0 / N),
          .feasible = always_feasible<T>(),
          .guide = {},
          .i_max = T(200),
          .T_s = T(20e-6),
          .delay = delay,
          .carriers = carriers};
}

template <int N>
double worst_share_sum() {
  double worst = 0;
  for (Shape shape : shapes) {
    for (double ov : {1.0, 10.0, 160 - 360.0 / N}) {
      const Sharing<double> s = sharing_of<double>(shape, 15, ov);
      if (!s.is_feasible<N>()) worst = HUGE_VAL;
      for (int a = 0; a < 7200; ++a) {
        double sum = 0;
        for (int k = 0; k < N; ++k) {
          const double theta = phase_angle<N>(rad<double>(a / 20.0), k);
          const double share = s.share<N>(theta);
          if (share != 0 && !(theta > 0 && theta < pi<double>)) worst = HUGE_VAL;
          sum += share;
        }
        worst = std::fmax(worst, std::fabs(sum - 1));
      }
    }
  }
  return worst;
}

/// Torque of the machine at the commanded references, where none is at the limit.
template <Real T, int N>
double worst_shared_torque() {
  double worst = 0;
  for (Shape shape : shapes) {
    const TorqueSharing<LeHuy<T>, N> law = torque_sharing<T, N>(shape);
    typename TorqueSharing<LeHuy<T>, N>::State state;
    for (int a = 0; a < 720; ++a) {
      for (double tau_ref : {-60.0, -20.0, -0.5, 0.5, 5.0, 20.0, 41.3, 60.0}) {
        Measurement<T, N> y{.theta_e = rad<T>(a / 2.0)};
        const Command<T, N> command = law.step(state, y, static_cast<T>(tau_ref));
        double tau = 0;
        bool limited = false;
        for (int k = 0; k < N; ++k) {
          limited = limited || command[k].i_ref >= law.i_max;
          tau += paper_machine<double>()
                     .at(double(command[k].i_ref), phase_angle<N>(rad<double>(a / 2.0), k))
                     .tau;
        }
        if (!limited) worst = std::fmax(worst, std::fabs(tau / tau_ref - 1));
      }
    }
  }
  return worst;
}

/// A phase at standstill: u = R i + L_inc di/dt by explicit Euler; no current below zero.
struct Coil {
  double i = 0, tau = 0;
  Leg leg = Leg::demagnetize;

  void advance(double theta_e, double u_dc, double dt) {
    const Magnetics<double> at = paper_machine<double>().at(i, theta_e);
    tau = at.tau;
    i = std::fmax(0, i + dt * (static_cast<int>(leg) * u_dc - 0.72 * i) / at.L_inc);
  }

  template <Real T>
  void obey(const PhaseCommand<T>& c, T theta_e, T t) {
    if (c.gate == Gate::timer) {
      int edges = 0;
      while (edges < max_edges && t >= c.t_edge[edges]) ++edges;
      leg = c.leg[edges];
    } else if (!(c.i_ref > 0) ||
               (c.gate == Gate::window && !conducts(theta_e, c.theta_on, c.theta_off))) {
      leg = Leg::demagnetize;
    } else if (i < double(c.i_ref - c.i_band)) {
      leg = Leg::magnetize;
    } else if (i > double(c.i_ref + c.i_band)) {
      leg = c.chop;
    } else if (leg == Leg::demagnetize && c.chop == Leg::freewheel) {
      leg = Leg::freewheel;
    }
  }
};

/// From zero current, locked, at every degree and in both directions: the shortfall of the mean
/// torque of the last of 2 ms, relative to the reference.
template <class Law>
double worst_start(const Law& law) {
  using T = typename Law::Scalar;
  constexpr int N = Law::n_phases;
  double least = HUGE_VAL;
  for (int a = 0; a < 360; ++a) {
    for (double tau_ref : {20.0, -20.0}) {
      std::array<Coil, N> coil;
      typename Law::State state;
      Measurement<T, N> y{.theta_e = rad<T>(a), .u_dc = T(540)};
      Command<T, N> command;
      double sum = 0;
      for (int n = 0; n < 1000; ++n) {
        if (n % 10 == 0) {  // a sample is 20 us, a step 2 us
          for (int k = 0; k < N; ++k) y.i[k] = static_cast<T>(coil[k].i);
          command = law.step(state, y, static_cast<T>(tau_ref));
        }
        for (int k = 0; k < N; ++k) {
          const T theta = phase_angle<N>(y.theta_e, k);
          coil[k].obey(command[k], theta, static_cast<T>(n % 10 * 2e-6));
          coil[k].advance(static_cast<double>(theta), 540, 2e-6);
          if (n >= 500) sum += coil[k].tau;
        }
      }
      least = std::fmin(least, sum / 500 / tau_ref);
    }
  }
  return 1 - least;
}

template <class Law>
void check_start(const char* name, const Law& law) {
  static_assert(ControlLaw<Law>);
  char line[80];
  std::snprintf(line, sizeof line, "start, %d phases: %s", Law::n_phases, name);
  check(line, worst_start(law), 0.5);
}

template <int N>
void check_starts() {
  using T = float;
  const auto watch = AngleWatch::sampled;
  check_start("angles, compare, soft", angles<T, N>(AngleWatch::compare, Leg::freewheel));
  check_start("angles, sampled, hard", angles<T, N>(watch, Leg::demagnetize));
  check_start("PI current, PWM", pwm_current<T, N>());
  for (Shape shape : shapes) {
    char name[40];
    std::snprintf(name, sizeof name, "torque sharing, shape %d", static_cast<int>(shape));
    check_start(name, torque_sharing<T, N>(shape));
  }
  check_start("DITC", ditc<T, N>());
  check_start("deadbeat", deadbeat<T, N>(0, Carriers::in_phase));
  check_start("deadbeat, delay, interleaved", deadbeat<T, N>(1, Carriers::interleaved));
}

/// The rule table of ditc.hpp again, as rows of text: legs +, 0, - or last (k).
double ditc_mismatches() {
  const TorqueBands<double> bands{.inner = 1, .outer = 2};
  const char* rows[3] = {"++k0-", "+++k0", "+0k--"};
  const Leg legs[3] = {Leg::demagnetize, Leg::freewheel, Leg::magnetize};
  int mismatches = 0;
  for (int role = 0; role < 3; ++role) {
    for (int level = 0; level < 5; ++level) {
      for (Leg last : legs) {
        const char rule = rows[role][level];
        Leg expected = rule == '+'   ? Leg::magnetize
                       : rule == '0' ? Leg::freewheel
                       : rule == '-' ? Leg::demagnetize
                                     : last;
        if (role == 0 && level == 2 && last == Leg::demagnetize) expected = Leg::freewheel;
        const double excess = 1.5 * (level - 2);
        if (bands.leg(static_cast<Role>(role), excess, last) != expected) ++mismatches;
      }
    }
  }
  return mismatches;
}

/// Roles: at 60 deg of phase 0 it is alone; at 115 deg phase 0 goes out and phase 1 (at -5) comes
/// in.
double ditc_role_mismatches() {
  const Ditc<LeHuy<double>, 3> law = ditc<double, 3>();
  int mismatches = 0;
  const auto legs_are = [&](double degrees, double i_0, double tau_ref,
                            std::array<Leg, 3> expected) {
    Ditc<LeHuy<double>, 3>::State state;
    Measurement<double, 3> y{
        .i = {i_0}, .theta_e = rad<double>(degrees), .omega_m = 100, .u_dc = 540};
    if (tau_ref < 0)
      y = {.i = {i_0}, .theta_e = rad<double>(360 - degrees), .omega_m = -100, .u_dc = 540};
    law.step(state, y, tau_ref);
    if (state.leg != expected) ++mismatches;
  };
  const Leg up = Leg::magnetize, down = Leg::demagnetize;
  legs_are(60, 0, 20, {up, down, down});
  legs_are(60, 100, 20, {down, down, down});
  legs_are(115, 0, 20, {up, up, down});
  legs_are(115, 100, 20, {down, Leg::freewheel, down});
  legs_are(115, 100, -20, {down, down, Leg::freewheel});
  legs_are(60, 0, 0, {down, down, down});
  return mismatches;
}

/// A rotor held for 10 s, then released: the overshoot [rad/s] beside that without the hold.
double windup() {
  const SpeedPi<double> pi_law{.K_p = 0.5, .K_i = 5, .tau_min = -10, .tau_max = 10, .T_s = 1e-3};
  double peak[2];
  for (int held : {0, 1}) {
    SpeedPi<double>::State state;
    if (held) {
      for (int n = 0; n < 10000; ++n) pi_law.step(state, 100, 0);
    }
    double omega = 0;
    peak[held] = 0;
    for (int n = 0; n < 3000; ++n) {
      omega += 1e-3 * pi_law.step(state, 100, omega) / 0.02;
      peak[held] = std::fmax(peak[held], omega);
    }
  }
  return std::fabs(peak[1] - peak[0]);
}

/// Current references, float against double, relative to i_max. The two may differ by a last Newton
/// step that one of them takes and the other does not, hence the bound of 0.5 %.
double worst_float_difference() {
  double worst = 0;
  for (Shape shape : shapes) {
    const auto law_f = torque_sharing<float, 3>(shape);
    const auto law_d = torque_sharing<double, 3>(shape);
    TorqueSharing<LeHuy<float>, 3>::State state_f;
    TorqueSharing<LeHuy<double>, 3>::State state_d;
    for (int a = 0; a < 3600; ++a) {
      const float theta = rad<float>(a / 10.0);
      const auto c_f = law_f.step(state_f, {.theta_e = theta}, 41.3F);
      const auto c_d = law_d.step(state_d, {.theta_e = double(theta)}, double(41.3F));
      for (int k = 0; k < 3; ++k) {
        worst = std::fmax(worst, std::fabs(double(c_f[k].i_ref) - c_d[k].i_ref) / law_d.i_max);
      }
    }
  }
  return worst;
}

double worst_float_duty() {
  double worst = 0;
  const auto law_f = deadbeat<float, 3>(1, Carriers::in_phase);
  const auto law_d = deadbeat<double, 3>(1, Carriers::in_phase);
  Deadbeat<LeHuy<float>, 3>::State state_f;
  Deadbeat<LeHuy<double>, 3>::State state_d;
  for (int a = 0; a < 3600; ++a) {
    const float theta = rad<float>(a / 10.0);
    Measurement<float, 3> y_f{.theta_e = theta, .omega_m = 157, .u_dc = 540};
    Measurement<double, 3> y_d{.theta_e = double(theta), .omega_m = 157, .u_dc = 540};
    for (int k = 0; k < 3; ++k) {
      y_f.i[k] = static_cast<float>(a * (k + 1) % 90);
      y_d.i[k] = double(y_f.i[k]);
    }
    law_f.step(state_f, y_f, 41.3F);
    law_d.step(state_d, y_d, double(41.3F));
    for (int k = 0; k < 3; ++k) {
      worst = std::fmax(worst, std::fabs(double(state_f.duty[k]) - state_d.duty[k]));
    }
  }
  return worst;
}

/// The protection judges the speed that is measured or, where an observer follows the rotor, that
/// of the observer.
double judged_speed() {
  DriveControl<PwmCurrent<LeHuy<double>, 3>> control{.law = pwm_current<double, 3>()};
  control.frame.tracker.N_r = 4;
  decltype(control)::State x{};
  x.frame.tracker.omega_e = 4 * 300;
  x.frame.tracker.near = true;
  const Measurement<double, 3> y{.omega_m = 100, .u_dc = 240};
  constexpr Uses none{.observer = false};
  double worst = 0;
  for (const bool tracked : {false, true}) {
    control.frame.motion = tracked ? Motion::tracked : Motion::measured;
    worst += std::fabs(judged<Uses{}>(control, x, y).omega_m - (tracked ? 300 : 100));
    worst += std::fabs(judged<none>(control, x, y).omega_m - 100);
  }
  return worst;
}

}  // namespace

int main() {
  check("sharing: shares sum to one, 3 phases", worst_share_sum<3>(), 1e-12);
  check("sharing: shares sum to one, 4 phases", worst_share_sum<4>(), 1e-12);
  check("sharing: shares sum to one, 5 phases", worst_share_sum<5>(), 1e-12);
  check("sharing: shares sum to one, 6 phases", worst_share_sum<6>(), 1e-12);
  check("sharing: torque of the references, double, 3 phases", worst_shared_torque<double, 3>(),
        5e-3);
  check("sharing: torque of the references, float, 3 phases", worst_shared_torque<float, 3>(),
        5e-3);
  check("sharing: torque of the references, float, 4 phases", worst_shared_torque<float, 4>(),
        5e-3);
  check("sharing: torque of the references, float, 6 phases", worst_shared_torque<float, 6>(),
        5e-3);
  check("sharing: current references, float against double", worst_float_difference(), 5e-3);
  check("DITC: legs that differ from the rule table", ditc_mismatches(), 0);
  check("DITC: legs that differ from the zones", ditc_role_mismatches(), 0);
  check("deadbeat: duty, float against double", worst_float_duty(), 1e-2);
  check("protection: the speed that is judged [rad/s]", judged_speed(), 1e-9);
  check("speed PI: overshoot after a hold against without [rad/s]", windup(), 0.5);
  check_starts<3>();
  check_starts<4>();
  check_starts<5>();
  check_starts<6>();
  return failures == 0 ? 0 : 1;
}
