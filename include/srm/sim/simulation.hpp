// The loop in which plant and control meet.
//
// Between two events the plant is smooth and integrated by Runge-Kutta steps. An event is a sample,
// a timer edge or the end of a dead time (all known in time), a current that meets a comparator
// threshold or zero, an angle that meets a window edge or the end of an electrical period (located
// on the step). So no result depends on how the steps fall.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "srm/plant/dead_time.hpp"
#include "srm/sim/controller.hpp"
#include "srm/sim/gate.hpp"
#include "srm/sim/guard.hpp"
#include "srm/sim/recorder.hpp"
#include "srm/sim/sampling.hpp"

namespace srm {

/// How finely a run is computed and kept.
struct Resolution {
  double dt_max;        // longest integration step [s]
  Scale scale;          // currents and voltages are resolved to a small part of this
  double record_every;  // waveform interval [s]; 0: every solver point and event; < 0: nothing
  SRM_FIELDS(dt_max, scale, record_every)
};

template <Machine M, int N>
class Simulation {
 public:
  /// The dc link starts at the voltage of its source. Without a controller, orders come from
  /// outside
  /// (`obey`).
  Simulation(Plant<M, N> plant, double t_dead, Sampling sampling, Controller<N> controller,
             Course reference, double theta_m, Resolution resolution)
      : plant_(std::move(plant)),
        t_dead_(t_dead),
        sampling_(sampling),
        controller_(std::move(controller)),
        reference_(std::move(reference)),
        resolution_(resolution),
        t_record_(resolution.record_every > 0 ? 0 : never<double>) {
    at_.x.theta_m = theta_m;
    at_.x.omega_m = plant_.shaft.omega.at(0);
    at_.x.u_dc = srm::start(plant_.source);
    legs_.fill(Leg::demagnetize);
    follow_courses();
    theta_period_ = next_period();
  }

  /// Runs until t_stop, or until a table is full or many steps are taken: then empty both and call
  /// again. Returns the time reached.
  double advance(double t_stop, Rows& waveforms, Rows& periods) {
    const long last = steps_ + slice;
    while (t_ < t_stop && !waveforms.full() && !periods.full() && steps_ < last) {
      prepare(waveforms, periods);
      step(std::min({t_stop, t_sample_, t_record_, t_course_}));
      ++steps_;
    }
    return t_;
  }

  /// The same by the steps of a run that stops nowhere: the first step that would pass t_stop is
  /// not taken, and then t_stop is returned. `look` goes the rest of the way. So a result does not
  /// depend on where a run is interrupted.
  double advance_whole(double t_stop, Rows& waveforms, Rows& periods) {
    const long last = steps_ + slice / 10;
    while (t_ < t_stop && !waveforms.full() && !periods.full() && steps_ < last) {
      prepare(waveforms, periods);
      std::optional<Snapshot> before;
      if (t_ + resolution_.dt_max > t_stop) before = snapshot();  // no step is longer
      step(std::min({t_sample_, t_record_, t_course_}));
      ++steps_;
      if (t_ > t_stop) {
        restore(*before);
        return t_stop;
      }
    }
    return t_;
  }

  /// To t_stop by a shorter step, after `advance_whole` has returned it: for what is seen there.
  /// Whoever wants to go on with whole steps restores the snapshot from before. Ends like `advance`
  /// where a step does not get on.
  void look(double t_stop) {
    const long last = steps_ + slice;
    while (t_ < t_stop && steps_ < last) {
      step(std::min({t_stop, t_sample_, t_record_, t_course_}));
      ++steps_;
    }
  }

  const State<N>& state() const { return at_.x; }
  double t() const { return t_; }
  const Integrals<N>& integrals() const { return at_.q; }
  const Switchings& switchings() const { return switchings_; }
  /// Integration steps taken so far.
  long steps() const { return steps_; }

  /// What the sensors show now.
  Measurement<double, N> sense() {
    if (t_ >= t_course_) follow_courses();
    return measured(plant_, at_.x, source_now(plant_, legs_, at_.x, t_).i, sampling_, samples_,
                    rotor_);
  }

