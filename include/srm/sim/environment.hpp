// A drive that is stepped from outside: an action is held for a control period, and each period has
// a price. What environments for learning are made of.
//
// The price of a period adds what `reluctance compare` holds against each other, as means over the
// period: the squared error, the copper loss, and how often the switches turn on.
#pragma once

#include <cmath>
#include <optional>

#include "srm/control/part/modulator.hpp"
#include "srm/sim/simulation.hpp"

namespace srm {

/// A machine with flux_factor times the flux linkage at every current and angle.
template <Machine M>
struct Scaled {
  using Scalar = typename M::Scalar;

  M model;
  int N_r;             // rotor poles
  Scalar flux_factor;  // [1]
  SRM_FIELDS(model, N_r, flux_factor)

  constexpr Magnetics<Scalar> at(Scalar i, Scalar theta_e) const {
    Magnetics<Scalar> m = model.at(i, theta_e);
    m.psi *= flux_factor;
    m.W_c *= flux_factor;
    m.tau *= flux_factor;
    m.L_inc *= flux_factor;
    m.psi_theta *= flux_factor;
    return m;
  }

  constexpr Jet<double> jet(double i, double theta_e) const {
    Jet<double> m = model.jet(i, theta_e);
    for (double* each : {&m.psi, &m.tau, &m.L_inc, &m.psi_theta, &m.tau_theta, &m.L_i, &m.L_theta,
                         &m.psi_theta_2}) {
      *each *= flux_factor;
    }
    return m;
  }
};

template <Machine M>
constexpr auto i_last(const Scaled<M>& machine) -> decltype(i_last(machine.model)) {
  return i_last(machine.model);
}

/// What an action says of each phase: a leg state, the mean winding voltage over u_dc, or a current
/// reference over the current limit.
enum class Action : std::int8_t { legs, duties, currents };

/// What is asked of the drive: a torque, pulses of current, or a speed.
enum class Task : std::int8_t { torque, current, speed };

/// All that an episode begins with; any number of it may differ from episode to episode.
template <Machine M, int N>
struct Episode {
  Plant<Scaled<M>, N> plant;
  double theta_m;    // rotor angle at the start [rad]
  double reference;  // torque [N m], top of the current pulses [A], or speed [rad/s]
  SRM_FIELDS(plant, theta_m, reference)
};

/// What is the same in all episodes.
struct Rules {
  Task task;
  Action action;
  double t_dead;  // of the switches [s]
  Sampling sampling;
  Resolution resolution;
  Comparators comparators;
  double i_band;                     // half width, of current references as action [A]
  double theta_on, theta_off;        // of the current pulses that are asked for [rad]
  double i_max, u_dc, omega_m, tau;  // one in the observation [A], [V], [rad/s], [N m]
  double i_trip, omega_trip;         // an episode ends beyond them [A], [rad/s]
  double error_price;                // of a squared relative error [1]
  double copper_price;               // [1/W]
  double switching_price;            // of a turn-on per switch and second [s]
  double trip_price;                 // of an episode that ends so [1]
  SRM_FIELDS(task, action, t_dead, sampling, resolution, comparators, i_band, theta_on, theta_off,
             i_max, u_dc, omega_m, tau, i_trip, omega_trip, error_price, copper_price,
             switching_price, trip_price)
};

/// Where a loop puts rows that nobody reads: one for any number of drives.
template <int N>
struct Unread {
  Rows waveforms{columns_of(Waveform<N>{}), 1}, periods{columns_of(Period<N>{}), 2};
};

/// One drive among many that share their rules.
template <Motor M, int N>
class Environment {
 public:
  /// Numbers of an observation: currents, cosine and sine of the electrical angle, speed, voltage,
  /// the last action, and the reference, of each phase where currents are asked for.
  static constexpr int observed(Task task) { return 2 * N + 4 + (task == Task::current ? N : 1); }
  static constexpr double most_observed = 2;  // in parts of what counts as one

  void start(const Episode<M, N>& episode, const Rules& rules) {
    Plant<Scaled<M>, N> plant = episode.plant;
    plant.coupling.factor *= plant.machine.flux_factor;
    loop_.emplace(std::move(plant), rules.t_dead, rules.sampling, Controller<N>(), Course(),
                  episode.theta_m, rules.resolution);
    reference_ = episode.reference;
    R_ = episode.plant.R;
    n_switches_ = std::visit([](const auto& b) { return b.n_switches(N); }, episode.plant.bridge);
    last_ = {};
    n_ = 0;
    tripped_ = false;
    seen_ = loop_->sense();
  }

  /// What the sensors show, each number in parts of what counts as one, within `most_observed`.
  void observe(const Rules& rules, float* to) const {
    const auto put = [&to](double value) {
      *to++ = static_cast<float>(clamp(value, -most_observed, most_observed));
    };
    for (int k = 0; k < N; ++k) put(seen_.i[k] / rules.i_max);
    put(std::cos(seen_.theta_e));
    put(std::sin(seen_.theta_e));
    put(seen_.omega_m / rules.omega_m);
    put(seen_.u_dc / rules.u_dc);
    for (int k = 0; k < N; ++k) put(last_[k]);
    if (rules.task == Task::torque) put(reference_ / rules.tau);
    if (rules.task == Task::speed) put(reference_ / rules.omega_m);
    if (rules.task == Task::current) {
      for (int k = 0; k < N; ++k) put(asked(rules, k) / rules.i_max);
    }
  }

