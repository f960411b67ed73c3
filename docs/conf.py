"""How Sphinx builds the site: `make docs`. Nothing is fetched, by the build or by a reader."""

import sys
from importlib.metadata import version as installed
from pathlib import Path

from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "reluctance"
author = "the authors of reluctance"
copyright = "2026, the authors of reluctance, Apache-2.0"
version = release = installed("reluctance")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "numpydoc",
    "comments",  # the last six are in docs/extensions
    "equations",
    "program",
    "gallery",
    "heads",
    "studio",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["adr/README.md", "extensions", "generated"]
nitpicky = False  # types of other packages have no page here

myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "colon_fence", "attrs_inline"]
myst_heading_anchors = 4
myst_links_external_new_tab = False

default_role = "literal"  # docstrings write names in single backticks
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
numpydoc_show_class_members = False

html_theme = "furo"
html_title = f"reluctance {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_math_renderer = "svg"
html_theme_options = {
    "light_css_variables": {
        "color-brand-primary": "#0b5d8f",
        "color-brand-content": "#0b5d8f",
    },
    "dark_css_variables": {
        "color-brand-primary": "#6cb6e4",
        "color-brand-content": "#6cb6e4",
    },
}
pygments_style = "friendly"
pygments_dark_style = "monokai"


def escape_bars(*event: object) -> None:
    """|x| in a docstring is an absolute value, not a substitution."""
    lines: list[str] = event[-1]  # type: ignore[assignment]
    lines[:] = [line if "`" in line else line.replace("|", r"\|") for line in lines]


def setup(app: Sphinx) -> None:
    app.connect("autodoc-process-docstring", escape_bars)