  /// Orders from outside, at the instant of a sample. Instants within a billionth of a period of a
  /// multiple of it are that multiple, as in a loop with a controller.
  void obey(const Orders<N>& orders) {
    if (t_ >= t_course_) follow_courses();
    samples_ = static_cast<long>(t_ / sampling_.T_s + 1e-9);
    take(orders);
    settle();
  }

  /// The orders in effect.
  const Command<double, N>& command() const { return command_; }

  /// Lets `change` alter plant and reference from outside; courses are followed anew.
  template <class F>
  void change(const F& how) {
    how(plant_, reference_);
    t_course_ = t_;
  }

  /// All that changes from step to step but the state of the controller: a plain value.
  struct Snapshot {
    Point<N> at;
    std::array<GateState, N> gates;
    std::array<SwitchedLeg, N> switches;
    AllLegs<N> legs;
    bool shorted, prepared;
    Command<double, N> command, pending;
    double t, t_sample, t_course, t_orders, t_record, theta_period, tau_ref;
    long samples, steps;
    Switchings switchings;
    Extremes extremes;
    RotorSensor::State rotor;
  };
  Snapshot snapshot() const {
    return {at_,      gates_,   switches_, legs_,       shorted_,  prepared_, command_,
            pending_, t_,       t_sample_, t_course_,   t_orders_, t_record_, theta_period_,
            tau_ref_, samples_, steps_,    switchings_, extremes_, rotor_};
  }
  void restore(const Snapshot& s) {
    at_ = s.at;
    gates_ = s.gates;
    switches_ = s.switches;
    legs_ = s.legs;
    shorted_ = s.shorted;
    prepared_ = s.prepared;
    command_ = s.command;
    pending_ = s.pending;
    t_ = s.t;
    t_sample_ = s.t_sample;
    t_course_ = s.t_course;
    t_orders_ = s.t_orders;
    t_record_ = s.t_record;
    theta_period_ = s.theta_period;
    tau_ref_ = s.tau_ref;
    samples_ = s.samples;
    steps_ = s.steps;
    switchings_ = s.switchings;
    extremes_ = s.extremes;
    rotor_ = s.rotor;
  }

  /// The present instant as a row of the waveforms.
  Waveform<N> waveform() const {
    Waveform<N> row{.t = t_,
                    .theta_m = at_.x.theta_m,
                    .omega_m = at_.x.omega_m,
                    .u_dc = at_.x.u_dc,
                    .tau_ref = tau_ref_,
                    .i = at_.x.i};
    for (int k = 0; k < N; ++k) {
      row.i_ref[k] = command_[k].i_ref;
      row.leg[k] = static_cast<double>(legs_[k]);
      if (!conducts(legs_[k], at_.x.i[k])) continue;
      const double theta_e = electrical_angle(plant_, at_.x.theta_m, k);
      const Magnetics<double> m = plant_.machine.at(at_.x.i[k], theta_e);
      row.u[k] = winding_voltage(plant_, legs_, at_.x, k);
      row.psi[k] = m.psi;
      row.tau_ph[k] = m.tau;
      row.tau += m.tau;
    }
    return row;
  }

  /// Adds the present instant to the waveforms.
  void record(Rows& waveforms) {
    waveforms.add(waveform());
    const double interval = resolution_.record_every;
    if (interval > 0) t_record_ = interval * std::round(t_ / interval + 1);
  }

  /// The integrals so far, and the extremes since the last `close_period`.
  Period<N> period() const {
    return {.t = t_,
            .theta_m = at_.x.theta_m,
            .omega_m = at_.x.omega_m,
            .W_f = field_energy(plant_, at_.x),
            .W_dc = stored(plant_.source, at_.x.u_dc),
            .switchings = switchings_,
            .extremes = extremes_,
            .integrals = at_.q};
  }

  /// Adds them to the periods.
  void close_period(Rows& periods) {
    periods.add(period());
    extremes_ = {};
  }

