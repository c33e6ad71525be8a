"""The files of a residual field: a table, or drawn."""

from __future__ import annotations

from postproc.pipeline.result import PostResult
from postproc.report.residuals import as_csv, residuals
from toolpaths.choices import FieldEnding
from toolpaths.diagnostics import Diagnostic, error


def contents(result: PostResult, endings: list[FieldEnding]) -> tuple[list[str | bytes], list[Diagnostic]]:
    """What files of these endings hold: the field as a table, or drawn; nothing, and why, where there is none."""
    found = residuals(result) if result.ok else None
    if found is None:
        return [], [no_field(result.options.error_model)] if result.ok else []
    from postproc.report.residual_figure import residual_figure

    return [as_csv(found, result) if ending == ".csv" else residual_figure(found, ending)
            for ending in endings], []


def no_field(file: str) -> Diagnostic:
    """Why a conversion without correction has none."""
    return error("residuals.none", "the error model says that the control corrects: the program is nominal and leaves no "
                 "residuals to write", file=file, hint='leave --residuals out, or corrected_by = "post" in the model')
