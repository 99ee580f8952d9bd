"""The site of the documentation; `make docs` builds it, and a broken link is an error.

The source is the whole repository, of which it takes the pages, so that a link to a page or to a
file is the same here and where the repository is read.
"""

from __future__ import annotations

import re
from importlib.metadata import metadata
from typing import Any

project, release = "discmech", metadata("discmech")["Version"]
copyright = "discmech contributors"

extensions = ["myst_parser", "sphinx.ext.autodoc"]
root_doc = "docs/index"
include_patterns = ["docs/**.md", *(f"{page}.md" for page in (
    "NOTATION", "PAPER", "CHANGELOG", "CONTRIBUTING"))]  # fmt: skip
exclude_patterns = ["docs/_build", ".venv"]
nitpicky = True

myst_heading_anchors = 3
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True

html_theme = "furo"
html_title = "discmech"
html_copy_source = False
html_additional_pages = {"index": "to_the_first_page.html"}
templates_path = ["templates"]


def as_plain_text(
    app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    """Docstrings are plain text with `names`: what would be markup in formulas is escaped.

    A line that begins with an argument and a colon begins a paragraph.
    """
    lines[:] = re.sub(r"\n(?=[a-z_]\w*(\(.*\))?: )", "\n\n", "\n".join(lines)).split("\n")
    for k, line in enumerate(lines):
        parts = re.split(r"(`[^`]+`)", line)
        parts[::2] = [re.sub(r"([*|_\\])", r"\\\1", part) for part in parts[::2]]
        lines[k] = "".join(f"`{part}`" if k % 2 else part for k, part in enumerate(parts))


def setup(app: Any) -> None:
    app.connect("autodoc-process-docstring", as_plain_text)
