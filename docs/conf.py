"""Sphinx builds the site from these pages: `make docs`, then open out/docs/index.html; it needs no network."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import linked_pages  # noqa: E402  # of this tree
from live_reports import write_reports  # noqa: E402  # of this tree
from reference_pages import write_pages  # noqa: E402  # of this tree

from postproc.base.version import VERSION  # noqa: E402  # of this tree

project = "postproc"
author = "the postproc maintainers"
project_copyright = "MIT licence"
release = VERSION
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
napoleon_google_docstring = True
man_pages = [("reference/generated/commands", "postproc", "CL file in, proved G-code out", author, 1)]
html_theme = "furo"
html_title = f"postproc {VERSION}"
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}
nitpicky = False
write_pages(HERE / "reference" / "generated")
linked_pages.write_pages()
write_reports(HERE / "reference" / "generated" / "pages" / "reports")
html_extra_path = ["reference/generated/pages"]  # its folder `reports` stands at the top of the site


def setup(app: Any) -> None:
    """Links to documents of the tree lead to their pages."""
    app.connect("source-read", _linked)


def _linked(app: Any, name: str, source: list[str]) -> None:
    page = HERE / f"{name}.md"
    if linked_pages.COPIES not in page.parents:
        source[0] = linked_pages.linked(source[0], page)
