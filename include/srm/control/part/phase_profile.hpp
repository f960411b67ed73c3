// The reference profile of one phase.
//
// Where phases couple and their neighbours differ, each has its own. And it takes the volt-seconds
// that its neighbours induce besides those of its own flux linkage. Where the machine of a law has
// no pairs, nothing of it is left.
#pragma once

#include "srm/control/part/reference_profile.hpp"
#include "srm/machine/with_pairs.hpp"

namespace srm {

/// A profile, or a reference to the one for all.
template <Machine M, Real T>
decltype(auto) phase_profile(const Profile<T>& profile, [[maybe_unused]] int k,
                             [[maybe_unused]] T tau_ref) {
  if constexpr (has_pairs<M>) {
    return profile.of_phase(k, tau_ref < T(0));
  } else {
    return (profile);
  }
}

/// What the profile of a phase asks of it at an angle: its own flux linkage, zero where it wants no
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
