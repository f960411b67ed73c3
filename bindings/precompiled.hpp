// What most binding files include and no macro changes (CMakeLists.txt).
#pragma once

#include <nanobind/stl/array.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "shower.hpp"
#include "srm/control/frame/learning.hpp"
#include "srm/control/laws.hpp"
#include "srm/machine/machines.hpp"
#include "srm/sim/called_law.hpp"
#include "srm/sim/controller.hpp"
#include "srm/sim/event.hpp"
#include "srm/sim/tables.hpp"
