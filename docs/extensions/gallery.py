"""The gallery: every script in examples/gallery is run, and becomes a page with its figure.

A script opens with a docstring: the first line is the title, the rest says in Markdown what the
figure shows. It draws one figure with Matplotlib and may print. A failing script stops the build.
"""

import ast
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.util import logging

SCRIPTS = Path(__file__).parents[2] / "examples" / "gallery"
RUN = """
import runpy, sys
import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
runpy.run_path(sys.argv[1], run_name="__main__")
plt.savefig(sys.argv[2], metadata={"Software": None})
"""
ENVIRONMENT = {
    **os.environ,
    # The command `reluctance` of this Python, also where its environment is not activated.
    "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]),
    "MPLBACKEND": "Agg",
    "MATPLOTLIBRC": str(Path(__file__).parent),
}
logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Example:
    """A script, and what it says of itself."""

    path: Path
    title: str
    text: str
    code: str

    @property
    def picture(self) -> str:
        return f"{self.path.stem}.png"


def read(path: Path) -> Example:
    source = path.read_text(encoding="utf-8")
    tree = ast.parse(source)
    docstring = ast.get_docstring(tree) or ""
    title, _, text = docstring.partition("\n")
    code = "\n".join(source.splitlines()[tree.body[0].end_lineno :])
    return Example(path, title.rstrip("."), text.strip(), code.strip())


def drawn(example: Example, folder: Path) -> str:
    """Runs the script, writes its figure, and gives what it printed."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", RUN, example.path, folder / example.picture],
        capture_output=True,
        encoding="utf-8",
        env=ENVIRONMENT,
    )
    if done.returncode:
        raise RuntimeError(f"{example.path.name} failed:\n{done.stderr}")
    logger.info(f"gallery: {example.path.name}")
    return done.stdout


def page(example: Example, printed: str) -> str:
    name = example.path.name
    said = f"It prints:\n\n```text\n{printed.rstrip()}\n```\n\n" if printed else ""
    return f"""# {example.title}

![{example.title}]({example.picture})

{example.text}

{said}## The script

`python examples/gallery/{name}` draws the figure.

```python
{example.code}
```
"""


def index(examples: list[Example]) -> str:
    cards = "\n".join(
        f'<a class="card" href="{e.path.stem}.html"><img src="../_images/{e.picture}" alt="">'
        f"<span>{e.title}</span></a>"
        for e in examples
    )
    listed = "\n".join(e.path.stem for e in examples)
    return f"""# Gallery

Each example is one short script with one idea. The scripts are in `examples/gallery/`, and the
build of this site runs all of them.

```{{raw}} html
<div class="cards">
{cards}
</div>
```

```{{toctree}}
:hidden:

{listed}
```
"""


def build(app: Sphinx) -> None:
    folder = Path(app.srcdir) / "gallery"
    folder.mkdir(exist_ok=True)
    examples = [read(path) for path in sorted(SCRIPTS.glob("*.py"))]
    with ThreadPoolExecutor(2) as pool:
        texts = list(pool.map(lambda example: drawn(example, folder), examples))
    for example, printed in zip(examples, texts, strict=True):
        write(folder / f"{example.path.stem}.md", page(example, printed))
    write(folder / "index.md", index(examples))


def write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("builder-inited", build)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
