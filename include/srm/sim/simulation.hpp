// The loop in which plant and control meet.
//
// Between two events the plant is smooth and integrated by steps of Hermite's rule. An event is a
// sample, a timer edge or the end of a dead time (all known in time), a current that meets a
// comparator threshold or zero, an angle that meets a window edge or the end of an electrical
// period (the step ends there). So no result depends on how the steps fall.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "srm/sim/present_rows.hpp"
#include "srm/sim/sampling.hpp"
#include "srm/sim/step_start.hpp"
#include "srm/sim/switching.hpp"
#include "srm/sim/threshold.hpp"

namespace srm {

/// How finely a run is computed and kept.
struct Resolution {
  double dt_max;        // longest integration step [s]
  Scale scale;          // currents and voltages are resolved to a small part of this
  double record_every;  // waveform interval [s]; 0: every solver point and event; < 0: nothing
  SRM_FIELDS(dt_max, scale, record_every)
};

template <Motor M, int N>
class Simulation {
 public:
  using Snapshot = SimulationState<N>;

  /// The dc link starts at the voltage of its source. Without a controller, orders come from
  /// outside (`obey`). At most `most_faults`.
  Simulation(Plant<M, N> plant, double t_dead, Sampling sampling, Controller<N> controller,
             Course reference, double theta_m, Resolution resolution,
             std::vector<BrokenPart> faults = {})
      : plant_(std::move(plant)),
        t_dead_(t_dead),
        sampling_(sampling),
        controller_(std::move(controller)),
        reference_(std::move(reference)),
        resolution_(resolution),
        faults_(std::move(faults)) {
    if (!(resolution.record_every > 0)) now_.t_record = never<double>;
    at().x.theta_m = theta_m;
    at().x.omega_m = plant_.shaft.omega.at(0);
    at().x.u_dc = srm::start(plant_.source);
    now_.legs.fill(Leg::demagnetize);
    now_.circuit.paths = paths(plant_, now_.legs);
    follow_courses();
    begin_period();
  }

  // The main loop, in words; `prepare` is what is due at a point, `step` is the way to the next.
  //
  //   until t_stop
  //     where a course changes     read source and shaft; can the phases step independently?
  //     where a fault begins       the condition of the drive becomes another one
  //     at a sample                measure, ask the controller, pass its orders to the gates
  //     at an instant to record    add a waveform row
  //     at the end of a period     add the integrals so far to the periods
  //     the end of the step is the first of: sample, record, course, timer edge, end of a dead time
  //     phases independent:        each by steps of its own; stop where the first of them ends
  //     else all phases together:  guess which threshold, zero or angle comes first; step to it
  //                                halve the step until it is fine
  //                                while another event lies within it, locate that one, step to it
  //     add the step to the integrals; carry currents, speed, angle and dc-link voltage over
  //     at an event                comparators and windows order new legs, after the dead time
  //     switches that are due      the bridge makes legs and current paths of them

  /// Runs until t_stop, or until a table is full or many steps are taken: then empty both and call
  /// again. Returns the time reached.
  double advance(double t_stop, Rows& waveforms, Rows& periods) {
    const long last = now_.steps + slice;
    while (now_.t < t_stop && !waveforms.full() && !periods.full() && now_.steps < last) {
      prepare(waveforms, periods);
      step(std::min({t_stop, now_.t_sample, now_.t_record, now_.t_course}));
    }
    return now_.t;
  }

  /// The same by the steps of a run that stops nowhere: the first step that would pass t_stop is
  /// not taken, and then t_stop is returned. `peek` goes the rest of the way. So a result does not
  /// depend on where a run is interrupted.
  double advance_whole(double t_stop, Rows& waveforms, Rows& periods) {
    const long last = now_.steps + slice / 10;
    while (now_.t < t_stop && !waveforms.full() && !periods.full() && now_.steps < last) {
      prepare(waveforms, periods);
      const bool may_pass = now_.t + resolution_.dt_max > t_stop;  // no step is longer
      const std::optional<SimulationState<N>> before =
          may_pass ? std::optional(now_) : std::nullopt;
      step(std::min({now_.t_sample, now_.t_record, now_.t_course}));
      if (now_.t > t_stop) {
        now_ = *before;
        return t_stop;
      }
    }
    return now_.t;
  }

  /// To t_stop by a shorter step, after `advance_whole` has returned it: for what is seen there.
  /// Whoever wants to go on with whole steps restores the snapshot from before. Ends like `advance`
  /// where a step does not get on.
  void peek(double t_stop) {
    const long last = now_.steps + slice;
    while (now_.t < t_stop && now_.steps < last) {
      step(std::min({t_stop, now_.t_sample, now_.t_record, now_.t_course}));
    }
    finish_all();
  }

