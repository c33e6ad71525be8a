"""From tables of others to a model: CSV per axis with ISO 230-1 names, location errors, lattices, LinuxCNC's screw files."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path

import numpy as np

from machines.geometric_error.actual.actual_map import part_side
from machines.geometric_error.actual.axis_motion import effect
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import Component, ErrorFrame, SerialErrors
from machines.geometric_error.exchange.bed_frame import bed_side
from machines.geometric_error.exchange.exports import joint_sense, leans
from machines.geometric_error.exchange.tabulate import merged
from machines.geometric_error.exchange.uncertainty_of_means import with_scatter
from machines.geometric_error.files.covariance import angular, read_covariance
from machines.geometric_error.files.implausible_errors import too_large
from machines.geometric_error.tables.averages import Averaged, averaged
from machines.geometric_error.tables.choices import MapDirections, TableRule
from machines.geometric_error.tables.csv_table import ANGLES, LENGTHS, UNITS, CsvTable, read_csv, read_text
from machines.geometric_error.tables.lattice_file import COORDINATES, map_from_csv, zeroed
from machines.geometric_error.tables.names import DIRECTIONS, OWN, ErrorName, parse
from machines.geometric_error.tables.readings import (
    by_iso_names,
    run_of,
    runs_as_rows,
    together,
    turned_back,
    unknown_columns,
)
from machines.geometric_error.tables.screw_tables import from_linuxcnc
from machines.geometric_error.tables.table_curves import Fault, table_curve
from machines.kinematics.chain import ROTARY
from machines.machine import Machine
from machines.value_words import nearest
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, has_errors, warning
from toolpaths.input_files import read_input

_SCREW = re.compile(r"([A-Z])=(.+)$")
_NAMED = re.compile(r"(E[A-Z][A-Z])=(.+)$")
MAP_COLUMNS = {"dx", "dy", "dz"}


_NOTED = re.compile(r"#\s*error map: (gauge point|tip of a tool of ([\d.e+-]+) mm),.* directions of the (table|machine)")
_FIRST = 1000
"""bytes that hold the first line of a map"""


@dataclass(frozen=True)
class ImportOptions:
    """How sources are to be read.

    Attributes:
        rule: between the rows of tables per axis
        periods: mm or rad, by axis or coordinate that goes round
        sign: -1 where the numbers say how the part moves relative to the tool
        kind: COMP_FILE_TYPE of LinuxCNC's files
        tool_length: mm, of the tool whose tip a map displaces
        directions: of a map
        zero: mm or rad by coordinate: the place at which a map is to be 0; {} takes it as it is
        average: rows at the same place, columns of runs and files of runs are readings of it: their mean
            counts, and their scatter is the uncertainty
        large: errors above 1 mm or 0.5 degrees are so
        near: mm or rad by axis or coordinate: readings no farther apart are of one place
    """

    rule: TableRule = "linear"
    periods: Mapping[str, float] = field(default_factory=dict)
    sign: float = 1.0
    kind: int = 0
    tool_length: float = 0.0
    directions: MapDirections = "table"
    zero: Mapping[str, float] = field(default_factory=dict)
    average: bool = False
    near: Mapping[str, float] = field(default_factory=dict)
    large: bool = False


def read_sources(sources: Sequence[str], machine: Machine,
                 how: ImportOptions) -> tuple[ErrorModel | None, list[Diagnostic]]:
    """The model that all sources make together; None where any has a fault.

    Args:
        sources: `x.csv`: tables per axis, location errors or a lattice, reported by their columns;
            `EXX=x.csv`: positions and runs of one component, whatever its columns are called; `X=x.comp`:
            LinuxCNC's screw compensation of the joint X
    """
    model, places = ErrorModel(machine=machine.name), dict[str, str]()
    parts, found = _parts(sources, machine, how)
    for part, source in parts:
        found += _twice(part, places, source)
        model = replace(part, machine=machine.name) if part.map is not None else merged(model, part)
        if part.map is not None and len(parts) > 1:
            found.append(error("error-import.map", "a map cannot be combined with other sources", file=source,
                               hint=f"import it without the other {len(parts) - 1} sources"))
    if not has_errors(found):
        found += [*fits(model, machine), *_unused(how, model), *_large(model, sources, how)]
        model = replace(model, large=how.large)
    return (None if has_errors(found) else model), found


def _parts(sources: Sequence[str], machine: Machine,
           how: ImportOptions) -> tuple[list[tuple[ErrorModel, str]], list[Diagnostic]]:
    """Models of the sources, with what each is of, LinuxCNC's files first."""
    parts, tables, found = list[tuple[ErrorModel, str]](), list[CsvTable](), list[Diagnostic]()
    for source in sources:
        screw = _SCREW.match(source)
        if screw:
            part, faults = _screw(screw[1], Path(screw[2]), machine, how)
            parts += [] if part is None else [(part, source)]
        else:
            table, faults = _read(source, how)
            tables += [] if table is None else [table]
        found += faults
    for table in together(tables, how.average):
        part, faults = _csv(table, machine, how)
        parts += [] if part is None else [(part, table.file)]
        found += faults
    return parts, found


