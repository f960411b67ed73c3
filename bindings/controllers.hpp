// Controllers of any law, whatever its form (forms.hpp): compiled in forms_control.cpp.
#pragma once

#include "bindings.hpp"
#include "other_forms.hpp"
#include "srm/control/frame/frame.hpp"
#include "srm/control/guard/diagnosed.hpp"
#include "srm/control/guard/supervised.hpp"
#include "srm/sim/supervision.hpp"

namespace bound {

/// A law with its frame.
template <Forms here>
AnyController controlled(const AnyLaw& law, const srm::Frame<double>& frame,
                         const AnyCoupling& coupling);

/// With protection and states around them. machine: as the protection knows it.
template <Forms here>
AnyController supervised(const AnyLaw& law, const srm::Frame<double>& frame,
                         const AnyMachine& machine, const srm::Protection<double>& protection,
                         const srm::Sequence<double>& sequence, const srm::Supervision& plan,
                         const AnyCoupling& coupling,
                         const std::optional<srm::Diagnosis<double>>& diagnosis,
                         const std::optional<srm::FluxAngle<double>>& flux_angle);

}  // namespace bound
