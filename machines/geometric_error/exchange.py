"""Writing error models, and exchange with controls: tables per axis with ISO 230-1 names, LinuxCNC screw compensation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from machines.geometric_error.covariance import angular, write_covariance
from machines.geometric_error.csv_table import UNITS, write_csv
from machines.geometric_error.curves import EVERYWHERE, Curve, Fourier, Polynomial, Table
from machines.geometric_error.lattice import ErrorMap
from machines.geometric_error.lattice_file import map_to_csv
from machines.geometric_error.model import ErrorModel
from machines.geometric_error.names import ErrorName
from machines.geometric_error.rods import RodErrors
from machines.geometric_error.serial_errors import Component, SerialErrors
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import DEG

ROTARY = "ABC"
LENGTH, ANGLE = "um", "arcsec"
LINUXCNC_ROWS = 256
"""entries that LinuxCNC's motion module holds per joint (EMCMOT_COMP_SIZE)"""


def write_model(model: ErrorModel, description: str = "") -> dict[str, str]:
    """File name -> text: the TOML file and its CSV tables, which `load` reads back to their resolution."""
    files: dict[str, str] = {}
    stem = model.name or "errors"
    head = [f"description = {_quoted(description)}"] if description else []
    head += [f"machine = {_quoted(model.machine)}"] if model.machine else []
    head += [f'corrected_by = "{model.corrected_by}"', f'length_unit = "{LENGTH}"', f'angle_unit = "{ANGLE}"']
    body = [*_component_lines(model.axes, stem, files), *_constant_lines(model.axes), *_reference_lines(model.axes)]
    body += [] if model.rods is None else _leg_lines(model.rods)
    if model.map is not None:
        files[f"{stem}-map.csv"] = map_to_csv(model.map)
        body += _map_lines(model.map, f"{stem}-map.csv")
    body += _doubt_lines(model, stem, files)
    return {f"{stem}.toml": "\n".join([*head, *body, ""])} | files


def save(model: ErrorModel, folder: Path, description: str = "") -> list[Path]:
    """Write the files of a model into a folder; their paths, the TOML file first."""
    paths = []
    for name, text in write_model(model, description).items():
        paths.append(folder / name)
        paths[-1].write_text(text, encoding="utf-8")
    return paths


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _doubt_lines(model: ErrorModel, stem: str, files: dict[str, str]) -> list[str]:
    """Independent parameters as [sigma], one line per component where it is one number; else a covariance table."""
    if model.covariance is None:
        return []
    variance = np.diag(model.covariance)
    if np.count_nonzero(model.covariance - np.diag(variance)):
        files[f"{stem}-covariance.csv"] = write_covariance(model)
        return ["", "[covariance]", f'table = "{stem}-covariance.csv"']
    groups: dict[str, dict[str, float]] = {}
    for name, value in zip(model.names, np.sqrt(variance), strict=True):
        whole = name if model.axes.names == [] or name in model.axes.constants else name.split("[")[0].split(".")[0]
        groups.setdefault(whole, {})[name] = float(value / UNITS[ANGLE if angular(name) else LENGTH])
    lines = ["", "[sigma]"]
    for whole, given in groups.items():
        one = {whole: next(iter(given.values()))} if np.ptp(list(given.values())) <= 1e-12 else given
        lines += [f"{_quoted(name)} = {value:.12g}" for name, value in one.items() if value > 0.0]
    return lines if len(lines) > 2 else []


def _component_lines(axes: SerialErrors, stem: str, files: dict[str, str]) -> list[str]:
    lines: list[str] = []
    tables: dict[tuple[str, bytes], str] = {}
    for component in axes.components:
        name, curve = component.name, component.curve
        lines += ["", f"[components.{name}]"]
        if not isinstance(curve, Table):
            lines += _curve_lines(component)
            continue
        key = (name.axis, curve.x.tobytes())
        if key not in tables:
            more = sum(axis == name.axis for axis, _ in tables)
            tables[key] = f"{stem}-{name.axis}{more + 1 if more else ''}.csv"
            same = [c for c in axes.components if c.name.axis == name.axis and isinstance(c.curve, Table)
                    and c.curve.x.tobytes() == key[1]]
            files[tables[key]] = table_to_csv(same)
        period = [f"repeats = {curve.period / _scales(name)[0]:.15g}"] if curve.period else []
        lines += [f'table = "{tables[key]}"', f'interpolation = "{curve.rule}"', *period]
    return lines