 private:
  // A step is halved while its midpoints are apart by more than this part of the current scale. At
  // 2e-5 a single pulse that collapses near alignment (1.6e6 A/s into the knee) is right to 3e-6 of
  // its peak with steps of 50 us, and the rated point costs 4 % more; at 6e-5, 5e-6 and 0.4 %.
  static constexpr double spread_part = 2e-5;
  static constexpr double shortest = 1e-15;  // no halving below: the numbers are none any more [s]

  // Longest step in electrical angle [rad], for the magnetisation changes with the angle however
  // smooth the currents are. Single pulses from 500 to 10 000 rpm are right to 4e-7 of their peak
  // at 10 us; at 0.0126, 8e-6. At 1500 rpm and four rotor poles the longest step stays 10 us.
  static constexpr double longest_angle = 0.0065;

  static constexpr long slice = 20000;  // steps of one call of `advance`; some ten milliseconds

  /// Courses over time step, if at all, at their points.
  void follow_courses() {
    at_.x.u_dc = forced(plant_.source, at_.x.u_dc, t_);
    at_.x.omega_m = forced(plant_.shaft, at_.x.omega_m, t_);
    t_course_ = std::min(next_change(plant_.source, t_), next_change(plant_.shaft, t_));
  }

  /// What is due at a point before the step that begins there; once a point.
  void prepare(Rows& waveforms, Rows& periods) {
    if (prepared_) return;
    if (t_ >= t_course_) follow_courses();
    if (t_ >= t_sample_) sample();
    settle();
    if (resolution_.record_every == 0 || t_ >= t_record_) record(waveforms);
    if (std::abs(at_.x.theta_m - theta_period_) <= angle_tolerance) {
      close_period(periods);
      theta_period_ = next_period();
    }
    prepared_ = true;
  }

  void sample() {
    if (!controller_) {  // the orders of the last sample stay
      t_sample_ = sampling_.T_s * static_cast<double>(++samples_);
      return;
    }
    const double i_source = source_now(plant_, legs_, at_.x, t_).i;
    take(controller_(measured(plant_, at_.x, i_source, sampling_, samples_, rotor_),
                     reference_.at(t_)));
  }

  void take(const Orders<N>& orders) {
    tau_ref_ = orders.tau_ref;
    command_ = sampling_.delay > 0 ? std::exchange(pending_, orders.command) : orders.command;
    t_orders_ = t_;
    t_sample_ = sampling_.T_s * static_cast<double>(++samples_);
    for (int k = 0; k < N; ++k) {
      gates_[k].edges = 0;
      gates_[k].inside = inside_window(k);
      follow_orders(k);
    }
  }

  /// Brings the leg of phase k to what the orders ask for now.
  void follow_orders(int k) {
    int& edges = gates_[k].edges;
    while (edges < max_edges && t_orders_ + command_[k].t_edge[edges] <= t_) ++edges;
    order(k, ordered(command_[k], gates_[k], at_.x.i[k]));
  }

  void order(int k, Leg leg) {
    if (leg == gates_[k].leg) return;
    delay_turn_on(switches_[k], gates_[k].leg, leg, t_ + t_dead_);
    gates_[k].leg = leg;
  }

  /// The switches do what the gates order, as far as dead time lets them by now, and the bridge
  /// makes of it what the windings see.
  void settle() {
    bool changed = false;
    for (int k = 0; k < N; ++k) {
      if (!lags(k)) continue;
      const Leg leg = reached(switches_[k], gates_[k].leg, t_);
      changed = changed || leg != switches_[k].leg;
      switches_[k].leg = leg;
    }
    if (!changed) return;
    AllLegs<N> levels;
    for (int k = 0; k < N; ++k) levels[k] = switches_[k].leg;
    std::visit(
        [&](const auto& bridge) {
          const AllLegs<N> legs = bridge.legs(levels);
          bridge.count(switchings_, legs_, legs, at_.x.u_dc, at_.x.i);
          legs_ = legs;
        },
        plant_.bridge);
  }

  /// True while a dead time of phase k runs.
  bool lags(int k) const { return switches_[k].leg != gates_[k].leg; }

  int direction() const { return at_.x.omega_m < 0 ? -1 : 1; }

