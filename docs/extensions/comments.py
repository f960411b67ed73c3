"""Directives of the site stand in comments of the pages, so that every page reads well on a forge.

    ```
    reluctance run examples/paper_rated.toml --plot run.png
    ```
    <!-- {command}
    :picture: run.png
    :alt: what the picture shows
    -->

A forge shows the command; the site runs it, and shows what it prints and draws. `{command}` takes
the block above it; every other directive stands for itself.
"""

import re

from sphinx.application import Sphinx

BODY = r"(?P<body>.*?)\s*-->"
COMMAND = re.compile(r"```\n(?P<line>reluctance [^`]*?)\n```\n<!-- \{command\}" + BODY, re.DOTALL)
DIRECTIVE = re.compile(r"<!-- \{(?P<name>[a-z-]+)\}" + BODY, re.DOTALL)
GALLERY = "(../examples/gallery/)"  # a page that the site makes of these scripts


def directives(text: str) -> str:
    """The page as the site reads it."""
    text = COMMAND.sub(r"```{command} \g<line>\g<body>\n```", text)
    text = DIRECTIVE.sub(r"```{\g<name>}\g<body>\n```", text)
    return text.replace(GALLERY, "(gallery/index.md)")


def _read(app: Sphinx, docname: str, source: list[str]) -> None:
    source[0] = directives(source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", _read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
