"""Decides and writes: CL file in, proved G-code out."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from postproc.base.options import Options
    from postproc.base.version import VERSION
    from postproc.pipeline.result import PostResult, VerifyResult
    from postproc.python.calls import analyse, calibrate, orient, place, time
    from postproc.python.conversion import convert, verify
    from toolpaths.diagnostics import DiagnosticError
    from toolpaths.toolpath import Toolpath

_HOME = {"DiagnosticError": "toolpaths.diagnostics", "Options": "postproc.base.options",
         "PostResult": "postproc.pipeline.result", "Toolpath": "toolpaths.toolpath", "VERSION": "postproc.base.version",
         "VerifyResult": "postproc.pipeline.result",
         **dict.fromkeys(("convert", "verify"), "postproc.python.conversion"),
         **dict.fromkeys(("analyse", "calibrate", "orient", "place", "time"), "postproc.python.calls")}
__all__ = ["VERSION", "DiagnosticError", "Options", "PostResult", "Toolpath", "VerifyResult", "analyse", "calibrate",
           "convert", "orient", "place", "time", "verify"]


def __getattr__(name: str) -> Any:
    """The public calls, imported on first use so that the command line starts at once."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from postproc.base import neighbours

    if other := neighbours.foreign():
        raise ImportError(other)
    return getattr(import_module(_HOME[name]), name)
