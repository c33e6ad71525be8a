"""Covariance of an error model's parameters: from standard deviations in its file, or a square CSV table."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from machines.geometric_error.actual.bearings import ANGLES
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.rods import RodErrors
from machines.geometric_error.files.file_models import ErrorFileModel
from machines.geometric_error.tables.csv_table import UNITS, read_text
from machines.geometric_error.tables.names import parse
from machines.user_file import UserFile
from machines.value_words import nearest
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, Severity, error

SYMMETRIC = 1e-6
"""largest difference of two mirrored entries, and negative eigenvalue, relative to the largest entry"""


MOST = 12_000
"""parameters whose covariance is held: 1.2 GB"""


def angular(name: str, rods: RodErrors | None = None) -> bool:
    """True for parameters in rad, of a machine with these rods."""
    part = name.split(".")[-2] if name.count(".") > 1 else ""
    if part:
        return part in ANGLES or name.endswith(".square")
    if name.endswith(".drive"):
        return rods is not None and name.split(".")[0] in rods.arms
    if "]." in name:
        return name.rsplit(".", 1)[1].startswith("r")
    known = parse(name.split("[")[0].split(".")[0])
    return known is not None and known.angular


def units(names: list[str], model: ErrorFileModel, rods: RodErrors | None) -> Floats:
    """(P,) mm or rad per unit of the file."""
    return np.array([UNITS[model.angle_unit if angular(name, rods) else model.length_unit] for name in names])


def covariance_of(model: ErrorModel, file: UserFile,
                  checked: ErrorFileModel) -> tuple[ErrorModel, list[Diagnostic]]:
    """The model with the covariance that its file gives; without it, reported, where it has more parameters than MOST."""
    given = "covariance" if checked.covariance is not None else "sigma"
    if checked.covariance is None and not checked.sigma:
        return model, []
    names, found = model.names, list[Diagnostic]()
    if len(names) > MOST:
        noted = file.problem(f"error-model.{given}", (given,),
                             f"the uncertainty of {len(names)} parameters is not reported, at most "
                             f"that of {MOST} is",
                             f"a map of fewer nodes, or take [{given}] out; the correction is the same")
        return model, [replace(noted, severity=Severity.WARNING)]
    if checked.covariance is not None:
        origin = file.origin(("covariance", "table"))
        path = Path(origin.file).parent / checked.covariance.table
        scale = units(names, checked, model.rods)
        matrix, found = read_covariance(path, names, (origin.file, origin.line))
        return (model if matrix is None else replace(model, covariance=matrix * np.outer(scale, scale))), found
    sigma = np.zeros(len(names))
    for prefix in sorted(checked.sigma, key=len):
        mine = [k for k, name in enumerate(names) if name.startswith(prefix)]
        sigma[mine] = checked.sigma[prefix]
        if not mine:
            found.append(file.problem("error-model.sigma", ("sigma", prefix), f"no parameter begins with {prefix!r}",
                                      nearest(prefix, names)))
    return replace(model, covariance=np.diag((sigma * units(names, checked, model.rods)) ** 2)), found


def read_covariance(path: Path, names: list[str],
                    cited: tuple[str, int]) -> tuple[Floats | None, list[Diagnostic]]:
    """(P, P) in the order of `names`, in the units of the table; parameters that it leaves out have none."""
    text, found = read_text(path, cited)
    if text is None:
        return None, found
    lines = [(n, x) for n, x in enumerate(text.splitlines(), 1) if x.strip() and not x.startswith("#")]
    head = [cell.strip(' "') for cell in _cells(lines[0][1])[1:]] if lines else []
    fault = _head_fault(head, [n for n, _ in lines], names)
    if fault:
        return None, [error("error-table.row", fault[0], file=str(path), lines=[n for n, _ in lines[:1]], hint=fault[1])]
    matrix = np.zeros((len(head), len(head)))
    for k, ((line, row), name) in enumerate(zip(lines[1:], head, strict=True)):
        values = _row(row, name, len(head))
        if isinstance(values, tuple):
            return None, [error("error-table.row", values[0], file=str(path), lines=[line], hint=values[1])]
        matrix[k] = values
    own, found = _checked(matrix, path, head)
    return (None if own is None else _among(own, head, names)), found


def _among(own: Floats, head: list[str], names: list[str]) -> Floats:
    """(P, P) for all `names` of a covariance of those in `head`; the others have none."""
    index, result = {name: k for k, name in enumerate(names)}, np.zeros((len(names), len(names)))
    place = np.array([index[name] for name in head])
    result[np.ix_(place, place)] = own
    return result


def _head_fault(head: list[str], lines: list[int], names: list[str]) -> tuple[str, str] | None:
    """What is wrong with the first row, and what to do."""
    if not head or len(lines) - 1 != len(head):
        return (f"{max(len(lines) - 1, 0)} rows for {len(head)} parameters", "the table is square: the parameters in the "
                "first row, then a row for each in the same order")
    known, count = set(names), Counter(head)
    for name in head:
        if name not in known:
            return f"the model has no parameter {name[:40]!r}", nearest(name, names)
        if count[name] > 1:
            return f"parameter {name!r} appears twice", "name each parameter once"
    return None


def _row(text: str, name: str, count: int) -> list[float] | tuple[str, str]:
    """The numbers of a row, or what is wrong and what to do."""
    row, *cells = _cells(text)
    if row.strip(' "') != name:
        return f"row {row.strip()[:40]!r}, expected parameter {name!r}", "the rows have the order of the columns"
    if len(cells) != count:
        return (f"row {name!r} has {len(cells)} numbers for {count} parameters", "the table is square, its numbers have "
                "decimal points")
    try:
        values = [float(cell) for cell in cells]
    except ValueError as fault:
        return f"row {name!r}: {fault}", "write numbers with a decimal point"
    return values if np.isfinite(values).all() else (f"row {name!r} holds a number that is not finite",
                                                     "write 0 for none")


def _cells(text: str) -> list[str]:
    """Cells of a line; commas inside brackets belong to a name."""
    inside, cells = 0, [""]
    for letter in text:
        inside += (letter == "[") - (letter == "]")
        if letter in ",;\t" and not inside:
            cells.append("")
        else:
            cells[-1] += letter
    return cells


def _checked(matrix: Floats, path: Path, names: list[str]) -> tuple[Floats | None, list[Diagnostic]]:
    size = float(np.abs(matrix).max(initial=0.0))
    apart = np.abs(matrix - matrix.T)
    if apart.max(initial=0.0) > SYMMETRIC * size:
        i, j = sorted(np.unravel_index(int(np.argmax(apart)), apart.shape))
        return None, [error("error-table.covariance", f"the covariance is not symmetric: {names[i]} with {names[j]} is "
                            f"{matrix[i, j]:g}, reversed {matrix[j, i]:g}", file=str(path),
                            hint="write the same number in both")]
    negative = np.flatnonzero(np.diag(matrix) < 0.0)
    if len(negative):
        return None, [error("error-table.covariance", f"the variance of {names[negative[0]]} is "
                            f"{matrix[negative[0], negative[0]]:g}", file=str(path), hint="a variance is 0 or more")]
    scale = np.sqrt(np.diag(matrix))
    correlation = matrix / np.outer(*(np.where(scale > 0.0, scale, 1.0),) * 2)
    least = float(np.linalg.eigvalsh(0.5 * (correlation + correlation.T)).min(initial=0.0))
    if least < -SYMMETRIC * len(matrix):
        return None, [error("error-table.covariance", f"no parameters can have this covariance: an eigenvalue of its "
                            f"correlation is {least:.3g}, less than 0", file=str(path),
                            hint="correlations lie between -1 and 1 and go together; write more digits")]
    return 0.5 * (matrix + matrix.T), []


def write_covariance(model: ErrorModel) -> str:
    """The text of a covariance table of a model, in the units of its file."""
    scale = np.array([UNITS["arcsec" if angular(name, model.rods) else "um"] for name in model.names])
    matrix = np.zeros((len(scale), len(scale))) if model.covariance is None else model.covariance
    rows = (f"{name}," + ",".join(f"{x:.12g}" for x in row)
            for name, row in zip(model.names, matrix / np.outer(scale, scale), strict=True))
    return "\n".join(["parameter," + ",".join(model.names), *rows, ""])