def _large(model: ErrorModel, sources: Sequence[str], how: ImportOptions) -> list[Diagnostic]:
    """Errors above what machines have."""
    return [(error if one.refused(how.large) else warning)(
        "error-model.large", one.message(how.large), file=", ".join(sources)[:200],
        hint=one.hint(how.large, "headers of columns", "--large")) for one in too_large(model)]


def _unused(how: ImportOptions, model: ErrorModel) -> list[Diagnostic]:
    """What was asked for and concerns none of the sources."""
    letters = {c.name.axis for c in model.axes.components} if model.map is None else set(model.map.letters)
    asked = [f"{letter} repeats" for letter in how.periods if letter not in letters]
    asked += [f"near positions of {letter}" for letter in how.near if letter not in letters]
    if model.map is None:
        given = {"tool length": how.tool_length, "zero": how.zero, "directions of the machine": how.directions == "machine"}
        asked += [f"a map's {what}" for what, value in given.items() if value]
    elif how.rule == "spline":
        asked.append("splines")
    found = [error("error-import.unused", f"no source takes {'that ' * ('repeats' in what)}{what}",
                   hint="leave it out, or add what it is for") for what in asked]
    if how.near and not how.average:
        found.append(error("error-import.unused", "near positions are those of readings", hint="give --average too"))
    return found


def _twice(part: ErrorModel, places: dict[str, str], source: str) -> list[Diagnostic]:
    found = []
    for name in [*(str(c.name) for c in part.axes.components), *part.axes.constants]:
        if name in places:
            found.append(error("error-import.twice", f"{name} is in {places[name]} too", file=source,
                               hint="give every error once; files of several runs: import with --average"))
        places[name] = source
    return found


def fits(model: ErrorModel, machine: Machine) -> list[Diagnostic]:
    """Why a model is none of this machine."""
    try:
        model.on(machine.kinematics)
    except ValueError as fault:
        return [error("error-model.machine", str(fault), hint=f"this machine is {machine.name}")]
    return [error("error-model.no-effect", f"{text} moves nothing", hint="a constant error belongs into the component "
                  + text.replace("0", "", 1)) for text in model.axes.constants
            if (name := parse(text)) is not None and not effect(name, machine.kinematics)]


def with_covariance(model: ErrorModel, path: Path) -> tuple[ErrorModel | None, list[Diagnostic]]:
    """The model with the covariance of a square table, um and arcsec; parameters that it leaves out have none."""
    names = model.names
    matrix, found = read_covariance(path, names, ("", 0))
    if matrix is None:
        return None, found
    scale = [UNITS["arcsec" if angular(name, model.rods) else "um"] for name in names]
    return replace(model, covariance=matrix * np.outer(scale, scale)), []


# ---- CSV ---------------------------------------------------------------------------------------------------

def _read(source: str, how: ImportOptions) -> tuple[CsvTable | None, list[Diagnostic]]:
    """The table of a CSV file, its columns by ISO 230-1 names."""
    named = _NAMED.match(source)
    name = parse(named[1]) if named else None
    if named and name is None:
        return None, [error("error-import.name", f"{named[1]!r} is not a component error", hint="write e.g. EXX=x.csv")]
    table, found = read_csv(Path(named[2] if named else source), gaps=how.average)
    made = None if table is None else by_iso_names(table, name)
    fault = made if isinstance(made, Fault) else None if made is None else _gap(made)
    if table is not None and fault is not None:
        return None, [fault.at(table)]
    assert not isinstance(made, Fault)
    return made, [*found, *(_set_otherwise(made, how) if made is not None and MAP_COLUMNS & set(made.columns) else [])]


