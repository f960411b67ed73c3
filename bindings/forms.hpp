// A form is a precision, number of phases and machine model that something is compiled for.
//
// Laws, frames and loops are compiled in two files each: for speed for machines of 3 and 4 phases
// in double precision, and in little time for all other forms (CMakeLists.txt, docs/adr/0018). What
// stands in both is a template over `Forms`, so that neither takes the other's.
#pragma once

#include <type_traits>

#include "srm/base/real.hpp"

namespace bound {

enum class Forms {
  all,    // a law from outside the tree
  usual,  // and whoever asks these for another form gets it from the others
  other
};

#ifndef RELUCTANCE_FORMS
#define RELUCTANCE_FORMS all
#endif
/// Those of this file.
inline constexpr Forms forms_here = Forms::RELUCTANCE_FORMS;

template <Forms forms, srm::Real T, int N>
inline constexpr bool has_form = forms == Forms::all ||
                                 (forms == Forms::usual) ==
                                     (std::is_same_v<T, double> && (N == 3 || N == 4));

/// What is seldom asked for is compiled among the others in all forms.
template <Forms forms, bool seldom, srm::Real T, int N>
inline constexpr bool has_form_of = seldom ? forms != Forms::usual : has_form<forms, T, N>;

}  // namespace bound
