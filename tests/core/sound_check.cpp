// Parameters that would divide by zero or leave a table are refused by name, and those at the edge
// of what can run are not.
#include <cmath>
#include <functional>
#include <string_view>
#include <vector>

#include "any_pairs.hpp"
#include "errors.hpp"
#include "srm/c_api/sound.hpp"
#include "srm/control/law/deadbeat.hpp"
#include "srm/control/law/finite_set_mpc.hpp"
#include "srm/machine/lehuy.hpp"
#include "within.hpp"

using namespace srm;
using c_api::fault;

namespace {

using M = LeHuy<double>;

/// What is said of a value once it is changed: null where it can run.
template <class S>
class Said {
 public:
  explicit Said(S sound, std::function<const char*(const S&)> of)
      : sound_(std::move(sound)), of_(std::move(of)) {
    fine([](S&) {});
  }
  void fine(const std::function<void(S&)>& change) { expect(change, nullptr); }
  void refused(const std::function<void(S&)>& change, const char* name) { expect(change, name); }
  double worst = 0;

 private:
  void expect(const std::function<void(S&)>& change, const char* name) {
    S changed = sound_;
    change(changed);
    const char* said = of_(changed);
    const bool same =
        said == nullptr || name == nullptr ? said == name : std::string_view(said) == name;
    worst = worst_of({worst, unless(same)});
  }
  S sound_;
  std::function<const char*(const S&)> of_;
};
template <class S>
Said<S> said(const S& sound) {
  return Said<S>(sound, [](const S& s) { return fault(s); });
}

double guides() {
  static double
      values[6 * 2 * 3 * 4];  // up to six sets of two speeds, of three rows and four columns
  static const double omega[] = {1, 2};
  static const std::uint8_t mirrored[] = {0, 2, 1, 3};
  using Guide = ReferenceProfile<double>;
  Said<Guide> s(Guide{{{values, 24}, 3, 4, 5}, {omega, 2}, 200, 0},
                [](const Guide& g) { return fault(g, 3); });
  s.refused([](Guide& g) { g.first.rows = 1; }, "guide");
  s.fine([](Guide& g) { g.first.rows = 2, g.first.columns = 6; });
  s.fine([](Guide& g) { g.first.rows = 12, g.first.columns = 1; });
  s.refused([](Guide& g) { g.first.columns = 0; }, "guide");
  s.refused([](Guide& g) { g.omega.size = 0; }, "guide");
  s.refused([](Guide& g) { g.first.values.size = 23; }, "guide");
  s.refused([](Guide& g) { g.first.values.size = 12; }, "guide");
  s.refused([](Guide& g) { g.first.values.size = 48; }, "guide");
  s.fine([](Guide& g) { g.mutual = g.first.values; });
  s.refused([](Guide& g) { g.mutual = {values, 12}; }, "guide");
  s.refused([](Guide& g) { g.first.level_max = 0; }, "guide");
  s.refused([](Guide& g) { g.u_dc = 0; }, "guide");
  const auto sets = [](int n, int size) {
    return [n, size](Guide& g) { g.first.values.size = 24 * n, g.mirrored = {mirrored, size}; };
  };
  s.fine(sets(3, 3));
  s.fine(sets(6, 3));
  s.refused(sets(2, 3), "guide");
  s.refused(sets(4, 4), "guide");
  s.refused(
      [](Guide& g) {
        g.first.values.size = 72, g.mirrored = {mirrored + 1, 3};
      },
      "guide");  // a fourth set
  return s.worst;
}

/// Angles may be zero and are less than a whole period; no phase is beside itself.
double pairs_of_phases() {
  static const AnyPairs any;
  using Pairs = Coupling<double>;
  Said<Pairs> s(any.pairs, [](const Pairs& p) { return p.fault(3); });
  static const double from_none[] = {0, 5.3}, whole[] = {1.1, two_pi<double>}, less[] = {-1e-9, 1};
  s.fine([](Pairs& p) { p.behind = {from_none, 2}; });
  s.refused([](Pairs& p) { p.behind = {whole, 2}; }, "angles of the pairs");
  s.refused([](Pairs& p) { p.behind = {less, 2}; }, "angles of the pairs");
  static const std::uint8_t itself[] = {0, 1}, beyond[] = {1, 3};
  for (const auto* second : {itself, beyond}) {
    s.refused([second](Pairs& p) { p.second = {second, 2}; }, "phases of the pairs");
  }
  const char* sizes = "sizes of the pairs";
  s.fine([](Pairs& p) { p.N_r = 1; });
  s.refused([](Pairs& p) { p.N_r = 0; }, sizes);
  for (int n : {1, 256}) s.refused([n](Pairs& p) { p.n_i = n; }, sizes);
  for (int n : {1, 10001}) s.refused([n](Pairs& p) { p.n_phi = n; }, sizes);
  for (int n : {0, Pairs::most_functions + 1}) s.refused([n](Pairs& p) { p.rank = n; }, sizes);
  s.refused([](Pairs& p) { p.second.size = 1; }, sizes);
  s.refused([](Pairs& p) { p.kind.size = 1; }, sizes);
  s.refused([](Pairs& p) { p.behind.size = 1; }, sizes);
  s.refused([](Pairs& p) { p.knot.size = 2; }, sizes);
  s.refused([](Pairs& p) { --p.f.size; }, "functions of the pairs");
  s.refused([](Pairs& p) { --p.C.size; }, "tables of the pairs");
  static const double knots[] = {0.0, 3.7, 3.7};
  s.refused([](Pairs& p) { p.knot = {knots, 3}; }, "currents of the pairs");
  s.refused([](Pairs& p) { p.cells_per_rad = 0; }, "cells of the pairs");
  s.fine([](Pairs& p) { p = Pairs{}; });  // there are none
  return s.worst;
}

double parts_of_a_plant() {
  Said course = said(Course{{1, 1, 2}, {3, 4, 5}});
  course.refused([](Course& c) { c = {}; }, "points of a course");
  course.refused([](Course& c) { c.value.pop_back(); }, "points of a course");
  course.refused([](Course& c) { c.t[1] = 0.9; }, "times of a course");
  course.refused([](Course& c) { c.t[2] = std::nan(""); }, "times of a course");
  Said pump = said(Pump{.tau = {1, 2, 3, 4}, .rise = {1, 2, 3, 4}, .columns = 2});
  pump.fine([](Pump& p) { p.columns = 4; });
  pump.fine([](Pump& p) { p.tau.clear(), p.s_step = 0; });
  pump.refused([](Pump& p) { p.columns = 1; }, "pump");
  pump.refused([](Pump& p) { p.columns = 3; }, "pump");
  pump.refused([](Pump& p) { p.rise.pop_back(); }, "pump");
  pump.refused([](Pump& p) { p.s_step = 0; }, "pump");
  pump.refused([](Pump& p) { p.H_step = 0; }, "pump");
  pump.refused([](Pump& p) { p.H_static = {}; }, "points of a course");
  Said battery = said(Battery{.E = constant(9), .R = 1, .C = 1});
  battery.refused([](Battery& b) { b.R = 0; }, "R, C of the source");
  battery.refused([](Battery& b) { b.C = 0; }, "R, C of the source");
  battery.refused([](Battery& b) { b.E = {}; }, "points of a course");
  PvArray array{};
  array.R_s = array.R_sh = array.a = array.C = 1;
  array.poa_global = array.temp_cell = constant(1);
  Said pv = said(array);
  for (double PvArray::*of : {&PvArray::R_s, &PvArray::R_sh, &PvArray::a, &PvArray::C}) {
    pv.refused([of](PvArray& p) { p.*of = 0; }, "R_s, R_sh, a, C of the source");
  }
  pv.refused([](PvArray& p) { p.poa_global.t.clear(); }, "points of a course");
  pv.refused([](PvArray& p) { p.temp_cell.t.clear(); }, "points of a course");
  Said shaft = said(Shaft{});
  shaft.refused([](Shaft& s) { s.J = 0; }, "J of the shaft");
  shaft.refused([](Shaft& s) { s.tau_0 = {}; }, "points of a course");
  shaft.refused([](Shaft& s) { s.omega = {}; }, "points of a course");
  shaft.refused([](Shaft& s) { s.pump.tau = {1}; }, "pump");
  using P = Plant<M, 3>;
  Said plant = said(P{.machine = lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468),
                      .R = 0,
                      .source = StiffSource{constant(9)},
                      .bridge = AsymmetricBridge{},
                      .shaft = {}});
  plant.refused([](P& p) { p.R = -1e-9; }, "R");
  plant.refused([](P& p) { p.R = std::nan(""); }, "R");
  plant.refused([](P& p) { p.shaft.J = 0; }, "J of the shaft");
  plant.refused([](P& p) { p.source = StiffSource{}; }, "points of a course");
  return worst_of({course.worst, pump.worst, battery.worst, pv.worst, shaft.worst, plant.worst});
}

