// The C interface over the commissioning routines: the states of the drive around one of them.
// clang-format off: the standard is checked first
#include "_standard.hpp"
// clang-format on
#include "border.hpp"
#include "commission_parameters.hpp"
#include "parameters.hpp"
#include "reluctance_commission.h"
#include "srm/control/commission/commission.hpp"
#include "srm/control/guard/supervised.hpp"

namespace {

constexpr int N = RELUCTANCE_PHASES;
using Drive = srm::Supervised<srm::Commissioning<float, N>>;
using State = Drive::State;
constexpr Drive drive{reluctance::sequence, {reluctance::commission}};

static_assert(sizeof(State) <= sizeof(reluctance_commissioner));
static_assert(alignof(State) <= alignof(reluctance_commissioner));
static_assert(RELUCTANCE_ROUTINE_PULSES == static_cast<int>(srm::Routine::pulses));
static_assert(RELUCTANCE_FINDING_ROTOR_MOVED == static_cast<int>(srm::Finding::rotor_moved));
static_assert(RELUCTANCE_FINDING_NO_CURRENT == static_cast<int>(srm::Finding::no_current));

State& state_of(reluctance_commissioner* commissioner) {
  return *std::launder(reinterpret_cast<State*>(commissioner));
}
const State& state_of(const reluctance_commissioner* commissioner) {
  return *std::launder(reinterpret_cast<const State*>(commissioner));
}

}  // namespace

void reluctance_commission_start(reluctance_commissioner* commissioner, reluctance_routine routine,
                                 int32_t phase, int32_t pulses, int32_t held, float held_A) {
  State& x = *::new (commissioner) State();
  drive.control.routines.start<N>(x.control.routine, static_cast<srm::Routine>(routine), phase,
                                  pulses, held, held_A);
}

reluctance_mode reluctance_commission(reluctance_commissioner* commissioner,
                                      const reluctance_measurement* measurement,
                                      const reluctance_request* request,
                                      reluctance_command* command, reluctance_outputs* outputs) {
  return reluctance::answered(
      drive.step(state_of(commissioner), reluctance::seen(measurement), reluctance::asked(*request),
                 reluctance::written(command), drive.sequence, {}),
      outputs);
}

reluctance_fault reluctance_commission_fault(const reluctance_commissioner* commissioner) {
  return reluctance::told(drive.fault(state_of(commissioner)));
}

void reluctance_get_found(const reluctance_commissioner* commissioner, reluctance_found* found) {
  const State& all = state_of(commissioner);
  const auto& x = all.control.routine;
  found->finding = static_cast<reluctance_finding>(x.finding);
  found->progress = x.progress;
  for (int k = 0; k < N; ++k) {
    found->sensor[k] = x.wiring.sensor[k];
    found->sign[k] = x.wiring.sign[k];
    found->R_ohm[k] = x.resistance.R[k];
    found->place[k] = x.alignment.place[k];
    found->offset_A[k] = all.states.offset[k];
  }
  found->direction = x.alignment.direction;
  found->zero_rad = x.alignment.zero;
  found->spread_rad = x.alignment.spread;
  const srm::PulseRow<float>& row = x.pulses.row;
  found->pulse = row.pulse;
  found->sample = row.sample;
  found->u_mean_V = row.u_mean;
  found->i_A = row.i;
  found->theta_e_rad = row.theta_e;
  found->u_held_V = row.u_held;
  found->i_held_A = row.i_held;
}

const char* reluctance_describe_finding(reluctance_finding finding) {
  return srm::describe(static_cast<srm::Finding>(finding));
}