def _curve_lines(component: Component) -> list[str]:
    curve, (position, unit) = component.curve, _scales(component.name)
    span = [] if curve.range == EVERYWHERE else [f"range = {_list(np.array(curve.range) / position)}"]
    if isinstance(curve, Polynomial):
        return [f"polynomial = {_list(curve.values / unit)}", f"origin = {curve.origin / position!r}",
                f"scale = {curve.scale / position!r}", *span]
    assert isinstance(curve, Fourier)
    mean, cosine, sine = np.split(curve.values / unit, [1, 1 + len(curve.values) // 2])
    return [f"mean = {_number(mean[0])}", f"cosine = {_list(cosine)}", f"sine = {_list(sine)}",
            f"origin = {curve.origin / position!r}", f"repeats = {curve.period / position:.15g}", *span]


def table_to_csv(components: Sequence[Component]) -> str:
    """Tables of one axis at the same positions under their ISO 230-1 names, both ways where they have them."""
    axis, x = components[0].name.axis, _table_of(components[0]).x
    columns = {axis: ("deg" if axis in ROTARY else "mm", x)}
    for component in components:
        table, name = _table_of(component), component.name
        ways = np.split(table.values, 2) if table.both else [table.values]
        labels = [f"{name}+", f"{name}-"] if table.both else [str(name)]
        columns |= {label: (ANGLE if name.angular else LENGTH, v) for label, v in zip(labels, ways, strict=True)}
    return write_csv(columns, [f"errors of {axis}: actual less commanded, tool relative to part"])


def _table_of(component: Component) -> Table:
    assert isinstance(component.curve, Table)
    return component.curve


def _constant_lines(axes: SerialErrors) -> list[str]:
    if not axes.constants:
        return []
    scale = {text: UNITS[ANGLE if text[1] in ROTARY else LENGTH] for text in axes.constants}
    return ["", "[location]", *(f"{text} = {_number(value / scale[text])}" for text, value in axes.constants.items())]


def _reference_lines(axes: SerialErrors) -> list[str]:
    lines: list[str] = []
    turning = {c.name.axis for c in axes.components if c.name.axis in ROTARY} | set(axes.frame)
    for axis in sorted({*axes.reference, *turning}):
        lines += ["", f"[reference.{axis}]"]
        lines += [f"point = {_list(axes.reference[axis])}"] if axis in axes.reference else []
        lines += [f'frame = "{axes.frame.get(axis, "fixed")}"'] if axis in turning else []
    return lines


def _map_lines(error_map: ErrorMap, table: str) -> list[str]:
    unit = {letter: DEG if letter in ROTARY else 1.0 for letter in error_map.letters}
    periods = [f"{letter} = {_number(period / unit[letter])}" for letter, period in
               zip(error_map.letters, error_map.periods, strict=True) if period]
    return ["", "[map]", f"table = {_quoted(table)}", f"tool_length = {_number(error_map.length)}",
            f'directions = "{"machine" if error_map.bed else "table"}"',
            *([f"repeats = {{ {', '.join(periods)} }}"] if periods else [])]


def _leg_lines(rods: RodErrors) -> list[str]:
    lines: list[str] = []
    length, angle = UNITS[LENGTH], UNITS[ANGLE]
    for k, leg in enumerate(rods.legs):
        mine = [r for r, name in enumerate(rods.rods) if name.startswith(leg)]
        pair = [f"pair = {_number(rods.pairs[k])}"] if rods.pairs else []
        lines += ["", f"[legs.{leg}]", *pair, f"rail = {_list(rods.rail[k] / length)}",
                  f"guide = {_list(rods.guide[k] / angle)}"]
        lines += [f"{what} = [{', '.join(_list(getattr(rods, what)[r] / length) for r in mine)}]"
                  for what in ("carriage", "platform")]
        lines.append(f"length = {_list(rods.length[mine] / length)}")
    return lines


def _list(values: Floats | Sequence[float]) -> str:
    return "[" + ", ".join(_number(v) for v in values) + "]"


def _number(value: float) -> str:
    """Twelve digits: far below what a length or angle can be known to."""
    text = f"{float(value):.12g}"
    return text if any(mark in text for mark in ".e") else text + ".0"


def _scales(name: ErrorName) -> tuple[float, float]:
    return DEG if name.axis in ROTARY else 1.0, UNITS[ANGLE if name.angular else LENGTH]


def sampled(curve: Curve, positions: Floats) -> Table:
    """Any curve as a linear table at positions (M,), mm or rad, both ways where it has them; what controls can hold."""
    both = isinstance(curve, Table) and curve.both
    ways = (1.0, -1.0) if both else (0.0,)
    return Table(positions, np.concatenate([curve.at(positions, way) for way in ways]), "linear", both)


# ---- LinuxCNC -------------------------------------------------------------------------------------------------------

def to_linuxcnc(name: ErrorName, table: Table, sense: float = 1.0) -> str:
    """A screw compensation file (COMP_FILE with COMP_FILE_TYPE = 0) of a positioning error: nominal, forward, reverse.

    Type 0 holds where the axis really is when it is sent to the nominal position; LinuxCNC adds nominal less actual to
    the motor's command, linearly between the rows, by the way of the last motion (LinuxCNC, Integrator's manual, INI
    configuration, [JOINT_n]). mm and degrees.

    Args:
        sense: -1 where the axis counts against the direction of ISO 841

    Raises:
        ValueError: where LinuxCNC cannot hold it.
    """
    if name.location or name.part != "XYZABC".find(name.axis):
        raise ValueError(f"{name} is no positioning error; LinuxCNC's screw compensation holds EXX, EYY, ... ECC")
    if table.rule != "linear" or table.period:
        raise ValueError(f"{name} is no plain linear table; take `sampled` at the positions that you want")
    if len(table.x) > LINUXCNC_ROWS:
        raise ValueError(f"{name} has {len(table.x)} rows, LinuxCNC holds {LINUXCNC_ROWS}; take `sampled` at fewer")
    unit = DEG if name.axis in ROTARY else 1.0
    forward, backward = np.split(table.values, 2) if table.both else (table.values, table.values)
    rows = np.stack([table.x, table.x + sense * forward, table.x + sense * backward], axis=1) / unit
    return "\n".join([*(" ".join(f"{x:.9f}" for x in row) for row in rows), ""])


def from_linuxcnc(text: str, name: ErrorName, sense: float = 1.0, kind: int = 0,
                  file: str = "") -> tuple[Table | None, list[Diagnostic]]:
    """The table of a screw compensation file; None and what is wrong.

    Args:
        kind: COMP_FILE_TYPE: 0 actual positions, 1 trims (nominal less actual)
    """
    rows: list[list[float]] = []
    for n, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            row = [float(word) for word in line.split()]
        except ValueError:
            row = []
        if len(row) != 3 or not np.isfinite(row).all() or (rows and row[0] <= rows[-1][0]):
            return None, [error("error-table.row", f"{line.strip()!r}: expected nominal, forward, reverse, nominal "
                                "ascending", file=file, lines=[n])]
        rows.append(row)
    if not rows or kind not in (0, 1):
        return None, [error("error-table.empty", f"no rows, or COMP_FILE_TYPE = {kind} is neither 0 nor 1", file=file)]
    nominal, forward, backward = np.array(rows).T * (DEG if name.axis in ROTARY else 1.0)
    errors = [sense * (way - nominal if kind == 0 else -way) for way in (forward, backward)]
    if np.array_equal(errors[0], errors[1]):
        return Table(nominal, errors[0]), []
    return Table(nominal, np.concatenate(errors), both=True), []


def with_component(model: ErrorModel, name: ErrorName, curve: Curve) -> ErrorModel:
    """The model with one component error put in or replaced; its covariance no longer fits and is taken out."""
    kept = tuple(c for c in model.axes.components if c.name != name)
    return replace(model, axes=replace(model.axes, components=(*kept, Component(name, curve))), covariance=None)