double timings() {
  Said s = said(Sampling{.T_s = 1, .delay = 1, .adc_bits = 30, .i_range = 1});
  s.fine([](Sampling& x) { x.delay = 0, x.adc_bits = 0, x.i_range = 0, x.rotor.counts = 0; });
  s.refused([](Sampling& x) { x.T_s = 1.001; }, "T_s");
  s.refused([](Sampling& x) { x.T_s = 0; }, "T_s");
  for (int delay : {-1, 2}) s.refused([delay](Sampling& x) { x.delay = delay; }, "delay");
  for (int bits : {-1, 31}) s.refused([bits](Sampling& x) { x.adc_bits = bits; }, "adc_bits");
  s.refused([](Sampling& x) { x.i_range = 0; }, "i_range");
  s.refused([](Sampling& x) { x.rotor.counts = -1; }, "encoder_counts");
  Said r = said(Resolution{1e-6, {1, 1}, 0});
  r.refused([](Resolution& x) { x.dt_max = 0; }, "dt_max, scale");
  r.refused([](Resolution& x) { x.scale.i = 0; }, "dt_max, scale");
  r.refused([](Resolution& x) { x.scale.u_dc = 0; }, "dt_max, scale");
  const Supervision whole{.T_s = 1,
                          .enable = constant(1),
                          .clear = constant(0),
                          .troubled = constant(0),
                          .trouble = {},
                          .phase = 2,
                          .level = 0};
  Said<Supervision> v(whole, [](const Supervision& x) { return fault<3>(x); });
  v.fine([](Supervision& x) { x.phase = 0; });
  for (int phase : {-1, 3})
    v.refused([phase](Supervision& x) { x.phase = phase; }, "phase of the trouble");
  v.refused([](Supervision& x) { x.T_s = 0; }, "T_s of the supervision");
  v.refused([](Supervision& x) { x.clear = {}; }, "points of a course");
  v.refused([](Supervision& x) { x.troubled = {}; }, "points of a course");
  return worst_of({s.worst, r.worst, v.worst});
}

