// The three states of an asymmetric half bridge.
#pragma once

#include <cstdint>

namespace srm {

/// Both switches on; one on; both off. With current flowing the winding sees +u_dc, 0, -u_dc.
enum class Leg : std::int8_t { demagnetize = -1, freewheel = 0, magnetize = 1 };

}  // namespace srm
