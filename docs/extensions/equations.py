"""Equations as SVG: the same in every browser, without a script or a fetched font."""

from html import escape

import ziafont
import ziamath
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

ziafont.config.svg2 = False  # each picture stands alone: no identifiers that pages could repeat
SIZE = 17  # of the letters [px]


def drawn(tex: str, *, inline: bool) -> str:
    """The picture, in the colour of the text around it; its source for those who cannot see it."""
    made = ziamath.Latex(tex, size=SIZE, color="currentColor", inline=inline)
    svg = made.svg().partition("<svg")[2]
    label = escape(tex, quote=True)
    style = f"vertical-align: {made.getyofst():.1f}px"
    return f'<svg role="img" aria-label="{label}" style="{style}"{svg}'


def inline(self: HTML5Translator, node: nodes.math) -> None:
    self.body.append(drawn(node.astext(), inline=True))
    raise nodes.SkipNode


def block(self: HTML5Translator, node: nodes.math_block) -> None:
    self.body.append(f'<div class="equation">{drawn(node.astext(), inline=False)}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer("svg", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
