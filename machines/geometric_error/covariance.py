"""Covariance of an error model's parameters: from standard deviations in its file, or a square CSV table."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from machines.geometric_error.csv_table import UNITS
from machines.geometric_error.file_models import ErrorFileModel
from machines.geometric_error.model import ErrorModel
from machines.geometric_error.names import parse
from machines.user_file import UserFile, nearest
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, error

SYMMETRIC = 1e-6
"""largest difference of two mirrored entries, and negative eigenvalue, relative to the largest entry"""


def angular(name: str) -> bool:
    """True for parameters in rad."""
    part = name.split(".")[-2] if name.count(".") > 1 else ""
    if part:
        return part == "guide"
    if "]." in name:
        return name.rsplit(".", 1)[1].startswith("r")
    known = parse(name.split("[")[0].split(".")[0])
    return known is not None and known.angular


def units(names: list[str], model: ErrorFileModel) -> Floats:
    """(P,) mm or rad per unit of the file."""
    return np.array([UNITS[model.angle_unit if angular(name) else model.length_unit] for name in names])


def covariance_of(model: ErrorModel, file: UserFile, checked: ErrorFileModel) -> tuple[ErrorModel, list[Diagnostic]]:
    """The model with the covariance that its file gives."""
    if checked.covariance is not None:
        origin = file.origin(("covariance", "table"))
        path = Path(origin.file).parent / checked.covariance.table
        scale = units(model.names, checked)
        matrix, found = read_covariance(path, model.names, (origin.file, origin.line))
        return (model if matrix is None else replace(model, covariance=matrix * np.outer(scale, scale))), found
    if not checked.sigma:
        return model, []
    names, found = model.names, []
    sigma = np.zeros(len(names))
    for prefix in sorted(checked.sigma, key=len):
        mine = [k for k, name in enumerate(names) if name.startswith(prefix)]
        sigma[mine] = checked.sigma[prefix]
        if not mine:
            found.append(file.problem("error-model.sigma", ("sigma", prefix), f"no parameter begins with {prefix!r}",
                                      nearest(prefix, names)))
    return replace(model, covariance=np.diag((sigma * units(names, checked)) ** 2)), found


def read_covariance(path: Path, names: list[str], cited: tuple[str, int]) -> tuple[Floats | None, list[Diagnostic]]:
    """(P, P) in the order of `names`, in the units of the table; parameters that it leaves out have none."""
    try:
        lines = [(n, x) for n, x in enumerate(path.read_text("utf-8-sig").splitlines(), 1) if x.strip() and x[0] != "#"]
    except (OSError, UnicodeDecodeError) as fault:
        return None, [error("error-table.unreadable", f"cannot read covariance table {path.name!r}: {fault}",
                            file=cited[0], lines=[cited[1]])]
    head = [cell.strip() for cell in _cells(lines[0][1])[1:]] if lines else []
    if not head or len(lines) - 1 != len(head):
        return None, [error("error-table.row", f"{len(lines) - 1} rows for {len(head)} parameters; the table is square",
                            file=str(path))]
    index, matrix = {name: k for k, name in enumerate(names)}, np.zeros((len(names), len(names)))
    for (line, text), name in zip(lines[1:], head, strict=True):
        row, *cells = _cells(text)
        if row.strip() != name or name not in index or len(cells) != len(head):
            return None, [error("error-table.row", f"row {row.strip()!r}: expected parameter {name!r} and {len(head)} "
                                "numbers", file=str(path), lines=[line], hint=nearest(name, names))]
        try:
            matrix[index[name], [index[other] for other in head]] = [float(cell) for cell in cells]
        except (ValueError, KeyError) as fault:
            return None, [error("error-table.row", f"cannot read the row: {fault}", file=str(path), lines=[line])]
    return _checked(matrix, path)


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


def _checked(matrix: Floats, path: Path) -> tuple[Floats | None, list[Diagnostic]]:
    size = float(np.abs(matrix).max(initial=0.0))
    scale = np.sqrt(np.abs(np.diag(matrix)))
    scale = np.where(scale > 0.0, scale, 1.0)
    correlation = matrix / np.outer(scale, scale)
    if not np.isfinite(size) or np.abs(matrix - matrix.T).max(initial=0.0) > SYMMETRIC * size:
        return None, [error("error-table.covariance", "the covariance is not symmetric", file=str(path))]
    least = float(np.linalg.eigvalsh(0.5 * (correlation + correlation.T)).min(initial=0.0))
    if least < -SYMMETRIC * len(matrix):
        return None, [error("error-table.covariance", f"the covariance has a negative eigenvalue ({least:.3g} of the "
                            "correlation)", file=str(path), hint="write more digits")]
    return 0.5 * (matrix + matrix.T), []


def write_covariance(model: ErrorModel, length: float = UNITS["um"], angle: float = UNITS["arcsec"]) -> str:
    """The text of a covariance table of a model, in the units of its file."""
    scale = np.array([angle if angular(name) else length for name in model.names])
    matrix = np.zeros((len(scale), len(scale))) if model.covariance is None else model.covariance
    rows = (f"{name}," + ",".join(f"{x:.12g}" for x in row)
            for name, row in zip(model.names, matrix / np.outer(scale, scale), strict=True))
    return "\n".join(["parameter," + ",".join(model.names), *rows, ""])
