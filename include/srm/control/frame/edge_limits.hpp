// What gate drivers and sampling ask of the edges of a timer order: no leg state shorter than
// t_min, and no edge within t_blank before the next sampling instant, where it would disturb the
// current reading.
//
// An interval below t_min becomes t_min or none, whichever is nearer. An edge in the window before
// the sample moves to the start of the window or is left to the next order. An edge at the sample
// itself is allowed: the currents are held by then.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/control/interface/interface.hpp"

namespace srm {

template <Real T>
struct EdgeLimits {
  T t_min;    // shortest leg state; 0: none is too short [s]
  T t_blank;  // without edges before a sample [s]
  T T_s;      // control period [s]
  SRM_FIELDS(t_min, t_blank, T_s)

  constexpr bool any() const { return t_min > T(0) || t_blank > T(0); }

  constexpr void apply(PhaseCommand<T>& c) const {
    const T last = T_s - max(t_min, t_blank);
    T before = T(0);
    for (T& t : c.t_edge) {
      if (t >= T_s || before >= T_s) {
        t = never<T>;
      } else {
        const T gap = t - before;
        if (gap > T(0) && gap < t_min) t = gap + gap < t_min ? before : before + t_min;
        if (t > last) {
          const bool early = t - last < T_s - t && (last == before || last - before >= t_min);
          t = early ? last : never<T>;
        }
        if (t < before) t = before;
      }
      before = t;
    }
  }
};

}  // namespace srm