  bool within_step() const { return now_.within_step(); }
  const State<N>& state() const { return at().x; }
  double t() const { return now_.t; }
  const Integrals<N>& integrals() const { return now_.sums; }
  const Switchings& switchings() const { return now_.switchings; }
  /// What the controller has learned by now.
  const Learned<double>& learned() const { return now_.learned; }
  /// When the faults of the list have begun, the last time each; infinity where none has [s].
  std::vector<double> onsets() const {
    std::vector<double> t(faults_.size());
    for (std::size_t j = 0; j < t.size(); ++j) t[j] = now_.onset[j].t;
    return t;
  }
  /// Integration steps taken so far.
  long steps() const { return now_.steps; }

  /// What the sensors show now.
  Measurement<double, N> sense() {
    if (now_.t >= now_.t_course) follow_courses();
    const double i_source = source_now(plant_, now_.circuit, x(), now_.t).i.now;
    const State<N> seen = faultless() ? x() : shown(plant_, now_);
    return measured(plant_, seen, i_source, sampling_, now_.samples, now_.rotor);
  }

  /// Orders from outside, at the instant of a sample. Instants within a billionth of a period of a
  /// multiple of it are that multiple, as in a loop with a controller.
  void obey(const Orders<N>& orders) {
    finish_all();
    if (now_.t >= now_.t_course) follow_courses();
    now_.samples = static_cast<long>(now_.t / sampling_.T_s + 1e-9);
    take(orders);
    settle();
  }

  /// The orders in effect.
  const Command<double, N>& command() const { return now_.gates.command; }

  /// Lets `change` alter plant and reference from outside; courses are followed anew.
  template <class F>
  void change(const F& how) {
    finish_all();
    how(plant_, reference_);
    pieces_.assign(plant_.coupling.n_pairs(), {});
    now_.circuit.paths = paths(plant_, now_.legs);
    if (!faultless()) connect_all(plant_, now_, small_current());
    now_.t_course = now_.t;
    now_.rated = false;
  }

  const SimulationState<N>& snapshot() const { return now_; }
  void restore(const SimulationState<N>& s) { now_ = s; }

  /// The present instant as a row of the waveforms.
  Waveform<N> waveform() const { return srm::waveform(plant_, now_); }
  FollowedWaveform<N> followed_waveform() const { return {waveform(), now_.estimate}; }

  /// Adds the present instant to the waveforms.
  void record(Rows& waveforms) {
    if (waveforms.columns() == columns_of(FollowedWaveform<N>{})) {
      waveforms.add(followed_waveform());
    } else {
      waveforms.add(waveform());
    }
    const double interval = resolution_.record_every;
    if (interval > 0) now_.t_record = interval * std::round(now_.t / interval + 1);
  }

  /// The integrals so far, and the extremes since the last `close_period`.
  Period<N> period() const { return srm::period(plant_, now_); }

  /// Adds them to the periods.
  void close_period(Rows& periods) {
    periods.add(period());
    now_.extremes = {};
  }

 private:
  static constexpr long slice = 20000;  // steps of one call of `advance`; some ten milliseconds

  Instant<N>& at() { return now_.at(); }
  const Instant<N>& at() const { return now_.at(); }
  Instant<N>& end() { return now_.end(); }
  const State<N>& x() const { return at().x; }

  /// No fault is present, and none is to come.
  bool faultless() const { return faults_.empty(); }

  /// The faults that are present by now.
  void follow_faults() {
    bool changed = false;
    for (std::size_t j = 0; j < faults_.size(); ++j) {
      const BrokenPart& part = faults_[j];
      Onset& onset = now_.onset[j];
      const bool present = is_present(plant_, now_, part, j);
      if (present == onset.present) continue;
      changed = true;
      onset = {present, present ? shown_by(plant_, now_, part) : 0, present ? now_.t : onset.t};
    }
    if (!changed) return;
    finish_all();
    now_.condition = {};
    for (std::size_t j = 0; j < faults_.size(); ++j) {
      if (now_.onset[j].present) now_.condition.add(faults_[j], plant_.R, now_.onset[j].kept);
    }
    now_.condition.complete();
    now_.circuit.leak = {};
    now_.circuit.leaks = now_.condition.leaks;
    connect_all(plant_, now_, small_current());
    follow_channels();
    now_.turns = 0;
  }

