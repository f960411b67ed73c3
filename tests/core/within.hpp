// A check is one line: the worst value found, and the bound that it must not pass.
#pragma once

#include <cstdio>

inline int failures = 0;

inline void check(const char* law, double worst, double bound) {
  const bool holds = worst <= bound;
  if (!holds) ++failures;
  std::printf("%-6s %-58s %.3g (bound %.3g)\n", holds ? "ok" : "BROKEN", law, worst, bound);
}
