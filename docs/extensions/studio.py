"""`{studio}` shows the studio within a page: the files of web/ become a part of the site.

They are what `make studio` leaves. Where it has not run, as without clang for WebAssembly, the page
says so and the site is built all the same.
"""

import shutil
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

WEB = Path(__file__).parents[2] / "web"
FRAME = '<iframe class="studio" src="{place}index.html" title="The studio" loading="lazy"></iframe>'


def is_built() -> bool:
    return (WEB / "reluctance.wasm").is_file() and (WEB / "data" / "drives.json").is_file()


class Studio(SphinxDirective):
    """The frame; without it a sentence."""

    def run(self) -> list[nodes.Node]:
        if not is_built():
            text = "This copy of the site was built without the studio: run `make studio` first."
            return [nodes.paragraph(text, text)]
        place = "../" * self.env.docname.count("/") + "studio/"
        link = nodes.reference("", "The studio on a page of its own", refuri=f"{place}index.html")
        return [
            nodes.raw("", FRAME.format(place=place), format="html"),
            nodes.paragraph("", "", link),
        ]


def copied(app: Sphinx, exception: Exception | None) -> None:
    if exception is None and is_built() and app.builder.format == "html":
        place = Path(app.outdir) / "studio"
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(WEB, place, ignore=shutil.ignore_patterns("*.cpp", "run.mjs"))


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("studio", Studio)
    app.connect("build-finished", copied)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