  /// What the comparators see. A leak steps with the voltage; their filters hold it over a sample.
  void follow_channels() {
    for (int k = 0; k < N; ++k) now_.compared[k] = channel(plant_, now_, k);
  }

  /// Courses over time step, if at all, at their points.
  void follow_courses() {
    if (!faultless()) follow_faults();
    State<N>& x = at().x;
    x.u_dc = forced(plant_.source, x.u_dc, now_.t);
    x.omega_m = forced(plant_.shaft, x.omega_m, now_.t);
    now_.t_course = std::min({next_change(plant_.source, now_.t), next_change(plant_.shaft, now_.t),
                              next_fault(faults_, now_.t)});
    now_.rated = false;
    if (now_.independent) {
      for (int k = 0; k < N; ++k) at().jets[k] = now_.phase_steps[k].end.m;
    }
    const bool apart = !now_.condition.leaks && !now_.condition.crossed;
    now_.independent = apart && independent(plant_, x, now_.t);
    if (now_.independent) {
      now_.omega_e = plant_.machine.N_r * x.omega_m;
      now_.h_most = std::min(resolution_.dt_max, longest_angle / std::abs(now_.omega_e));
      for (int k = 0; k < N; ++k) now_.phase_steps[k].end.m = at().jets[k];
    }
    now_.turns = 0;
  }

  /// What is due at a point before the step that begins there; once a point.
  void prepare(Rows& waveforms, Rows& periods) {
    if (now_.prepared) return;
    if (now_.t >= now_.t_course) follow_courses();
    if (now_.t >= now_.t_sample) {
      sample();
      settle();
    }
    if (resolution_.record_every == 0 || now_.t >= now_.t_record) record(waveforms);
    if (now_.period_ends()) {
      // The end of one phase's step may lie so near that the others are still within theirs, whose
      // integrals would be missing from this period and too many in the next.
      if (now_.within_step()) finish_all();
      close_period(periods);
      begin_period();
      now_.turns = 0;
    }
    now_.prepared = true;
  }

  void sample() {
    if (!controller_) {  // the orders of the last sample stay
      now_.t_sample = sampling_.T_s * static_cast<double>(++now_.samples);
      return;
    }
    Orders<N> orders = controller_(sense(), reference_.at(now_.t));
    if (!faultless()) {
      follow_channels();
      const Command<double, N> given = orders.command;
      for (int k = 0; k < N; ++k) orders.command[k] = given[now_.condition.phase[k].ordered];
    }
    take(orders);
  }

  void take(const Orders<N>& orders) {
    now_.tau_ref = orders.tau_ref;
    now_.learned = orders.learned;
    now_.estimate = orders.estimate;
    if (orders.at_once) now_.gates.pending = orders.command;
    now_.gates.take(orders.command, sampling_.delay > 0 && !orders.at_once, now_.t);
    now_.t_sample = sampling_.T_s * static_cast<double>(++now_.samples);
    bool windows = false;
    for (int k = 0; k < N; ++k) {
      // A course that has come to zero may leave a rounding of it: no comparator regulates that.
      PhaseCommand<double>& order = now_.gates.command[k];
      if (order.i_ref < zero_current_part * resolution_.scale.i) order.i_ref = 0;
      windows = windows || order.gate == Gate::window;
      follow_window(k);
    }
    if (windows || now_.windows) now_.turns = 0;
    now_.windows = windows;
  }

  void follow_window(int k) {
    if (command()[k].gate == Gate::window) {
      const Condition<N>& is = now_.condition;
      const double theta_m = is.rotor.at(x().theta_m);
      const double theta_e = electrical_angle(plant_, theta_m, is.phase[k].ordered);
      now_.gates.gate[k].inside = sensed().inside(command()[k], theta_e);
    }
    follow(k);
  }

  void follow(int k) { now_.gates.follow(k, now_.t, compared_current(now_, k), t_dead_); }

  /// The switches do what they can by now, and the bridge makes of it what the windings see.
  void settle() { srm::settle(plant_, now_, small_current()); }

  double small_current() const { return 1e-9 * resolution_.scale.i; }

  int direction() const { return now_.direction(); }

  SensedAngle sensed() const {
    const int N_r = plant_.machine.N_r;
    const int shown = now_.condition.rotor.slope < 0 ? -direction() : direction();
    return {N_r, shown, N_r * now_.rotor.error + sampling_.angle_offset};
  }

  void begin_period() {
    now_.theta_period = next_period(plant_, now_);
    const double pitch = two_pi<double> / plant_.machine.N_r;
    now_.theta_begun = now_.theta_period - (direction() < 0 ? 0 : pitch);
  }

