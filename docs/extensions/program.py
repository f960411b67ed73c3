"""Two directives that run the program while the site is built: no page can disagree with it.

`{command}` (comments.py) shows a command, what it prints, and the picture that it wrote. `{help}`
shows the help of every command. The commands run in a copy of examples/ and machines/, and one that
fails stops the build.
"""

import re
import shlex
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[2]
PROGRAM = Path(sys.executable).with_name("reluctance")
SUBCOMMAND = re.compile(r"^  ([a-z][a-z-]*)  ", re.MULTILINE)


def output(arguments: list[str], folder: Path = ROOT) -> str:
    """What the program prints."""
    done = subprocess.run(
        [PROGRAM, *arguments],
        cwd=folder,
        capture_output=True,
        encoding="utf-8",
        env={"COLUMNS": "90", "PYTHONIOENCODING": "utf-8", "HOME": str(Path.home())},
    )
    if done.returncode:
        raise RuntimeError(f"`reluctance {shlex.join(arguments)}` failed: {done.stderr}")
    return done.stdout


class Command(SphinxDirective):
    """One command, its output and its picture."""

    required_arguments = 1
    final_argument_whitespace = True
    option_spec: ClassVar = {
        "picture": directives.path,
        "alt": directives.unchanged,
        "quiet": directives.flag,  # what it prints is left out
    }

    def run(self) -> list[nodes.Node]:
        said = self.arguments[0]
        folder = Path(self.env.app.srcdir) / "generated"
        printed = output(shlex.split(said.replace("\\\n", " "))[1:], folder)
        text = f"$ {said}\n" + ("" if "quiet" in self.options else printed)
        shown = nodes.literal_block(text, text, language="console")
        shown["classes"].append("printed")
        if "picture" not in self.options:
            return [shown]
        name = self.options["picture"]
        image = nodes.image(uri=f"/generated/{name}", alt=self.options.get("alt", name))
        return [shown, image]


class Help(SphinxDirective):
    """The help of every command, in the order of the program."""

    def run(self) -> list[nodes.Node]:
        top = output(["--help"])
        commands, texts = [], []
        with ThreadPoolExecutor(2) as pool:
            names = subcommands(top)
            for name, text in zip(names, pool.map(help_of, names), strict=True):
                below = [f"{name} {part}" for part in subcommands(text)]
                commands += [name, *below]
                texts += [text, *pool.map(help_of, below)]
        return [self.section("", top)] + [
            self.section(command, text) for command, text in zip(commands, texts, strict=True)
        ]

    def section(self, command: str, text: str) -> nodes.section:
        title = f"reluctance {command}".strip()
        made = nodes.section(ids=[nodes.make_id(title)])
        made += nodes.title("", "", nodes.literal(title, title))
        self.state.document.note_implicit_target(made)
        made += nodes.literal_block(text.strip(), text.strip(), language="text")
        return made


def help_of(command: str) -> str:
    return output([*command.split(), "--help"])


def subcommands(text: str) -> list[str]:
    """The commands that a help text lists."""
    return SUBCOMMAND.findall(text.partition("\nCommands:\n")[2])


def prepare(app: Sphinx) -> None:
    """A folder as a reader has it after `git clone`, for the commands to run in."""
    folder = Path(app.srcdir) / "generated"
    folder.mkdir(exist_ok=True)
    for part in ("examples", "machines"):
        shutil.copytree(ROOT / part, folder / part, dirs_exist_ok=True)


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("builder-inited", prepare)
    app.add_directive("command", Command)
    app.add_directive("help", Help)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
