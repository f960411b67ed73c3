// The control laws of this library, each named once: bindings, C interface, mock-up units and
// studio have those of this list.
#pragma once

#include "srm/control/law/angles.hpp"
#include "srm/control/law/deadbeat.hpp"
#include "srm/control/law/ditc.hpp"
#include "srm/control/law/edge_mpc.hpp"
#include "srm/control/law/finite_set_mpc.hpp"
#include "srm/control/law/paper_mpc.hpp"
#include "srm/control/law/pwm_current.hpp"
#include "srm/control/law/torque_sharing.hpp"

/// Names of templates in srm::laws.
#define SRM_BUILT_IN_LAWS \
  Angles, PwmCurrent, TorqueSharing, Ditc, Deadbeat, PaperMpc, FiniteSetMpc, EdgeMpc

/// In one form: machine model and number of phases.
namespace srm::laws {

template <Machine M, int N>
using Angles = srm::Angles<typename M::Scalar, N>;  // does without a machine
/// Capacities of its horizons, N_p and N_c.
inline constexpr int Np_max = 10, Nc_max = 4;
template <Machine M, int N>
using PaperMpc = srm::PaperMpc<M, N, Np_max, Nc_max>;
using srm::Deadbeat;
using srm::Ditc;
using srm::EdgeMpc;
using srm::FiniteSetMpc;
using srm::PwmCurrent;
using srm::TorqueSharing;

}  // namespace srm::laws