  /// The electrical angle of phase k as the position compare sees it: by the same sensor.
  double sensed_angle(int k) const {
    const double error = plant_.machine.N_r * rotor_.error + sampling_.angle_offset;
    return wrap(electrical_angle(plant_, at_.x.theta_m, k) + error);
  }

  /// An angle met within the tolerance counts as passed, in the direction of motion.
  bool inside_window(int k) const {
    const double theta_e = sensed_angle(k);
    return conducts(wrap(theta_e + direction() * 2 * plant_.machine.N_r * angle_tolerance),
                    command_[k].theta_on, command_[k].theta_off);
  }

  double next_period() const {
    const double pitch = two_pi<double> / plant_.machine.N_r;
    const double passed = std::round(at_.x.theta_m / pitch);
    const bool near = std::abs(at_.x.theta_m - passed * pitch) <= angle_tolerance;
    const double periods = near ? passed : at_.x.theta_m / pitch;
    return pitch * (direction() < 0 ? std::ceil(periods) - 1 : std::floor(periods) + 1);
  }

  /// Nearest angle ahead that matters: the end of the period or an edge of a window.
  double next_angle() const {
    const double pitch = two_pi<double> / plant_.machine.N_r;
    double ahead = std::abs(theta_period_ - at_.x.theta_m);
    for (int k = 0; k < N; ++k) {
      if (command_[k].gate != Gate::window) continue;
      const double theta_e = sensed_angle(k);
      for (const double edge : {command_[k].theta_on, command_[k].theta_off}) {
        const double gap = wrap(direction() * (edge - theta_e)) / plant_.machine.N_r;
        ahead = std::min(ahead, gap > angle_tolerance ? gap : pitch);
      }
    }
    return at_.x.theta_m + direction() * ahead;
  }

  /// Calls consider(guard) for each guard that is waited for. A guard of `located` is left out.
  template <class F>
  void for_guards(double theta_next, int located, const F& consider) const {
    for (int k = 0; k < N; ++k) {
      const Leg leg = legs_[k];
      if (k == located || !conducts(leg, at_.x.i[k])) continue;
      if (leg != Leg::magnetize) consider(Guard{k, 0, -1, gates_[k].leg});
      for (const Crossing& c : awaited(command_[k], gates_[k])) {
        if (c.direction != 0) consider(Guard{k, c.i, c.direction, c.then});
      }
      if constexpr (requires { i_last(plant_.machine); }) {  // the inductance has a kink there
        const double last = i_last(plant_.machine), gap = last - at_.x.i[k];
        if (std::abs(gap) > kink_part * last) {
          consider(Guard{k, last, gap > 0 ? 1 : -1, gates_[k].leg});
        }
      }
    }
    if (located != Guard::angle) consider(Guard{Guard::angle, theta_next, direction()});
    if (located != Guard::link && !shorted_) consider(Guard{Guard::link, 0, -1});
  }

  /// The first guard that a step to `end` meets, by linear estimate; none has direction 0. A guard
  /// of `located` is left out: the step ends on it.
  Guard first_met(const State<N>& end, double theta_next, int located) const {
    Guard first;
    double soonest = 2;  // in parts of the step
    for_guards(theta_next, located, [&](const Guard& g) {
      const double before = distance(g, at_.x), after = distance(g, end);
      if (after > 0 || after > before) return;
      const double when = before > 0 ? before / (before - after) : 0;
      if (when < soonest) {
        first = g;
        soonest = when;
      }
    });
    return first;
  }

  /// The first guard that the present slope k1 leads to, and when; none has direction 0.
  std::pair<Guard, double> ahead(const Point<N>& k1, double theta_next) const {
    Guard first;
    double soonest = 1e300;  // [s]
    for_guards(theta_next, nobody, [&](const Guard& g) {
      const double left = distance(g, at_.x), v = approach(g, k1);
      if (left <= 0 || v >= 0 || left >= -v * soonest) return;
      first = g;
      soonest = -left / v;
    });
    return {first, soonest};
  }

