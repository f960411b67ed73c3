// Errors of what a part gives, and the worst of them.
#pragma once

#include <cmath>
#include <initializer_list>

#include "srm/base/leg.hpp"

inline constexpr double turn = 6.283185307179586;

inline double off(double found, double expected) { return std::fabs(found - expected); }
inline double off(srm::Leg found, srm::Leg expected) { return found == expected ? 0 : 1; }
inline double unless(bool holds) { return holds ? 0 : 1; }
inline double worst_of(std::initializer_list<double> errors) {
  double worst = 0;
  for (double e : errors) worst = e <= worst || worst != worst ? worst : e;  // NaN stays
  return worst;
}
