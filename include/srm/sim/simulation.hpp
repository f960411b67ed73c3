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

#include "srm/sim/controller.hpp"
#include "srm/sim/gates.hpp"
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

/// All that changes from step to step but the state of the controller: a plain value.
template <int N>
struct Loop {
  std::array<Point<N>, 2> points;  // this one and the end of the step, in turns
  int here = 0;
  Integrals<N> sums;
  Gates<N> gates;
  AllLegs<N> legs;  // what the windings see
  Circuit<N> circuit;
  bool rated = false;     // the rates are those of this point and circuit
  bool prepared = false;  // what is due at this point is done
  double t = 0, t_sample = 0, t_course = 0, t_record = 0;  // now, and next [s]
  double theta_period = 0, theta_next = 0;  // next end of a period; next angle that matters [rad]
  int turns = 0;                            // direction in which theta_next is ahead; 0: unknown
  double h_fine = 1e300;                    // what a step may be, from the ones before [s]
  double tau_ref = 0;
  Learned<double> learned;  // of the controller, where it learns
  long samples = 0, steps = 0;
  Switchings switchings;
  Extremes extremes;
  RotorSensor::State rotor;
};

template <Motor M, int N>
class Simulation {
 public:
  using Snapshot = Loop<N>;

  /// The dc link starts at the voltage of its source. Without a controller, orders come from
  /// outside (`obey`).
  Simulation(Plant<M, N> plant, double t_dead, Sampling sampling, Controller<N> controller,
             Course reference, double theta_m, Resolution resolution)
      : plant_(std::move(plant)),
        t_dead_(t_dead),
        sampling_(sampling),
        controller_(std::move(controller)),
        reference_(std::move(reference)),
        resolution_(resolution) {
    if (!(resolution.record_every > 0)) now_.t_record = never<double>;
    at().x.theta_m = theta_m;
    at().x.omega_m = plant_.shaft.omega.at(0);
    at().x.u_dc = srm::start(plant_.source);
    now_.legs.fill(Leg::demagnetize);
    now_.circuit.paths = paths(plant_, now_.legs);
    follow_courses();
    now_.theta_period = next_period();
  }

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
  /// not taken, and then t_stop is returned. `look` goes the rest of the way. So a result does not
  /// depend on where a run is interrupted.
  double advance_whole(double t_stop, Rows& waveforms, Rows& periods) {
    const long last = now_.steps + slice / 10;
    while (now_.t < t_stop && !waveforms.full() && !periods.full() && now_.steps < last) {
      prepare(waveforms, periods);
      const bool may_pass = now_.t + resolution_.dt_max > t_stop;  // no step is longer
      const std::optional<Loop<N>> before = may_pass ? std::optional(now_) : std::nullopt;
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
  void look(double t_stop) {
    const long last = now_.steps + slice;
    while (now_.t < t_stop && now_.steps < last) {
      step(std::min({t_stop, now_.t_sample, now_.t_record, now_.t_course}));
    }
  }

  const State<N>& state() const { return at().x; }
  double t() const { return now_.t; }
  const Integrals<N>& integrals() const { return now_.sums; }
  const Switchings& switchings() const { return now_.switchings; }
  /// What the controller has learned by now.
  const Learned<double>& learned() const { return now_.learned; }
  /// Integration steps taken so far.
  long steps() const { return now_.steps; }

  /// What the sensors show now.
  Measurement<double, N> sense() {
    if (now_.t >= now_.t_course) follow_courses();
    return measured(plant_, x(), source_now(plant_, now_.legs, x(), now_.t).i.now, sampling_,
                    now_.samples, now_.rotor);
  }

  /// Orders from outside, at the instant of a sample. Instants within a billionth of a period of a
  /// multiple of it are that multiple, as in a loop with a controller.
  void obey(const Orders<N>& orders) {
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
    how(plant_, reference_);
    now_.t_course = now_.t;
    now_.rated = false;
  }

  const Loop<N>& snapshot() const { return now_; }
  void restore(const Loop<N>& s) { now_ = s; }

  /// The present instant as a row of the waveforms.
  Waveform<N> waveform() const {
    Waveform<N> row{.t = now_.t,
                    .theta_m = x().theta_m,
                    .omega_m = x().omega_m,
                    .u_dc = x().u_dc,
                    .tau_ref = now_.tau_ref,
                    .i = x().i};
    for (int k = 0; k < N; ++k) {
      row.i_ref[k] = command()[k].i_ref;
      row.leg[k] = static_cast<double>(now_.legs[k]);
      if (!conducts(now_.legs[k], x().i[k])) continue;
      const double theta_e = electrical_angle(plant_, x().theta_m, k);
      const Magnetics<double> m = plant_.machine.at(x().i[k], theta_e);
      row.u[k] = winding_voltage(plant_, now_.circuit, x(), k);
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
    if (interval > 0) now_.t_record = interval * std::round(now_.t / interval + 1);
  }

  /// The integrals so far, and the extremes since the last `close_period`.
  Period<N> period() const {
    return {.t = now_.t,
            .theta_m = x().theta_m,
            .omega_m = x().omega_m,
            .W_f = field_energy(plant_, x()),
            .W_dc = stored(plant_.source, x().u_dc),
            .switchings = now_.switchings,
            .extremes = now_.extremes,
            .integrals = now_.sums};
  }

  /// Adds them to the periods.
  void close_period(Rows& periods) {
    periods.add(period());
    now_.extremes = {};
  }

 private:
  static constexpr double shortest = 1e-15;  // no halving below: the numbers are none any more [s]

  static constexpr long slice = 20000;  // steps of one call of `advance`; some ten milliseconds

  Point<N>& at() { return now_.points[now_.here]; }
  const Point<N>& at() const { return now_.points[now_.here]; }
  Point<N>& end() { return now_.points[1 - now_.here]; }
  const State<N>& x() const { return at().x; }

  /// Courses over time step, if at all, at their points.
  void follow_courses() {
    State<N>& x = at().x;
    x.u_dc = forced(plant_.source, x.u_dc, now_.t);
    x.omega_m = forced(plant_.shaft, x.omega_m, now_.t);
    now_.t_course = std::min(next_change(plant_.source, now_.t), next_change(plant_.shaft, now_.t));
    now_.rated = false;
  }

  /// What is due at a point before the step that begins there; once a point.
  void prepare(Rows& waveforms, Rows& periods) {
    if (now_.prepared) return;
    if (now_.t >= now_.t_course) follow_courses();
    if (now_.t >= now_.t_sample) sample();
    settle();
    if (resolution_.record_every == 0 || now_.t >= now_.t_record) record(waveforms);
    if (std::abs(x().theta_m - now_.theta_period) <= angle_tolerance) {
      close_period(periods);
      now_.theta_period = next_period();
      now_.turns = 0;
    }
    now_.prepared = true;
  }

  void sample() {
    if (!controller_) {  // the orders of the last sample stay
      now_.t_sample = sampling_.T_s * static_cast<double>(++now_.samples);
      return;
    }
    const double i_source = source_now(plant_, now_.legs, x(), now_.t).i.now;
    take(controller_(measured(plant_, x(), i_source, sampling_, now_.samples, now_.rotor),
                     reference_.at(now_.t)));
  }

  void take(const Orders<N>& orders) {
    now_.tau_ref = orders.tau_ref;
    now_.learned = orders.learned;
    now_.gates.take(orders.command, sampling_.delay > 0, now_.t);
    now_.t_sample = sampling_.T_s * static_cast<double>(++now_.samples);
    now_.turns = 0;
    for (int k = 0; k < N; ++k) follow_window(k);
  }

  void follow_window(int k) {
    if (command()[k].gate == Gate::window) now_.gates.gate[k].inside = inside_window(k);
    follow(k);
  }

  void follow(int k) { now_.gates.follow(k, now_.t, x().i[k], t_dead_); }

  /// The switches do what they can by now, and the bridge makes of it what the windings see.
  void settle() {
    if (!now_.gates.settle(now_.t)) return;
    std::visit(
        [&](const auto& bridge) {
          const AllLegs<N> legs = bridge.legs(now_.gates.levels());
          bridge.count(now_.switchings, now_.legs, legs, x().u_dc, x().i);
          now_.legs = legs;
          now_.circuit.paths = paths(plant_, legs);
        },
        plant_.bridge);
    now_.rated = false;
  }

  int direction() const { return x().omega_m < 0 ? -1 : 1; }

  /// The electrical angle of phase k as the position compare sees it: by the same sensor.
  double sensed_angle(int k) const {
    const double error = plant_.machine.N_r * now_.rotor.error + sampling_.angle_offset;
    return wrap(electrical_angle(plant_, x().theta_m, k) + error);
  }

  /// An angle met within the tolerance counts as passed, in the direction of motion.
  bool inside_window(int k) const {
    const double theta_e = sensed_angle(k);
    return conducts(wrap(theta_e + direction() * 2 * plant_.machine.N_r * angle_tolerance),
                    command()[k].theta_on, command()[k].theta_off);
  }

  double next_period() const {
    const double pitch = two_pi<double> / plant_.machine.N_r;
    const double passed = std::round(x().theta_m / pitch);
    const bool near = std::abs(x().theta_m - passed * pitch) <= angle_tolerance;
    const double periods = near ? passed : x().theta_m / pitch;
    return pitch * (direction() < 0 ? std::ceil(periods) - 1 : std::floor(periods) + 1);
  }

  /// Nearest angle ahead that matters: the end of the period or an edge of a window.
  double next_angle() const {
    const double pitch = two_pi<double> / plant_.machine.N_r;
    double ahead = std::abs(now_.theta_period - x().theta_m);
    for (int k = 0; k < N; ++k) {
      if (command()[k].gate != Gate::window) continue;
      const double theta_e = sensed_angle(k);
      for (const double edge : {command()[k].theta_on, command()[k].theta_off}) {
        const double gap = wrap(direction() * (edge - theta_e)) / plant_.machine.N_r;
        ahead = std::min(ahead, gap > angle_tolerance ? gap : pitch);
      }
    }
    return x().theta_m + direction() * ahead;
  }

  using Spans = std::array<Span, N>;

  /// The currents between which nothing happens to phase k.
  Span span(int k) const {
    Span s = awaited(command()[k], now_.gates.gate[k]);
    if (now_.legs[k] != Leg::magnetize) s.below = std::max(s.below, 0.0);
    if constexpr (requires { i_last(plant_.machine); }) {  // the inductance has a kink there
      const double last = i_last(plant_.machine), gap = last - x().i[k];
      if (gap > kink_part * last) s.above = std::min(s.above, last);
      if (-gap > kink_part * last) s.below = std::max(s.below, last);
    }
    return s;
  }

  /// The first guard that the present rates lead to within a time h, and when.
  std::pair<Guard, double> expected(const Spans& spans, const Settled<N>& s, double h) const {
    Guard first;
    const auto consider = [&](const Guard& g, double left, double rate, double second) {
      const double reach = h * (std::abs(rate) + h * std::abs(second));
      if (!(std::abs(left) < reach && left * g.direction > 0)) return;
      const double t = arrival(left, rate, second);
      if (!(t < h)) return;
      first = g;
      h = t;
    };
    const Rates<N>& r = at().rates;
    for (int k = 0; k < N; ++k) {
      if (!s.circuit.flows[k]) continue;
      const bool falls = r.i[k].rate < 0;
      const Guard g{k, falls ? spans[k].below : spans[k].above, falls ? -1 : 1};
      consider(g, g.value - x().i[k], r.i[k].rate, s.d2i[k]);
    }
    consider({Guard::angle, now_.theta_next, direction()}, now_.theta_next - x().theta_m,
             x().omega_m, r.alpha.now);
    return {first, h};
  }

  /// The first guard that a step of length h to `end` meets, and about when; none has direction 0.
  /// A guard of `located` is left out: the step ends on it.
  std::pair<Guard, double> met(const Spans& spans, const Settled<N>& s, double h, int located) {
    Guard first;
    double soonest = 2;  // in parts of the step
    const auto consider = [&](const Guard& g, double now, double then) {
      const double before = g.direction * (g.value - now), after = g.direction * (g.value - then);
      if (after > 0 || after > before) return;
      const double when = before > 0 ? before / (before - after) : 0;
      if (when < soonest) {
        first = g;
        soonest = when;
      }
    };
    for (int k = 0; k < N; ++k) {
      if (!s.circuit.flows[k] || k == located) continue;
      const Moving &i0 = at().rates.i[k], &i1 = end().rates.i[k];
      double least = i1.now, most = i1.now;
      if (i0.rate * i1.rate < 0) {
        const double turn = extreme(i0, i1, h);
        least = std::min(least, turn);
        most = std::max(most, turn);
      }
      if (least <= spans[k].below) consider({k, spans[k].below, -1}, i0.now, least);
      if (most >= spans[k].above) consider({k, spans[k].above, 1}, i0.now, most);
    }
    if (located != Guard::angle) {
      consider({Guard::angle, now_.theta_next, direction()}, x().theta_m, end().x.theta_m);
    }
    if (located != Guard::link && !s.circuit.shorted) {
      consider({Guard::link, 0, -1}, x().u_dc, end().x.u_dc);
    }
    return {first, soonest * h};
  }

  /// Makes a step, that passes the guard, end on it.
  void locate(const Guard& g, double guess, const Settled<N>& s, Trial& y) {
    double lower = 0, upper = y.h;
    for (int round = 0; round < 60; ++round) {
      if (!(guess > lower && guess < upper)) guess = (lower + upper) / 2;
      y = srm::step(plant_, at(), s, resolution_.scale, guess, g, upper, end());
      if (y.landed) return;
      y = srm::step(plant_, at(), s, resolution_.scale, guess, Guard{}, guess, end());
      (distance(g, end().x) > 0 ? lower : upper) = guess;
      guess = 0;
    }
  }

  /// Magnetics and rates at the start of a step.
  Settled<N> settled() {
    Circuit<N>& circuit = now_.circuit;
    for (int k = 0; k < N; ++k) {
      const bool flows = conducts(now_.legs[k], x().i[k]);
      if (flows == circuit.flows[k]) continue;
      circuit.flows[k] = flows;
      if (flows) {
        at().jets[k] = plant_.machine.jet(x().i[k], electrical_angle(plant_, x().theta_m, k));
      }
      now_.rated = false;
    }
    const bool shorted = x().u_dc <= 0 && source_now(plant_, now_.legs, x(), now_.t).du_dc.now < 0;
    if (shorted != circuit.shorted) now_.rated = false;
    circuit.shorted = shorted;
    if (!now_.rated) {
      rates(plant_, x(), at().jets, circuit, {now_.t, now_.t}, at().rates);
      now_.rated = true;
    }
    Settled<N> s{.circuit = circuit, .t = now_.t, .d2i = {}};
    const Rates<N>& r = at().rates;
    for (int k = 0; k < N; ++k) {
      if (circuit.flows[k]) s.d2i[k] = bend(at().jets[k], r.i[k], r.v[k], r.omega_m);
    }
    return s;
  }

  /// One step towards t_limit, cut short at the first event.
  void step(double t_limit) {
    ++now_.steps;
    for (int k = 0; k < N; ++k) t_limit = std::min(t_limit, now_.gates.next_instant(k));
    const Settled<N> s = settled();
    if (now_.turns != direction()) {
      now_.theta_next = next_angle();
      now_.turns = direction();
    }
    Spans spans;
    for (int k = 0; k < N; ++k) {
      if (s.circuit.flows[k]) spans[k] = span(k);
    }

    const double omega_e = plant_.machine.N_r * std::abs(x().omega_m);
    const double h_max =
        std::min({t_limit - now_.t, resolution_.dt_max, longest_angle / omega_e, now_.h_fine});
    const auto [target, h_first] = expected(spans, s, h_max);
    const Scale& scale = resolution_.scale;
    Trial y = srm::step(plant_, at(), s, scale, h_first, target, h_max, end());
    while (!y.fine || y.spread > spread_part) {
      const double h = y.h / 2;
      if (h < shortest) break;
      now_.h_fine = h;
      y = srm::step(plant_, at(), s, scale, h, Guard{}, h, end());
    }
    if (y.h >= now_.h_fine / 2 && y.spread < spread_part / 8) now_.h_fine *= 2;
    Guard landed;
    if (y.landed) landed = target;
    // Each guard can be the first once; more often they are met only where numbers are none.
    for (int trials = 4 * N + 4; trials > 0; --trials) {
      const auto [g, guess] = met(spans, s, y.h, landed.k);
      if (g.direction == 0) break;
      locate(g, guess, s, y);
      landed = g;
    }

    const bool whole = landed.direction == 0 && y.h == t_limit - now_.t;
    now_.extremes.include(at().rates, end().rates, y.h);
    add(now_.sums, at().rates, end().rates, plant_.R, now_.tau_ref, y.h);
    now_.here = 1 - now_.here;
    now_.t = whole ? t_limit : now_.t + y.h;
    now_.prepared = false;
    if (landed.direction != 0) act_on(landed);
    for (int k = 0; k < N; ++k) {
      if (command()[k].gate == Gate::timer) follow(k);
    }
    settle();
  }

  void act_on(const Guard& met) {
    if (met.k == Guard::angle) {
      now_.turns = 0;
      for (int k = 0; k < N; ++k) {
        if (command()[k].gate == Gate::window) follow_window(k);
      }
      return;
    }
    if (met.k == Guard::link) {  // the diodes of the bridge conduct
      at().x.u_dc = 0;
      return;
    }
    const PhaseCommand<double>& c = command()[met.k];
    const GateState& gate = now_.gates.gate[met.k];
    const Span span = awaited(c, gate);
    const bool above = met.direction > 0;
    if (met.value != (above ? span.above : span.below)) return;  // no current, or the table's end
    now_.gates.order(met.k, after(c, gate, above), now_.t + t_dead_);
  }

  static constexpr double kink_part = 1e-7;  // of the table: a current this near its end is on it

  Plant<M, N> plant_;
  double t_dead_;  // of the switches [s]
  Sampling sampling_;
  Controller<N> controller_;
  Course reference_;
  Resolution resolution_;
  Loop<N> now_;
};

}  // namespace srm
