"""Writing error models: a TOML file, and next to it tables per axis with ISO 230-1 names, maps, covariance."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.rods import RodErrors
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.files.covariance import angular, write_covariance
from machines.geometric_error.tables.csv_table import UNITS, write_csv
from machines.geometric_error.tables.curves import EVERYWHERE, Fourier, Polynomial, TableCurve
from machines.geometric_error.tables.lattice import ErrorMap
from machines.geometric_error.tables.lattice_file import map_to_csv
from machines.geometric_error.tables.names import ErrorName
from machines.kinematics.chain import ROTARY
from toolpaths.arrays import Floats
from toolpaths.transaction import write_together
from toolpaths.units import DEG

LENGTH, ANGLE = "um", "arcsec"


def write_model(model: ErrorModel, description: str = "") -> dict[str, str]:
    """File name -> text: the TOML file and its CSV tables, which `load` reads back to their resolution."""
    files: dict[str, str] = {}
    stem = model.name or "errors"
    head = [f"description = {_quoted(description)}"] if description else []
    head += [f"machine = {_quoted(model.machine)}"] if model.machine else []
    head += [f'corrected_by = "{model.corrected_by}"', f'length_unit = "{LENGTH}"', f'angle_unit = "{ANGLE}"']
    head += ["large = true"] if model.large else []
    body = [*_component_lines(model.axes, stem, files), *_constant_lines(model.axes), *_reference_lines(model.axes)]
    body += [] if model.rods is None else _leg_lines(model.rods)
    if model.map is not None:
        files[f"{stem}-map.csv"] = map_to_csv(model.map)
        body += _map_lines(model.map, f"{stem}-map.csv")
    body += _uncertainty_lines(model, stem, files)
    return {f"{stem}.toml": "\n".join([*head, *body, ""])} | files


def save(model: ErrorModel, folder: Path, description: str = "") -> list[Path]:
    """Write the files of a model into a folder; their paths, the TOML file first."""
    files = {folder / name: text for name, text in write_model(model, description).items()}
    write_together(dict(reversed(files.items())))
    return list(files)


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _uncertainty_lines(model: ErrorModel, stem: str, files: dict[str, str]) -> list[str]:
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
        groups.setdefault(whole, {})[name] = float(value / UNITS[ANGLE if angular(name, model.rods) else LENGTH])
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
        if not isinstance(curve, TableCurve):
            lines += _curve_lines(component)
            continue
        key = (name.axis, curve.x.tobytes())
        if key not in tables:
            more = sum(axis == name.axis for axis, _ in tables)
            tables[key] = f"{stem}-{name.axis}{more + 1 if more else ''}.csv"
            same = [c for c in axes.components if c.name.axis == name.axis and isinstance(c.curve, TableCurve)
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
    """Tables of one axis at the same positions under their ISO 230-1 names, both directions where they have them."""
    axis, x = components[0].name.axis, _table_of(components[0]).x
    columns = {axis: ("deg" if axis in ROTARY else "mm", x)}
    for component in components:
        table, name = _table_of(component), component.name
        approaches = np.split(table.values, 2) if table.both else [table.values]
        labels = [f"{name}+", f"{name}-"] if table.both else [str(name)]
        columns |= {label: (ANGLE if name.angular else LENGTH, v) for label, v in zip(labels, approaches, strict=True)}
    return write_csv(columns, [f"errors of {axis}: actual less commanded, tool relative to part"])


def _table_of(component: Component) -> TableCurve:
    assert isinstance(component.curve, TableCurve)
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
        if len(rods.drive):
            lines.append(f"drive = {_number(rods.drive[k] / (angle if leg in rods.arms else length))}")
        lines += _bearing_lines(rods, f"{leg}.")
    for table in dict.fromkeys(".".join(name.split(".")[:2]) for name in rods.bearing_names
                               if name.startswith(("bars.", "passive."))):
        lines += ["", f"[{table}]", *_bearing_lines(rods, f"{table}.")]
    return lines


def _bearing_lines(rods: RodErrors, table: str) -> list[str]:
    """The keys of a table, whose parameters begin with `table`."""
    found: dict[str, list[float]] = {}
    for name, value in zip(rods.bearing_names, rods.bearings, strict=True):
        if name.startswith(table):
            unit = UNITS[ANGLE if angular(name) else LENGTH]
            found.setdefault(name.removeprefix(table).split(".")[0], []).append(value / unit)
    return [f"{key} = {_list(values) if len(values) > 1 else _number(values[0])}" for key, values in found.items()]


def _list(values: Floats | Sequence[float]) -> str:
    return "[" + ", ".join(_number(v) for v in values) + "]"


def _number(value: float) -> str:
    """Twelve digits: far below what a length or angle can be known to."""
    text = f"{float(value):.12g}"
    return text if any(mark in text for mark in ".e") else text + ".0"


def _scales(name: ErrorName) -> tuple[float, float]:
    return DEG if name.axis in ROTARY else 1.0, UNITS[ANGLE if name.angular else LENGTH]