  /// One step towards t_limit, cut short at the first event.
  void step(double t_limit) {
    Settled<N> settled{.circuit = {.leg = legs_}, .tau_ref = tau_ref_, .t = t_};
    for (int k = 0; k < N; ++k) {
      settled.circuit.flows[k] = conducts(legs_[k], at_.x.i[k]);
      if (lags(k)) t_limit = std::min(t_limit, next_rise(switches_[k]));
      const int edges = gates_[k].edges;
      if (command_[k].gate == Gate::timer && edges < max_edges) {
        t_limit = std::min(t_limit, t_orders_ + command_[k].t_edge[edges]);
      }
    }
    shorted_ = at_.x.u_dc <= 0 && source_now(plant_, legs_, at_.x, t_).du_dc < 0;
    settled.circuit.shorted = shorted_;
    const Point<N> k1 = slope(plant_, at_.x, settled, 0);
    extremes_.include(at_.x, k1.q.tau);

    const Scale& scale = resolution_.scale;
    const double theta_next = next_angle();
    const double omega_e = plant_.machine.N_r * std::abs(at_.x.omega_m);
    const double h_max = std::min({t_limit - t_, resolution_.dt_max, longest_angle / omega_e});
    const auto [expected, when] = ahead(k1, theta_next);
    const bool expects = expected.direction != 0 && when < h_max;
    double h = expects ? when : h_max;
    Trial<N> trial = runge_kutta(plant_, at_, k1, settled, scale, h);
    while (trial.spread > spread_part && h > shortest) {
      h /= 2;
      trial = runge_kutta(plant_, at_, k1, settled, scale, h);
    }
    Point<N>& end = trial.end;
    double t_end = h == t_limit - t_ ? t_limit : t_ + h;
    Guard met;
    if (expects && h == when) {  // most events: the step ends on what its slope leads to
      const double landed = land(plant_, at_, k1, settled, expected, h, h_max, end);
      if (landed > 0) {
        h = landed;
        t_end = t_ + h;
        met = expected;
      }
    }
    // Each guard can be the first once; more often they are met only where numbers are none.
    int trials = 4 * N + 4;
    for (Guard g = first_met(end.x, theta_next, met.direction != 0 ? met.k : nobody);
         g.direction != 0 && trials > 0; g = first_met(end.x, theta_next, g.k), --trials) {
      h = locate(plant_, at_, k1, settled, scale, g, h, end);
      t_end = t_ + h;
      met = g;
    }
    at_ = end;
    t_ = t_end;
    prepared_ = false;
    if (met.direction != 0) act_on(met);
    for (int k = 0; k < N; ++k) {
      if (command_[k].gate == Gate::timer) follow_orders(k);
    }
    settle();
  }

  void act_on(const Guard& met) {
    if (met.k == Guard::angle) {
      for (int k = 0; k < N; ++k) {
        if (command_[k].gate != Gate::window) continue;
        gates_[k].inside = inside_window(k);
        follow_orders(k);
      }
      return;
    }
    if (met.k == Guard::link) {
      at_.x.u_dc = 0;  // the diodes of the bridge conduct
      return;
    }
    if (met.value == 0) at_.x.i[met.k] = 0;  // the diodes block
    order(met.k, met.then);
  }

  static constexpr int nobody = -2;
  static constexpr double kink_part = 1e-7;  // of the table: a current this near its end is on it

  Plant<M, N> plant_;
  double t_dead_;  // of the switches [s]
  Sampling sampling_;
  RotorSensor::State rotor_;
  Controller<N> controller_;
  Course reference_;
  Resolution resolution_;

  Point<N> at_;
  std::array<GateState, N> gates_;
  std::array<SwitchedLeg, N> switches_;
  AllLegs<N> legs_;        // what the windings see
  bool shorted_ = false;   // the diodes of the bridge hold the dc link at zero
  bool prepared_ = false;  // what is due at this point is done
  Command<double, N> command_, pending_;
  double t_ = 0, t_sample_ = 0, t_course_ = 0, t_orders_ = 0, t_record_;
  double theta_period_ = 0;
  long samples_ = 0, steps_ = 0;
  double tau_ref_ = 0;
  Switchings switchings_;
  Extremes extremes_;
};

}  // namespace srm
