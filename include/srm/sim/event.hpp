// What a supervised drive goes through, as rows.
#pragma once

#include "srm/base/fields.hpp"

namespace srm {

/// A state that the drive enters, and the fault that led to it.
struct Event {
  double t{};  // of the sample [s]
  double mode{}, status{}, phase{}, value{}, limit{};
  SRM_FIELDS(t, mode, status, phase, value, limit)
};

}  // namespace srm