def _gap(table: CsvTable) -> Fault | None:
    """A blank cell where no reading can be missing: positions, and constants."""
    places = [name for name in table.columns if name in COORDINATES]
    for name in places or table.columns:
        blank = np.isnan(table.columns[name])
        if blank.any():
            hint = "give the position of every reading" if places else "take the column out where nothing was measured"
            return Fault("error-table.row", f"no number in column {name[:40]}", hint,
                         table.lines[int(np.argmax(blank))])
    return None


def _csv(table: CsvTable, machine: Machine, how: ImportOptions) -> tuple[ErrorModel | None, list[Diagnostic]]:
    places = [name for name in table.columns if name in COORDINATES]
    runs = [name for name in table.columns if run_of(name)[1]]
    if runs and not how.average:
        return None, [error("error-import.runs", f"columns {', '.join(runs)[:80]} are runs", file=table.file,
                            lines=[table.head], hint="import with --average: mean, and uncertainty from the scatter")]
    read = _averaged(table, places, how) if places and (how.average or _holes(table)) else None
    if isinstance(read, Fault):
        return None, [read.at(table)]
    table = table if read is None else read.table
    if MAP_COLUMNS & set(table.columns):
        model, found = _map(table, machine, how)
    elif places:
        model, found = _axis(table, places, machine, how)
    else:
        return _location(table, how)
    if model is None or read is None or not read.scatter:
        return model, found
    model, noted = with_scatter(model, read, how.zero)
    return model, [*found, noted]


def _averaged(table: CsvTable, places: list[str], how: ImportOptions) -> Averaged | Fault:
    rows = runs_as_rows(table)
    for letter in (letter for letter in places if letter in how.periods):
        rows = turned_back(rows, letter, how.periods[letter], how.near.get(letter, 0.0))
    read = averaged(rows, places, how.near)
    if isinstance(read, Averaged) and read.scatter and not how.average:
        return Fault("error-import.runs", f"{read.rows} rows are readings at {len(read.table)} places",
                     "import with --average: their mean counts, their scatter is the uncertainty")
    return read


def _holes(table: CsvTable) -> bool:
    """True for two approach directions of files of their own, each without the other's values."""
    return any(np.isnan(values).any() for values in table.columns.values())


def _map(table: CsvTable, machine: Machine, how: ImportOptions) -> tuple[ErrorModel | None, list[Diagnostic]]:
    periods = {letter: period for letter, period in how.periods.items() if letter in table.columns}
    result, found = map_from_csv(table, periods)
    if result is None or found:
        return None, found
    bed = part_side(machine.kinematics, machine.structure) if how.directions == "machine" else ()
    made = replace(result, length=how.tool_length, bed=bed, table=how.sign * result.table)
    moved = zeroed(made, how.zero) if how.zero else made
    if isinstance(moved, tuple):
        return None, [error("error-map.zero", moved[0], file=table.file, hint=moved[1])]
    return ErrorModel(map=moved), []


def _set_otherwise(table: CsvTable, how: ImportOptions) -> list[Diagnostic]:
    """What the first line of a written map says of its directions and point, where the options say otherwise."""
    noted = _NOTED.match(read_input(table.file)[:_FIRST].decode("utf-8", "replace"))
    if noted is None:
        return []
    length, found = float(noted[2] or 0.0), []
    if noted[3] != how.directions:
        found.append(error("error-import.directions", f"the map says that its directions are those of the {noted[3]}, the "
                           f"import those of the {how.directions}", file=table.file, lines=[1],
                           hint=f"import with --directions {noted[3]}"))
    if abs(length - how.tool_length) > 1e-6:
        found.append(error("error-import.tool_length", f"the map says that it is of the {noted[1]}, the import of a tool of "
                           f"{how.tool_length:g} mm", file=table.file, lines=[1],
                           hint=f"import with --tool-length {length:g}"))
    return found


