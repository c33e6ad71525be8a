"""Packages that an installation may be without: what needs one says in a line how to get it."""

from __future__ import annotations

import importlib.util

from toolpaths.diagnostics import DiagnosticError, error

EXTRAS = {"matplotlib": ("matplotlib", "figures"), "fcl": ("python-fcl", "collision"), "rtree": ("rtree", "collision"),
          "distributed": ("distributed", "batch"), "toppra": ("toppra", "check")}
"""by import name: name of the package, extra of pyproject.toml that brings it"""


def need(name: str, what: str) -> None:
    """Go on where a package of EXTRAS is installed.

    Args:
        name: as it is imported
        what: needs it, for people: "drawings need"

    Raises:
        DiagnosticError: names the package and the extra that brings it.
    """
    package, extra = EXTRAS[name]
    if importlib.util.find_spec(name) is None:
        raise DiagnosticError([error("extra.missing", f"{what} the package {package}, which is not installed",
                                     hint=f"pip install 'postproc[{extra}]'")])
