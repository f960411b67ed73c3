// What a control law has learned of the machine that it drives (stroke_fit.hpp).
#pragma once

#include "srm/base/fields.hpp"
#include "srm/base/real.hpp"

namespace srm {

/// What is estimated, over what is believed [1], and from how much.
template <Real T>
struct Learned {
  T R = T(1), unaligned = T(1), aligned = T(1), saturated = T(1);
  T strokes{};  // that counted
  T asked{};    // greatest change that the last one asked for [1]
  T t_since{};  // since then, or since the start; a float is coarse after minutes [s]
  SRM_FIELDS(R, unaligned, aligned, saturated, strokes, asked, t_since)
};

}  // namespace srm