  /// What comes next in the direction of motion; the rotor may have turned back since a period
  /// began.
  void look_ahead() {
    if ((now_.theta_period - x().theta_m) * direction() < 0) begin_period();
    now_.theta_next = next_angle(plant_, now_, sensed(), faults_);
    now_.turns = direction();
  }

  /// One step towards t_limit, cut short at the first event.
  void step(double t_limit) {
    ++now_.steps;
    if (t_limit <= now_.t) {  // something is due here
      now_.prepared = false;
    } else if (now_.independent) {
      step_independent(t_limit);
    } else {
      step_together(t_limit);
    }
  }

  /// All phases by the same step.
  void step_together(double t_limit) {
    for (int k = 0; k < N; ++k) t_limit = std::min(t_limit, now_.gates.next_instant(k));
    const StepStart<N> s = step_start(plant_, now_, pieces_, small_current());
    if (now_.turns != direction()) look_ahead();
    Spans<N> spans;
    for (int k = 0; k < N; ++k) {
      if (s.circuit.flows[k]) spans[k] = span(plant_, now_, k, resolution_.scale.i);
    }

    const double omega_e = plant_.machine.N_r * std::abs(x().omega_m);
    const double h_max =
        std::min({t_limit - now_.t, resolution_.dt_max, longest_angle / omega_e, now_.h_fine});
    const Guard angle{Guard::angle, now_.theta_next, direction()};
    const auto [target, h_first] = expected(at(), spans, s, angle, h_max);
    const Scale& scale = resolution_.scale;
    Trial y = srm::step(plant_, at(), s, scale, h_first, target, h_max, end());
    while (!y.fine || y.spread > spread_part) {
      const double h = y.h / 2;
      if (h < shortest_step) break;
      now_.h_fine = h;
      y = srm::step(plant_, at(), s, scale, h, Guard{}, h, end());
    }
    if (y.h >= now_.h_fine / 2 && y.spread < spread_part / 8) now_.h_fine *= 2;
    Guard landed;
    if (y.landed) landed = target;
    // Each guard can be the first once; more often they are met only where numbers are none.
    for (int trials = 4 * N + 4; trials > 0; --trials) {
      const auto [g, guess] = met(at(), end(), spans, s, angle, y.h, landed.k);
      if (g.direction == 0) break;
      locate(plant_, at(), s, scale, g, guess, y, end());
      landed = g;
    }
    const bool opens = plant_.coupling.any() && ends_on_opening(plant_, at(), s, scale, y, end());
    if (opens) landed = {};

    const bool whole = landed.direction == 0 && y.h == t_limit - now_.t;
    now_.extremes.include(at().rates, end().rates, y.h);
    add(now_.sums, at().rates, end().rates, plant_.R, now_.tau_ref, y.h);
    if (plant_.coupling.any()) {
      int on = 0;
      for (const bool flows : s.circuit.flows) on += flows;
      if (on > 2) now_.sums.three_on += y.h;
    }
    now_.here = 1 - now_.here;
    if (plant_.coupling.any()) {
      for (double& i : at().x.i) i = std::max(i, 0.0);
    }
    if (opens) now_.rated = false;
    arrive(whole ? t_limit : now_.t + y.h);
    if (landed.direction != 0) act_on(landed);
    for (int k = 0; k < N; ++k) {
      if (command()[k].gate == Gate::timer) follow(k);
    }
    settle();
  }

  /// The end of a step, before anything switches there.
  void arrive(double t) {
    now_.t = t;
    now_.prepared = false;
    if (now_.period_ends()) now_.before_end = now_.switchings;
  }

  void act_on(const Guard& met) {
    if (met.k == Guard::angle) {
      now_.turns = 0;
      if (!faultless()) now_.t_course = now_.t;  // a fault may begin here
      for (int k = 0; k < N; ++k) {
        if (command()[k].gate == Gate::window) follow_window(k);
      }
      return;
    }
    if (met.k == Guard::link) {  // the diodes of the bridge conduct
      at().x.u_dc = 0;
      return;
    }
    compare(now_, met, now_.t + t_dead_);
  }

