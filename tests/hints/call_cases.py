"""Hints of what no command line leads to: calls of the package, files of killed runs, outputs that are one file."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from unittest.mock import patch

import numpy as np

import postproc
from postproc.base.options import Options
from postproc.setup.model import SetupFile
from postproc.verification.neighbour_files import unfinished
from postproc.verification.residual_errors import after_formatting, beyond_bound
from tests.postproc.kit import machine, toolpath
from toolpaths import interrupted_runs as runs
from toolpaths.diagnostics import Diagnostic, DiagnosticError
from toolpaths.extras import need
from toolpaths.toolpath import Toolpath
from toolpaths.transaction import write_together


@dataclass(frozen=True)
class CallCase:
    """One code, one hint.

    Attributes:
        says: what the hint says, a regular expression
        wrong: what is said of the fault, in a folder of its own
        right: what is said when the hint is obeyed
    """

    code: str
    says: str
    wrong: Callable[[Path], list[Diagnostic]]
    right: Callable[[Path], list[Diagnostic]]


SHEET = SetupFile.model_validate({"tools": {"1": {"gauge_length": 80.0}}})
CUTS = "RAPID", "GOTO/5,0,30", "GOTO/5,0,0", "GOTO/9,0,0", "RAPID", "GOTO/9,0,30"
ROUND = "GOTO/5,0,0", "CIRCLE/0,0,0,0,0,1,5", "GOTO/0,5,0"
DEAD = f"postproc-{runs._where()}-999999999-1-00000000"


def _said(path: Toolpath, controller: str = "linuxcnc") -> list[Diagnostic]:
    return list(postproc.convert(path, machine("mill-3axis"), controller, SHEET).diagnostics)


def _arc(begins: bool) -> list[Diagnostic]:
    """An arc behind a point, or as the first that there is."""
    path = toolpath(*ROUND)
    return _said(path if begins else replace(path, arc=np.where(np.arange(len(path)) == 0, 0, path.arc)))


def _spin(held: bool) -> list[Diagnostic]:
    path = toolpath(*CUTS)
    return _said(replace(path, spin=np.full(len(path), 0.5)) if held else path)


def _two_outputs(folder: Path, other: str) -> list[Diagnostic]:
    """A program, and what another name of its file leads to."""
    (folder / "a.nc").write_text("old")
    (folder / "link.nc").symlink_to(folder / "a.nc")
    try:
        write_together({folder / "a.nc": "1", folder / other: "2"})
    except DiagnosticError as fault:
        return list(fault.diagnostics)
    return []


def _killed(folder: Path) -> Path:
    """A folder in which a run was killed when it had replaced one of two files."""
    old = runs.temporary(folder / "O1001", DEAD, runs.OLD)
    old.write_text("old")
    (folder / "O1001").write_text("new text of a run that was killed")
    entry = runs.Entry("O1001", "gone", old.name, runs.mark_of(folder / "O1001"))
    runs.temporary(folder / "main.nc", DEAD, runs.JOURNAL).write_text(runs.journal_text([entry]))
    (folder / "main.nc").write_text("old")
    return folder / "main.nc"


def _written_again(folder: Path) -> list[Diagnostic]:
    """What the next command says that writes there, and what is said of the program then."""
    program = _killed(folder)
    write_together({program: "new"})
    assert (folder / "O1001").read_text() == "old"
    return unfinished(program)


def _lost(folder: Path) -> list[Diagnostic]:
    """As `_killed`, and what stood there before is gone."""
    _killed(folder)
    runs.temporary(folder / "O1001", DEAD, runs.OLD).unlink()
    return runs.clean(folder)


def _all_anew(folder: Path) -> list[Diagnostic]:
    assert _lost(folder)
    write_together({folder / "O1001": "new", folder / "main.nc": "new"})
    return runs.clean(folder)


def _words(folder: Path, decimals: int) -> list[Diagnostic]:
    """Corrected words with so many decimals, held against 3 um."""
    (folder / "e.toml").write_text("[components.EYX]\npolynomial = [0.0, 0.01]\nrange = [-500, 500]\n")
    (folder / "c.toml").write_text(f'base = "linuxcnc"\n[format]\nlinear_decimals = {decimals}\n')
    path = toolpath("RAPID", "GOTO/5,0,30", "GOTO/5,0,0", "GOTO/9.0049,0.0046,0", "RAPID", "GOTO/9,0,30")
    result = postproc.convert(path, machine("mill-3axis"), folder / "c.toml", SHEET,
                              Options(error_model=str(folder / "e.toml"), tolerance=0.05))
    found = after_formatting(result)
    assert found is not None and result.job is not None, [str(d) for d in result.diagnostics]
    return beyond_bound(replace(found, tip_bound=0.003), result.job)


def _package(installed: bool) -> list[Diagnostic]:
    """What a drawing says of an installation with and without the package that it needs."""
    with nullcontext() if installed else patch("toolpaths.extras.importlib.util.find_spec", lambda name: None):
        try:
            need("matplotlib", "drawings need")
        except DiagnosticError as fault:
            return list(fault.diagnostics)
    return []


CALLS = [
    CallCase("arc.no_start", "put FROM or a GOTO before CIRCLE", lambda _: _arc(False), lambda _: _arc(True)),
    CallCase("axis.spin", "leave Toolpath.spin out", lambda _: _spin(True), lambda _: _spin(False)),
    CallCase("file.twice", "give them different names", lambda at: _two_outputs(at, "link.nc"),
             lambda at: _two_outputs(at, "b.nc")),
    CallCase("file.unfinished", "convert again", lambda at: unfinished(_killed(at)), _written_again),
    CallCase("file.not_recovered", "write the program again, all its files", _lost, _all_anew),
    CallCase("geometric_errors.bound", r"more decimals in the controller's \[format\]", lambda at: _words(at, 2),
             lambda at: _words(at, 4)),
    CallCase("extra.missing", r"pip install 'postproc\[figures\]'", lambda _: _package(False), lambda _: _package(True)),
]
