"""One small library of the C interface and of both versions of FMI: it takes a few seconds to
compile, and a session compiles it once."""

import ctypes
import functools
import tempfile
from pathlib import Path

from c_library import library

import reluctance as rl
from reluctance.base import toolchain
from reluctance.targets.export.blob import blob

ROOT = Path(__file__).parents[2]
DRIVE = rl.load(ROOT / "examples" / "sharing_cubic.toml", ["supervision.enable_s=0.0"])
T_S = 20e-6  # of the mock-up units [s]
SOURCE = f"""
#include <cstddef>
#define SRM_LAWS TorqueSharing
#define SRM_MACHINES LeHuy
#define SRM_PHASES 3
#define SRM_PRECISIONS double
#define SRM_AROUND(around, machine, phases) (around == "states")
#include "srm/c_api/reluctance.h"
namespace drive {{
const unsigned char* blob;
std::size_t size;
srm_part part;
constexpr double T_s = {T_S};
constexpr char token[] = "this drive";
}}
#include "srm/fmi/fmi2.hpp"
#include "srm/fmi/fmi3.hpp"
extern "C" SRM_API void use(const unsigned char* blob, std::size_t size, srm_part part) {{
  drive::blob = blob, drive::size = size, drive::part = part;
}}
"""


@functools.cache
def compiled() -> ctypes.CDLL:
    """Cubic torque sharing with states, on the paper's machine model, in double precision."""
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / "small.cpp").write_text(SOURCE)
        flags = ["-O0", "-fvisibility=hidden", f"-I{ROOT / 'include'}"]
        made = toolchain.build(
            ["small.cpp"], "small.so", flags, folder=place, what="the small library"
        )
        return library(made)


@functools.cache
def content(record: float | None = None) -> bytes:
    """The blob of its drive; record: as of `blob`."""
    return blob(DRIVE, record=record)
