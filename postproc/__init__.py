"""Decides and writes: CL file in, proved G-code out."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from postproc.options import Options
    from postproc.pipeline import convert, verify
    from postproc.result import PostResult, VerifyResult
    from postproc.version import VERSION

_HOME = {"VERSION": "version", "Options": "options", "PostResult": "result", "VerifyResult": "result",
         "convert": "pipeline", "verify": "pipeline"}
__all__ = ["VERSION", "Options", "PostResult", "VerifyResult", "convert", "verify"]


def __getattr__(name: str) -> Any:
    """The public calls, imported on first use so that the command line starts at once."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
