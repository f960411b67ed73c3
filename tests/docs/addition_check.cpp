// What each addition of docs/extending.md does, in a tree with its patch: one loop or part each,
// chosen by a macro of its name. The first line that is not as expected is the exit status.
#include <cmath>

#include "srm/control/frame/frame.hpp"
#include "srm/control/law/torque_sharing.hpp"
#include "srm/machine/machines.hpp"
#include "srm/sim/simulation.hpp"

#define EXPECT(condition) \
  if (!(condition)) return __LINE__

namespace {

constexpr int N = 3;
const auto paper = srm::lehuy<double>(4, 0.67e-3, 23.62e-3, 0.15e-3, 450, 0.468);
double u_seen = 0;  // by the controller

bool near(double a, double b, double part) { return std::fabs(a - b) <= part * std::fabs(b); }

/// 5 ms on a shaft held at rest in alignment, with phase 0 ordered to a leg.
template <class M>
srm::State<N> after_5_ms(const M& machine, srm::Source source, srm::Leg leg,
                         srm::Sampling sampling = {}) {
  sampling.T_s = 50e-6;
  srm::Controller<N> controller = [leg](const srm::Measurement<double, N>& y, double) {
    u_seen = y.u_dc;
    srm::Orders<N> orders{.command = {}, .tau_ref = 0};
    orders.command[0] = srm::hold<double>(leg);
    return orders;
  };
  const srm::Plant<M, N> plant{.machine = machine,
                               .R = 0.72,
                               .source = source,
                               .bridge = srm::AsymmetricBridge{},
                               .shaft = {}};
  const double aligned = srm::pi<double> / machine.N_r;
  srm::Simulation<M, N> loop(plant, 0, sampling, controller, srm::constant(0), aligned,
                             {10e-6, {150, 240}, 0});
  srm::Rows waveforms(srm::columns_of(srm::Waveform<N>{}), 100000);
  srm::Rows periods(srm::columns_of(srm::Period<N>{}), 100);
  while (loop.t() < 5e-3) loop.advance(5e-3, waveforms, periods);
  return loop.state();
}

}  // namespace

int main() {
  const srm::StiffSource stiff{srm::constant(240)};
#if defined(MACHINE)  // u = R i + L di/dt
  const srm::Linear<double> linear{4, 7e-4, 2e-2};
  const double exact = 240 / 0.72 * (1 - std::exp(-0.72 * 5e-3 / 20.7e-3));
  EXPECT(near(after_5_ms(linear, stiff, srm::Leg::magnetize).i[0], exact, 1e-6));
#elif defined(SOURCE)  // C du/dt = I while no phase takes a current
  const srm::CurrentSource source{srm::constant(20), 240, 2200e-6};
  const double u = after_5_ms(paper, source, srm::Leg::demagnetize).u_dc;
  EXPECT(near(u, 240 + 20 * 5e-3 / 2200e-6, 1e-9));
#elif defined(SENSOR)
  srm::Sampling sampling{};
  sampling.u_gain = 1.1;
  after_5_ms(paper, stiff, srm::Leg::demagnetize, sampling);
  EXPECT(near(u_seen, 264, 1e-12));
#elif defined(BRIDGE)   // it cannot freewheel
  using srm::Leg;
  const srm::AllLegs<3> ordered{Leg::freewheel, Leg::magnetize, Leg::demagnetize};
  const srm::AllLegs<3> legs{Leg::demagnetize, Leg::magnetize, Leg::demagnetize};
  EXPECT(srm::OneGateBridge{}.legs(ordered) == legs);
  EXPECT(std::holds_alternative<srm::OneGateBridge>(srm::Bridge{srm::OneGateBridge{}}));
#elif defined(FRAME)    // half the torque at half the voltage; all of it to brake
  srm::Frame<double> frame{};
  frame.u_low = 200;
  srm::Frame<double>::State<N> state{};
  srm::Measurement<double, N> y{.i = {}, .theta_e = 0, .omega_m = 50, .u_dc = 100, .i_source = 0};
  constexpr srm::Uses all{};
  EXPECT(near((frame.before<all>(state, y, 10.0, frame.tuning())), 5, 1e-12));
  EXPECT(near((frame.before<all>(state, y, -10.0, frame.tuning())), -10, 1e-12));
#elif defined(LAW_KEY)  // no reference of a phase with a share is below i_least
  srm::TorqueSharing<srm::LeHuy<double>, N> law{.machine = paper,
                                                .sharing = {},
                                                .feasible = srm::always_feasible<double>(),
                                                .guide = {},
                                                .R = 0.72,
                                                .i_max = 150,
                                                .i_band = 1,
                                                .T_s = 20e-6};
  law.sharing.theta_on = 0.1, law.sharing.theta_ov = 0.8;
  srm::FollowedCurrents<double, N> before{}, after{};
  const srm::Measurement<double, N> y{
      .i = {}, .theta_e = 1.5, .omega_m = 50, .u_dc = 240, .i_source = 0};
  law.step(before, y, 0.01);
  law.i_least = 20;
  law.step(after, y, 0.01);
  EXPECT(before.i_ref[0] > 0 && before.i_ref[0] < 20 && after.i_ref[0] == 20);
  EXPECT(before.i_ref[1] == 0 && after.i_ref[1] == 0);
#endif
  return 0;
}
