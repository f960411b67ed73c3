// The border of the C interface: its structs are those of the core, so that nothing is copied.
#pragma once

#include <cstddef>
#include <new>

#include "reluctance_controller.h"
#include "srm/control/guard/sequence.hpp"
#include "srm/control/guard/supervised.hpp"

namespace reluctance {

inline constexpr int N = RELUCTANCE_PHASES;
using Measurement = srm::Measurement<float, N>;
using Command = srm::Command<float, N>;
using Phase = srm::PhaseCommand<float>;

static_assert(sizeof(Measurement) == sizeof(reluctance_measurement));
static_assert(offsetof(Measurement, theta_e) == offsetof(reluctance_measurement, theta_e_rad));
static_assert(offsetof(Measurement, i_source) == offsetof(reluctance_measurement, i_source_A));
static_assert(sizeof(Command) == sizeof(reluctance_command));
static_assert(offsetof(Phase, leg) == offsetof(reluctance_phase_command, leg));
static_assert(offsetof(Phase, t_edge) == offsetof(reluctance_phase_command, t_edge_s));
static_assert(offsetof(Phase, i_ref) == offsetof(reluctance_phase_command, i_ref_A));
static_assert(offsetof(Phase, chop) == offsetof(reluctance_phase_command, chop));
static_assert(offsetof(Phase, gate) == offsetof(reluctance_phase_command, gate));
static_assert(offsetof(Phase, i_band) == offsetof(reluctance_phase_command, i_band_A));
static_assert(offsetof(Phase, theta_on) == offsetof(reluctance_phase_command, theta_on_rad));
static_assert(offsetof(Phase, theta_off) == offsetof(reluctance_phase_command, theta_off_rad));
static_assert(offsetof(Phase, i_lower) == offsetof(reluctance_phase_command, i_lower_A));
static_assert(offsetof(Phase, i_centre) == offsetof(reluctance_phase_command, i_centre_A));
static_assert(offsetof(Phase, i_upper) == offsetof(reluctance_phase_command, i_upper_A));
static_assert(offsetof(Phase, i_runaway) == offsetof(reluctance_phase_command, i_runaway_A));
static_assert(offsetof(Measurement, omega_m) == offsetof(reluctance_measurement, omega_m_rad_s));
static_assert(offsetof(Measurement, u_dc) == offsetof(reluctance_measurement, u_dc_V));

inline const Measurement& seen(const reluctance_measurement* measurement) {
  return *std::launder(reinterpret_cast<const Measurement*>(measurement));
}

inline Command& written(reluctance_command* command) {
  return *std::launder(reinterpret_cast<Command*>(command));
}

inline srm::Request<float> asked(const reluctance_request& request) {
  return {request.enable != 0, request.clear != 0, request.tripped != 0, request.sequence,
          request.reference};
}

inline reluctance_mode answered(const srm::Outputs& now, reluctance_outputs* outputs) {
  *outputs = {static_cast<reluctance_mode>(now.mode), now.gate_enable, now.precharged, now.chopper};
  return outputs->mode;
}

inline reluctance_fault told(const srm::Fault<float>& fault) {
  return {static_cast<reluctance_status>(fault.status), fault.phase, fault.value, fault.limit,
          fault.age};
}

}  // namespace reluctance
