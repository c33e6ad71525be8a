"""Decides and writes: CL file in, proved G-code out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from postproc.options import Options
    from postproc.pipeline import PostResult, VerifyResult, convert, verify

VERSION = "0.1.0"

__all__ = ["VERSION", "Options", "PostResult", "VerifyResult", "convert", "verify"]


def __getattr__(name: str) -> Any:
    """The public calls, imported on first use so that the command line starts at once."""
    if name == "Options":
        from postproc.options import Options

        return Options
    if name in __all__:
        from postproc import pipeline

        return getattr(pipeline, name)
    raise AttributeError(f"module 'postproc' has no attribute {name!r}")
