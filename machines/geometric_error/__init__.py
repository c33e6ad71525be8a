"""Geometric errors of machines: models, their files, the machine with errors, and its corrected commands."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from machines.geometric_error.actual import Actual, approach
    from machines.geometric_error.actual_kinematics import ActualKinematics
    from machines.geometric_error.correction import Corrected, correct
    from machines.geometric_error.loader import error_model_schema, load, load_checked
    from machines.geometric_error.model import Doubt, ErrorModel, doubt

_HOME = {"Actual": "actual", "approach": "actual", "ActualKinematics": "actual_kinematics", "Corrected": "correction",
         "correct": "correction", "error_model_schema": "loader", "load": "loader", "load_checked": "loader",
         "Doubt": "model", "ErrorModel": "model", "doubt": "model"}
__all__ = ["Actual", "ActualKinematics", "Corrected", "Doubt", "ErrorModel", "approach", "correct", "doubt",
           "error_model_schema", "load", "load_checked"]


def __getattr__(name: str) -> Any:
    """Names are imported when they are first used, so that importing the package is light."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
