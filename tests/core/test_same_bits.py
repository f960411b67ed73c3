"""One SHA-256 of the waveforms of each drive, whoever compiled the core: g++, clang, and clang for
WebAssembly, which runs in Node and in Chromium."""

import hashlib
import http.server
import json
import shutil
import subprocess
import threading
from functools import partial
from pathlib import Path
from typing import ClassVar

import pytest
from c_library import MORE, SENSORS, Unit, compiled, compiled_wasm, library
from needs import needs

import reluctance as rl
from reluctance.targets.export.blob import blob

pytestmark = [pytest.mark.long, pytest.mark.together]

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
UNTIL = 0.09  # a supervised drive has run for 19 ms by then
NAMES = (
    *("battery", "deadbeat", "ditc", "edge_mpc_mcu", "fan", "finite_set_mpc", "hysteresis_200A"),
    *("load_step", "map_mpc", "paper_pump", "paper_rated", "pwm_current", "shared_switch"),
    *("sharing_cubic", "single_pulse", "sun_cloud"),
)
DIAGNOSED = {
    **{"supervision.enable_s": 0.0, "supervision.precharge_ms": 1.0},
    **{"protection.diagnosis": True, "protection.flux_angle": True},
    **{"supervision.fault": "frozen_current_sensor", "supervision.fault_s": 0.085},
}
CLANG = shutil.which("clang++-19") or shutil.which("clang++")
WASM_CLANG, NODE, CHROMIUM = map(shutil.which, ("clang++-19", "node", "chromium"))


@pytest.fixture(scope="module")
def blobs(tmp_path_factory):
    """A blob for each drive: all laws, both machine models, sensors, dead time, speed loop, PV,
    states with a diagnosis and a fault."""
    place = tmp_path_factory.mktemp("blobs")
    drives = {name: rl.load(EXAMPLES / f"{name}.toml") for name in NAMES}
    drives["sensors"] = drives["sharing_cubic"].with_values(SENSORS)
    drives["diagnosed"] = drives["sensors"].with_values(DIAGNOSED)
    for name, drive in drives.items():
        (place / f"{name}.srm").write_bytes(blob(drive, record=0.0))
    return place


@pytest.fixture(scope="module")
def native(tmp_path_factory, blobs):
    """The hash of each drive with g++."""
    return hashes((), tmp_path_factory.mktemp("native"), blobs)


@pytest.fixture(scope="module")
def module(tmp_path_factory):
    place = tmp_path_factory.mktemp("wasm") / "reluctance.wasm"
    return compiled_wasm(place, WASM_CLANG, phases="3", precisions="double")


def hashes(command, place, blobs):
    lib = library(compiled(place / "reluctance.so", command, phases="3", precisions="double"))
    return {path.stem: waveform_hash(lib, path.read_bytes()) for path in sorted(blobs.iterdir())}


def waveform_hash(lib, content):
    unit = Unit(lib, content).start()
    sha, rows, status = hashlib.sha256(), 0, MORE
    while status == MORE:
        status = unit.check(lib.srm_advance(unit.handle, UNTIL, None))
        for table in ("waveform", "period"):
            taken = unit.take(table)
            rows += len(taken)
            sha.update(taken.tobytes())
    unit.free()
    assert rows > 100
    return sha.hexdigest()


def test_the_drives_are_different_and_hold_all_kinds(native):
    assert len(set(native.values())) == len(native) == len(NAMES) + 2
    laws = {rl.load(EXAMPLES / f"{name}.toml").control.law for name in NAMES}
    assert len(laws) == 8


@needs("clang++")
def test_clang_computes_the_bits_of_gcc(native, blobs, tmp_path):
    assert hashes([CLANG], tmp_path, blobs) == native


@needs("node", "clang++-19")
def test_webassembly_in_node_computes_the_same_bits(native, blobs, module):
    files = sorted(blobs.iterdir())
    command = [NODE, ROOT / "web" / "run.mjs", module, str(UNTIL), *files]
    lines = subprocess.check_output(command, text=True).splitlines()
    found = {file.stem: line.split()[0] for file, line in zip(files, lines, strict=True)}
    assert found == native


PAGE = """<!doctype html><title>bits</title><pre id="out"></pre><script type="module">
import { load } from "./reluctance.js";
const out = {};
try {
  const core = await load(fetch("reluctance.wasm"));
  for (const name of NAMES) {
    const blob = new Uint8Array(await (await fetch(`${name}.srm`)).arrayBuffer());
    const unit = core.create(blob), parts = [];
    unit.start();
    for (let there = false; !there;) {
      there = unit.advance(UNTIL);
      for (const table of ["waveform", "period"]) {
        const taken = unit.take(table);
        parts.push(new Uint8Array(taken.buffer, taken.byteOffset, taken.byteLength).slice());
      }
    }
    unit.free();
    const digest = await crypto.subtle.digest("SHA-256", await new Blob(parts).arrayBuffer());
    out[name] = [...new Uint8Array(digest)].map(b => b.toString(16).padStart(2, "0")).join("");
  }
} catch (fault) { out.fault = String(fault); }
await fetch("done", { method: "POST", body: JSON.stringify(out) });
</script>"""


class Server(http.server.SimpleHTTPRequestHandler):
    """Serves the page and takes its answer."""

    answer: ClassVar[dict[str, str]] = {}
    answered = threading.Event()

    def do_POST(self):
        Server.answer = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.send_response(204)
        self.end_headers()
        Server.answered.set()

    def log_message(self, *_):
        pass


@needs("chromium", "clang++-19")
def test_webassembly_in_chromium_computes_the_same_bits(native, blobs, module, tmp_path):
    site = tmp_path / "site"
    shutil.copytree(blobs, site)
    shutil.copy(ROOT / "web" / "reluctance.js", site)
    shutil.copy(module, site / "reluctance.wasm")
    page = PAGE.replace("NAMES", json.dumps(sorted(native))).replace("UNTIL", repr(UNTIL))
    (site / "index.html").write_text(page)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), partial(Server, directory=site))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    browser = subprocess.Popen(
        [
            *(CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu"),
            *(f"--user-data-dir={tmp_path / 'profile'}", "--remote-debugging-port=0"),
            f"http://127.0.0.1:{server.server_port}/",
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        assert Server.answered.wait(120)
    finally:
        browser.terminate()
        browser.wait(20)
        server.shutdown()
        server.server_close()
    assert Server.answer == native