  /// Begins a step of phase k here, or anew where it began; it ends by t_limit.
  [[gnu::always_inline]] void begin_step(int k, double t_limit) {
    PhaseStep& phase = now_.phase_steps[k];
    const State<N>& x = this->x();
    const double t_end = std::min(t_limit, now_.gates.next_instant(k));
    if (conducts(now_.legs[k], x.i[k]) != now_.circuit.flows[k]) flow(plant_, now_, pieces_, k);
    if (!now_.circuit.flows[k]) {
      phase.t1 = t_end;
      return;
    }
    const Path& path = now_.circuit.paths.phase[k];
    const double omega_m = x.omega_m;
    const Given g{path.level * x.u_dc - path.v, path.R, omega_m, now_.omega_e};
    double theta_m = x.theta_m - now_.theta_begun;  // spares a division
    if (phase.active) {
      theta_m -= omega_m * (now_.t - phase.t0);
    } else {
      phase.t0 = now_.t;
      phase.start.m = phase.end.m;
      phase.start.i.now = x.i[k];
      rate(phase.start, g);
      phase.tau = phase.start.tau;
      phase.i = phase.start.i;
    }
    const double theta_e = electrical_angle(plant_, theta_m, k);
    const double i_scale = resolution_.scale.i;
    advance_phase(plant_.machine, g, theta_e, k, span(plant_, now_, k, i_scale), i_scale, t_end,
                  now_.h_most, phase);
  }

  /// The step of phase k has ended.
  void finish(int k, State<N>& x) {
    PhaseStep& phase = now_.phase_steps[k];
    add(now_.sums, phase, k, now_.circuit.paths.phase[k].level * x.u_dc, plant_.R);
    now_.extremes.include(phase.start.i, phase.end.i, phase.t1 - phase.t0);
    x.i[k] = phase.end.i.now;
    phase.active = false;
    now_.rated = false;
    if (phase.met.direction != 0) compare(now_, phase.met, now_.t + t_dead_);
  }

  /// Ends the steps of all phases here.
  void finish_all() {
    for (int k = 0; k < N; ++k) {
      PhaseStep& phase = now_.phase_steps[k];
      if (phase.active && phase.t0 < now_.t) {
        begin_step(k, now_.t);
        finish(k, at().x);
      }
      phase.active = false;
      phase.t1 = now_.t;
    }
    settle();
  }

  /// Every phase by steps of its own: to the first instant at which one of them ends.
  void step_independent(double t_limit) {
    State<N>& x = at().x;
    if (now_.turns == 0) {
      look_ahead();
      // Never at standstill, whichever sign its zero has.
      now_.t_angle = now_.t + std::abs(now_.theta_next - x.theta_m) / std::abs(x.omega_m);
      now_.extremes.include_held(x);
    }
    t_limit = std::min(t_limit, now_.t_angle);
    double t = std::min(t_limit, now_.t + resolution_.dt_max);
    for (int k = 0; k < N; ++k) {
      PhaseStep& phase = now_.phase_steps[k];
      if (phase.t1 <= now_.t || phase.t1 > t_limit) begin_step(k, t_limit);
      t = std::min(t, phase.t1);
    }

    const double h = t - now_.t;
    const bool arrived = t == now_.t_angle;
    x.theta_m = arrived ? now_.theta_next : x.theta_m + h * x.omega_m;
    arrive(t);
    Moving tau0, tau1, i0, i1;
    for (int k = 0; k < N; ++k) {
      PhaseStep& phase = now_.phase_steps[k];
      const bool ended = phase.t1 == t;
      if (phase.active) {
        tau0 += phase.tau;
        phase.tau = ended ? phase.end.tau : phase.within(t, &PhasePoint::tau);
        tau1 += phase.tau;
        const double level = now_.circuit.paths.phase[k].level;
        i0 += level * phase.i;
        phase.i = ended ? phase.end.i : phase.within(t, &PhasePoint::i);
        i1 += level * phase.i;
        if (ended) finish(k, x);
      }
      if (ended) {
        if (command()[k].gate == Gate::timer) follow(k);
        srm::settle(plant_, now_, k, small_current());
      }
    }
    now_.extremes.include_torque(tau0, tau1, h);
    add_capacitor(now_.sums, -i0, -i1, h);
    now_.sums.E_mech += x.omega_m * add_torque(now_.sums, tau0, tau1, now_.tau_ref, h);
    if (arrived) {
      act_on({Guard::angle});
      settle();
    }
  }

  Plant<M, N> plant_;
  double t_dead_;  // of the switches [s]
  Sampling sampling_;
  Controller<N> controller_;
  Course reference_;
  Resolution resolution_;
  std::vector<BrokenPart> faults_;
  SimulationState<N> now_;
  PairPieces pieces_ = PairPieces(plant_.coupling.n_pairs());
};

}  // namespace srm