  /// Holds an action of N numbers over a control period. Returns the price of the period.
  double step(const double* action, const Rules& rules, Unread<N>& rows) {
    Orders<N> orders;
    for (int k = 0; k < N; ++k) {
      last_[k] = action[k];
      orders.command[k] = ordered(action[k], rules);
    }
    return obey(orders, rules, rows);
  }

  /// The same with the orders of a control law.
  double obey(Orders<N> orders, const Rules& rules, Unread<N>& rows) {
    std::array<double, N> wanted{};
    if (rules.task == Task::current) {
      for (int k = 0; k < N; ++k) wanted[k] = asked(rules, k);
    }
    if (rules.task == Task::torque) orders.tau_ref = reference_;
    const Figures before = figures();
    const double T_s = rules.sampling.T_s, end = T_s * static_cast<double>(++n_);
    loop_->obey(orders);
    do {
      rows.periods.clear();
      loop_->advance(end, rows.waveforms, rows.periods);
    } while (rows.periods.full());
    seen_ = loop_->sense();
    tripped_ = !(loop_->t() >= end) || !within(rules);

    const Figures now = figures();
    const double p_cu = (now.E_cu - before.E_cu) / T_s;
    const double f_switch = (now.turn_ons - before.turn_ons) / (n_switches_ * T_s);
    const double error = squared_error(rules, now.error_squared - before.error_squared, wanted);
    return rules.error_price * error + rules.copper_price * p_cu +
           rules.switching_price * f_switch + (tripped_ ? rules.trip_price : 0);
  }

  /// True where the last period ended beyond the trip levels, or without meaning.
  bool tripped() const { return tripped_; }

  /// Since the start: what a period is priced by, and what is shown of an episode.
  struct Figures {
    double t;              // [s]
    double tau;            // [N m s]
    double error_squared;  // of the torque [N^2 m^2 s]
    double E_cu;           // copper loss [J]
    double E_mech, E_dc;   // at the shaft, from the dc link [J]
    double turn_ons;       // of all switches
    SRM_FIELDS(t, tau, error_squared, E_cu, E_mech, E_dc, turn_ons)
  };
  Figures figures() const {
    const Integrals<N>& q = loop_->integrals();
    double i_squared = 0;
    for (const double one : q.i_squared) i_squared += one;
    return {loop_->t(),
            q.tau,
            q.error_squared,
            R_ * i_squared,
            q.E_mech,
            q.E_dc,
            loop_->switchings().turn_ons};
  }

  /// What a control law is given: the last sample and the reference.
  const Measurement<double, N>& seen() const { return seen_; }
  double reference() const { return reference_; }

 private:
  PhaseCommand<double> ordered(double action, const Rules& rules) const {
    switch (rules.action) {
      case Action::legs:
        return hold<double>(action > 0   ? Leg::magnetize
                            : action < 0 ? Leg::demagnetize
                                         : Leg::freewheel);
      case Action::duties:
        return modulate(action, rules.sampling.T_s);
      case Action::currents:
        break;
    }
    PhaseCommand<double> order = regulate(action * rules.i_max, rules.i_band);
    set_thresholds(order, rules.comparators);
    return order;
  }

  /// The current that is asked for in phase k now [A].
  double asked(const Rules& rules, int k) const {
    const double theta_e = phase_angle<N>(seen_.theta_e, k);
    return conducts(theta_e, rules.theta_on, rules.theta_off) ? reference_ : 0;
  }

  /// Relative, over the last period.
  double squared_error(const Rules& rules, double torque_error_squared,
                       const std::array<double, N>& wanted) const {
    const auto squared = [](double x) { return x * x; };
    switch (rules.task) {
      case Task::torque:
        return torque_error_squared / (rules.sampling.T_s * squared(rules.tau));
      case Task::speed:
        return squared((loop_->state().omega_m - reference_) / rules.omega_m);
      case Task::current:
        break;
    }
    double sum = 0;
    for (int k = 0; k < N; ++k) sum += squared((loop_->state().i[k] - wanted[k]) / rules.i_max);
    return sum / N;
  }

  bool within(const Rules& rules) const {
    bool within = std::abs(loop_->state().omega_m) <= rules.omega_trip;
    for (const double i : loop_->state().i) within = within && i <= rules.i_trip;
    return within;
  }

  std::optional<Simulation<Scaled<M>, N>> loop_;
  Measurement<double, N> seen_;
  std::array<double, N> last_{};  // action
  double reference_ = 0, R_ = 0;
  int n_switches_ = 1;
  long n_ = 0;  // periods since the start
  bool tripped_ = false;
};

}  // namespace srm
