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
#include "srm/machine/with_pairs.hpp"

/// Names of templates in srm::laws.
#define SRM_BUILT_IN_LAWS \
  Angles, PwmCurrent, TorqueSharing, Ditc, Deadbeat, PaperMpc, FiniteSetMpc, EdgeMpc

/// Those that compute with pairs of phases where a machine has them, by their names then.
#define SRM_LAWS_OF_PAIRS                                                                   \
  TorqueSharingOfPairs, DitcOfPairs, DeadbeatOfPairs, PaperMpcOfPairs, FiniteSetMpcOfPairs, \
      EdgeMpcOfPairs

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

template <Machine M, int N>
using TorqueSharingOfPairs = srm::TorqueSharing<WithPairs<M>, N>;
template <Machine M, int N>
using DeadbeatOfPairs = srm::Deadbeat<WithPairs<M>, N>;
template <Machine M, int N>
using DitcOfPairs = srm::Ditc<WithPairs<M>, N>;
template <Machine M, int N>
using PaperMpcOfPairs = PaperMpc<WithPairs<M>, N>;
template <Machine M, int N>
using FiniteSetMpcOfPairs = srm::FiniteSetMpc<WithPairs<M>, N>;
template <Machine M, int N>
using EdgeMpcOfPairs = srm::EdgeMpc<WithPairs<M>, N>;

}  // namespace srm::laws