def _axis(table: CsvTable, positions: list[str], machine: Machine,
          how: ImportOptions) -> tuple[ErrorModel | None, list[Diagnostic]]:
    """Component errors over the positions of one axis."""
    letter = positions[0]
    if len(positions) > 1:
        return None, [error("error-import.axis", f"columns {' and '.join(positions)} are positions of several axes",
                            file=table.file, lines=[table.head], hint="write a table for each axis; a map has dx, dy, dz")]
    if letter not in machine.axis_names:
        small = " in capitals" if letter.upper() in machine.axis_names else ""
        return None, [error("error-model.axis", f"{machine.name} has no axis {letter!r}", file=table.file,
                            lines=[table.head], hint=f"its axes are {', '.join(machine.axis_names)}{small}")]
    names, found = _names(table, letter)
    components = []
    for name in names:
        curve = table_curve(name, table, how.rule, how.periods.get(letter, 0.0), how.sign)
        if isinstance(curve, Fault):
            found.append(curve.at(table))
        else:
            components.append(Component(name, curve))
    if not names and not found:
        found.append(error("error-model.column", f"no errors of {letter}", file=table.file, lines=[table.head],
                           hint=f"write columns {', '.join(f'E{d}{letter} [{_unit(d)}]' for d in DIRECTIONS)}"))
    frame: dict[str, ErrorFrame] = {letter: bed_side(machine, letter)} if letter in ROTARY else {}
    model = ErrorModel(SerialErrors(tuple(components), frame=frame))
    return (None if found else model), found


def _unit(direction: str) -> str:
    return "arcsec" if direction in ROTARY else "um"


def _names(table: CsvTable, letter: str) -> tuple[list[ErrorName], list[Diagnostic]]:
    """Components of the axis that the columns hold; columns that are none of them are faults."""
    names: dict[str, ErrorName] = {}
    found = []
    for column in table.columns:
        name = parse(column.rstrip("+-"))
        if column == letter:
            continue
        if name is None or name.location or name.axis != letter:
            known = [f"E{d}{letter}" for d in DIRECTIONS]
            found.append(error("error-model.column", f"column {column[:40]!r} is not a component error of {letter}",
                               file=table.file, lines=[table.head], hint=nearest(column, known)))
            continue
        names[str(name)] = name
    return list(names.values()), found


def _location(table: CsvTable, how: ImportOptions) -> tuple[ErrorModel | None, list[Diagnostic]]:
    """Location errors: one row, a column each."""
    found, constants = unknown_columns(table), {}
    for column, values in table.columns.items():
        name = parse(column)
        if name is None or not name.location:
            continue
        known = ANGLES if name.angular else LENGTHS
        if table.unit[column] not in known:
            found.append(error("error-model.unit", f"column {column!r} has unit {table.unit[column]!r}", file=table.file,
                               lines=[table.head], hint="write one of " + ", ".join(known)))
        constants[column] = how.sign * float(values[0])
    if not found and len(table) > 1:
        found.append(error("error-import.rows", f"location errors are constants, the table has {len(table)} rows",
                           file=table.file, lines=list(table.lines[1:7]), hint="keep one row"))
    return (None if found else ErrorModel(SerialErrors(constants=constants))), found


# ---- LinuxCNC ----------------------------------------------------------------------------------------------

def _screw(letter: str, path: Path, machine: Machine,
           how: ImportOptions) -> tuple[ErrorModel | None, list[Diagnostic]]:
    mine = machine.kinematics.axes_with_errors
    if letter not in mine:
        return None, [error("error-model.axis", f"{machine.name} has no axis {letter!r} with a positioning error",
                            file=str(path), hint="it has " + (", ".join(mine) or "none"))]
    if leans(machine, letter):
        return None, [error("error-model.axis", f"{letter} of {machine.name} leans: E{OWN[letter]}{letter} is along or "
                            "about an axis of the machine, the screw file along or about the joint", file=str(path),
                            hint="write its components along and about x, y, z as a table")]
    text, found = read_text(path)
    if text is None:
        return None, found
    name = parse(f"E{OWN[letter]}{letter}")
    assert name is not None
    table, found = from_linuxcnc(text, name, how.sign * joint_sense(machine, letter), how.kind, str(path))
    if table is None:
        return None, found
    turns = machine.rotary[machine.axis_names.index(letter)]
    frame: dict[str, ErrorFrame] = {letter: bed_side(machine, letter)} if turns else {}
    return ErrorModel(SerialErrors((Component(name, table),), frame=frame)), []
