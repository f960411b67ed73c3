// The core for the browser and for Node: `make wasm` compiles it. -DSRM_PHASES=3 and the other
// macros of srm/c_api/kinds.hpp choose what it holds.
#include "srm/c_api/implementation.hpp"
