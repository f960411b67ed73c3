// What a law that follows a reference profile, each phase by itself, makes of it where phases
// couple.
//
// One guide serves all phases. Where their neighbours are unlike, it has the mean of the pairs, and
// the pairs as they are make another torque. So much more or less is asked of the phases:
//
//   torque' = torque + tau_pairs of the guide - tau_pairs as it is
//
// And a phase takes the volt-seconds that its neighbours induce besides those of its own flux
// linkage. Where the machine of a law has no pairs, nothing of it is left.
#pragma once

#include "srm/control/interface/interface.hpp"
#include "srm/control/part/mirror.hpp"
#include "srm/control/part/reference_profile.hpp"
#include "srm/machine/with_pairs.hpp"

namespace srm {

/// The profile to follow for a torque >= 0 [N m].
template <Machine M, Real T, int N>
Profile<T> followed_profile(const M& machine, const ReferenceProfile<T>& guide, T torque,
                            const Measurement<T, N>& y, T tau_ref) {
  const Profile<T> asked = guide.at(torque, y.omega_m, y.u_dc);
  if constexpr (has_pairs<M>) {
    const T of_guide = asked.tau_pairs_at(drive_angle<N>(y.theta_e, 0, tau_ref));
    const T lacks = of_guide - pair_torque(machine, y, tau_ref);
    return guide.at(max(torque + lacks, T(0)), y.omega_m, y.u_dc);
  } else {
    return asked;
  }
}

/// What the profile asks of a phase at an angle: its own flux linkage, zero where it wants no
/// current, and what the neighbours add on the way from another angle [Wb].
template <Machine M, Real T>
T followed_flux(const Profile<T>& profile, [[maybe_unused]] T from, T to) {
  const T own = profile.at(to);
  if constexpr (has_pairs<M>) {
    if (own > T(0)) return own + profile.mutual_at(to) - profile.mutual_at(from);
  }
  return own;
}

}  // namespace srm
