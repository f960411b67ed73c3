// The C interface over the commissioning routines: the states of the drive around one of them.
#include "srm/control/commission/commission.hpp"

#include <cstddef>
#include <new>

#include "commission_parameters.hpp"
#include "parameters.hpp"
#include "reluctance_commission.h"

namespace {

constexpr int N = RELUCTANCE_PHASES;
using reluctance::commission;
using reluctance::sequence;
using Measurement = srm::Measurement<float, N>;
using Command = srm::Command<float, N>;

struct State {
  decltype(sequence)::State<N> states;
  decltype(commission)::State<N> routine;
};

static_assert(sizeof(State) <= sizeof(reluctance_commissioner));
static_assert(RELUCTANCE_ROUTINE_PULSES == static_cast<int>(srm::Routine::pulses));
static_assert(RELUCTANCE_FINDING_ROTOR_MOVED == static_cast<int>(srm::Finding::rotor_moved));
static_assert(RELUCTANCE_FINDING_NO_CURRENT == static_cast<int>(srm::Finding::no_current));
static_assert(alignof(State) <= alignof(reluctance_commissioner));

State& state_of(reluctance_commissioner* commissioner) {
  return *std::launder(reinterpret_cast<State*>(commissioner));
}

/// The fault that ends `run`, where the routine stopped for one.
srm::Fault<float> fault_of(srm::Finding finding, float u_dc) {
  switch (finding) {
    case srm::Finding::over_current:
      return {srm::Status::over_current, -1, 0.0F, commission.i_trip, 0};
    case srm::Finding::wrong_voltage:
      if (u_dc > commission.u_dc_max) {
        return {srm::Status::over_voltage, -1, u_dc, commission.u_dc_max, 0};
      }
      return {srm::Status::under_voltage, -1, u_dc, commission.u_dc_min, 0};
    case srm::Finding::not_a_number:
      return {srm::Status::not_a_number, -1, 0.0F, 0.0F, 0};
    default:
      return {};
  }
}

}  // namespace

void reluctance_commission_start(reluctance_commissioner* commissioner, reluctance_routine routine,
                                 int32_t phase, int32_t pulses) {
  State& x = *::new (commissioner) State();
  commission.start<N>(x.routine, static_cast<srm::Routine>(routine), phase, pulses);
}

reluctance_mode reluctance_commission(reluctance_commissioner* commissioner,
                                      const reluctance_measurement* measurement,
                                      const reluctance_request* request,
                                      reluctance_command* command, reluctance_outputs* outputs) {
  State& x = state_of(commissioner);
  Measurement y = *std::launder(reinterpret_cast<const Measurement*>(measurement));
  const srm::Request<float> ask{request->enable != 0, request->clear != 0, request->sequence, 0.0F};
  sequence.correct(x.states, y);
  const srm::Mode mode = sequence.step(x.states, y, ask);
  Command orders{};
  if (mode == srm::Mode::run) {
    orders = commission.step<N>(x.routine, y);
    const srm::Fault<float> fault = fault_of(x.routine.finding, y.u_dc);
    if (fault.status != srm::Status::ok) sequence.fail(x.states, fault);
  } else if (mode == srm::Mode::fault) {
    sequence.clear(x.states, ask, true);
  }
  if (request->tripped != 0) {
    sequence.fail(x.states, {srm::Status::hardware_trip, -1, 0.0F, 0.0F, 0});
  }
  if (x.states.mode != srm::Mode::run) orders = Command{};
  ::new (command) Command(orders);
  const auto now = static_cast<reluctance_mode>(x.states.mode);
  *outputs = {now, now == RELUCTANCE_MODE_RUN,
              now >= RELUCTANCE_MODE_CALIBRATE && now <= RELUCTANCE_MODE_RUN,
              x.states.chopper ? 1 : 0};
  return now;
}

reluctance_fault reluctance_commission_fault(const reluctance_commissioner* commissioner) {
  const srm::Fault<float>& fault =
      std::launder(reinterpret_cast<const State*>(commissioner))->states.fault;
  return {static_cast<reluctance_status>(fault.status), fault.phase, fault.value, fault.limit,
          fault.age};
}

void reluctance_get_found(const reluctance_commissioner* commissioner, reluctance_found* found) {
  const State& all = *std::launder(reinterpret_cast<const State*>(commissioner));
  const auto& x = all.routine;
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
}

const char* reluctance_describe_finding(reluctance_finding finding) {
  return srm::describe(static_cast<srm::Finding>(finding));
}
