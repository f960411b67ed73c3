// The machine models of this library, each named once: bindings, C interface, mock-up units and
// studio have those of this list. A model is a Motor (magnetics.hpp), and its `fault` names
// parameters that make none; null where there are none.
#pragma once

#include "srm/machine/flux_map.hpp"
#include "srm/machine/lehuy.hpp"

/// Names of templates in srm, each over its scalar.
#define SRM_BUILT_IN_MACHINES LeHuy, FluxMap
