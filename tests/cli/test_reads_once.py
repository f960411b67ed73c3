"""`reluctance run`: what it reads."""

import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

READ = """
import sys
opened = []
def seen(event, arguments):
    if event == "open" and str(arguments[0]).endswith((".toml", ".csv")):
        opened.append(str(arguments[0]))
sys.addaudithook(seen)
from reluctance.cli.main import app
app(["run", sys.argv[1], "--until", "0.01"], standalone_mode=False)
print(*opened, sep="\\n")
"""


@pytest.mark.parametrize(
    "name",
    ["edge_mpc_mcu", "map_mpc", "sun_cloud", pytest.param("sun_day", marks=pytest.mark.long)],
)
def test_a_file_is_read_once(name):
    """A flux map twice: its content is also what the cache knows its surface by."""
    given = ROOT / "examples" / f"{name}.toml"
    done = subprocess.run([sys.executable, "-c", READ, given], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    opened = Counter(line for line in done.stdout.splitlines() if line.endswith((".toml", ".csv")))
    assert opened[str(given)] == 1
    assert all(count <= 2 for count in opened.values()), opened
