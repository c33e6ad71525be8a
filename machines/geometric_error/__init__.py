"""Geometric errors of machines: models, their files, the machine with errors, and its corrected commands."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from machines.geometric_error.actual.actual import Actual, approach
    from machines.geometric_error.actual.actual_kinematics import ActualKinematics
    from machines.geometric_error.actual.correction import CorrectedCommands, correct
    from machines.geometric_error.actual.model import ErrorModel, Uncertainty, doubt
    from machines.geometric_error.files.loader import error_model_schema, load, load_checked

_HOME = {"Actual": "actual.actual", "approach": "actual.actual",
         "ActualKinematics": "actual.actual_kinematics", "CorrectedCommands": "actual.correction",
         "correct": "actual.correction",
         "error_model_schema": "files.loader", "load": "files.loader", "load_checked": "files.loader",
         "Uncertainty": "actual.model", "ErrorModel": "actual.model", "doubt": "actual.model"}
__all__ = ["Actual", "ActualKinematics", "CorrectedCommands", "ErrorModel", "Uncertainty", "approach", "correct", "doubt",
           "error_model_schema", "load", "load_checked"]


def __getattr__(name: str) -> Any:
    """Names are imported when they are first used, so that importing the package is light."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
