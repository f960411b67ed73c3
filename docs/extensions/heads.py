"""`{head} paper_mpc.hpp` shows the comment that a C++ header opens with: formula and sources."""

from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

HEADERS = Path(__file__).parents[2] / "include"


def head(path: Path) -> str:
    """The leading comment, without its slashes."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("//"):
            break
        if "clang-format" not in line:
            lines.append(line[2:].removeprefix(" "))
    return "\n".join(lines)


class Head(SphinxDirective):
    """The comment of one header, wherever under include/ it is."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        name = self.arguments[0]
        (path,) = HEADERS.rglob(name)
        self.env.note_dependency(str(path))
        where = path.relative_to(HEADERS.parent).as_posix()
        text = head(path)
        return [
            nodes.paragraph("", "", nodes.literal(where, where)),
            nodes.literal_block(text, text, language="text"),
        ]


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("head", Head)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
