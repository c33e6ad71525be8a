"""Decides and writes: CL file in, proved G-code out."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from postproc.base.options import Options
    from postproc.base.version import VERSION
    from postproc.pipeline.convert import convert, verify
    from postproc.pipeline.result import PostResult, VerifyResult

_HOME = {"VERSION": "base.version", "Options": "base.options", "PostResult": "pipeline.result",
         "VerifyResult": "pipeline.result", "convert": "pipeline.convert", "verify": "pipeline.convert"}
__all__ = ["VERSION", "Options", "PostResult", "VerifyResult", "convert", "verify"]


def __getattr__(name: str) -> Any:
    """The public calls, imported on first use so that the command line starts at once."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