double guards() {
  Protection<double> protection{};
  protection.flux.T_s = 1;
  Said p = said(protection);
  p.fine([](Protection<double>& x) { x.delay = 1; });
  for (int delay : {-1, 2})
    p.refused([delay](Protection<double>& x) { x.delay = delay; }, "delay of the protection");
  p.refused([](Protection<double>& x) { x.flux.T_s = 0; }, "T_s of the protection");
  Diagnosis<double> diagnosis{};
  diagnosis.patience = 1;
  Said d = said(diagnosis);
  d.fine([](Diagnosis<double>& x) { x.theta_error = pi<double>; });
  for (double error : {-1e-9, 3.15})
    d.refused([error](Diagnosis<double>& x) { x.theta_error = error; },
              "theta_error of the diagnosis");
  d.refused([](Diagnosis<double>& x) { x.patience = 0; }, "patience, recent of the diagnosis");
  d.refused([](Diagnosis<double>& x) { x.likeness.recent = -1; },
            "patience, recent of the diagnosis");
  Sequence<double> sequence{};
  sequence.T_s = 1;
  sequence.n_calibrate = 1;
  Said q = said(sequence);
  q.refused([](Sequence<double>& x) { x.T_s = 0; }, "T_s of the sequence");
  q.refused([](Sequence<double>& x) { x.n_calibrate = 0; }, "n_calibrate, n_settle");
  q.refused([](Sequence<double>& x) { x.n_settle = -1; }, "n_calibrate, n_settle");
  return worst_of({p.worst, d.worst, q.worst});
}

