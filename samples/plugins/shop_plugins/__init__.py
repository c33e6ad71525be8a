"""Plug-ins of a shop for postproc, one for each group of entry points; pyproject.toml next to this folder registers them."""
