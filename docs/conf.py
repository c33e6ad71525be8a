"""Sphinx builds the site from these pages: `make docs`, then open out/docs/index.html; it needs no network."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

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
suppress_warnings = ["myst.xref_missing"]  # links to files of the source tree, which the site does not hold
write_pages(HERE / "reference" / "generated")
write_reports(HERE / "reference" / "generated" / "pages" / "reports")
html_extra_path = ["reference/generated/pages"]  # its folder `reports` stands at the top of the site