double laws() {
  static double values[24];
  static const double omega[] = {1, 2};
  using Law = FiniteSetMpc<M, 3>;
  Law law{};
  law.machine = lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468);
  law.guide = {{{values, 24}, 3, 4, 5}, {omega, 2}, 200, 0};
  law.w_psi = law.feedback = {omega, 2};
  law.horizon = Law::horizon_max;
  law.T_s = 1;
  Said<Law> s(law, [](const Law& x) { return c_api::fault_of_law(x); });
  s.fine([](Law& x) { x.horizon = 1, x.delay = 1; });
  for (int horizon : {0, Law::horizon_max + 1})
    s.refused([horizon](Law& x) { x.horizon = horizon; }, "horizon");
  s.refused([](Law& x) { x.guide.u_dc = 0; }, "guide");
  s.refused([](Law& x) { x.w_psi.size = 1; }, "values for each speed of the guide");
  s.refused([](Law& x) { x.feedback.size = 1; }, "values for each speed of the guide");
  s.refused([](Law& x) { x.T_s = 0; }, "T_s of the law");
  for (int delay : {-1, 2}) s.refused([delay](Law& x) { x.delay = delay; }, "delay of the law");
  using Shared = Deadbeat<M, 3>;
  Shared shared{};
  shared.machine = law.machine;
  shared.guide = law.guide;
  shared.T_s = 1;
  shared.sharing.theta_on = 0.2;
  shared.sharing.theta_ov = 0.7;
  Said<Shared> d(shared, [](const Shared& x) { return c_api::fault_of_law(x); });
  d.refused([](Shared& x) { x.sharing.theta_ov = 1; }, "sharing");
  using Paper = PaperMpc<M, 3, 4, 2>;
  Paper paper{.machine = law.machine,
              .guide = law.guide,
              .N_p = 4,
              .N_c = 2,
              .r_w = 0,
              .w_i = 0,
              .R = 1,
              .i_max = 1,
              .i_band = 1,
              .T_s = 1,
              .delay = 0,
              .short_from = 0};
  Said<Paper> p(paper, [](const Paper& x) { return c_api::fault_of_law(x); });
  p.fine([](Paper& x) { x.N_p = x.N_c = 1; });
  for (int n : {0, 5}) p.refused([n](Paper& x) { x.N_p = n; }, "N_p");
  for (int n : {0, 3}) p.refused([n](Paper& x) { x.N_c = n; }, "N_c");
  p.refused([](Paper& x) { x.N_p = 1; }, "N_c");
  p.refused([](Paper& x) { x.T_s = 0; }, "T_s of the law");
  p.refused([](Paper& x) { x.guide.u_dc = 0; }, "guide");
  return worst_of({s.worst, d.worst, p.worst});
}

}  // namespace

int main() {
  check("guides: rows, columns, speeds, sets", guides(), 0);
  check("pairs of phases", pairs_of_phases(), 0);
  check("parts of a plant", parts_of_a_plant(), 0);
  check("sampling, resolution, supervision", timings(), 0);
  check("protection, diagnosis, sequence", guards(), 0);
  check("laws", laws(), 0);
  return failures == 0 ? 0 : 1;
}
