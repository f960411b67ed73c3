// The language that this package needs, checked before all else: one error instead of thousands.
#pragma once

#if __cplusplus < 201709L  // GCC 10 calls its C++20 so
#error "this package needs C++20: compile its .cpp files with -std=c++20 or -std=gnu++20"
#include "stop_here_the_package_needs_cpp20.hpp"  // a file that is missing ends the compilation
#endif
