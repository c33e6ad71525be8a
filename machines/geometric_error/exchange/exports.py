"""From a model to what controls and other programs hold: tables per axis, a map, screw compensation; the losses reported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Literal

import numpy as np

from machines.geometric_error.actual.actual import Actual
from machines.geometric_error.actual.actual_map import ActualByMap, part_side
from machines.geometric_error.actual.axis_motion import ALONG, sense
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.exchange.bed_frame import bed_side, in_bed_frame, on_line
from machines.geometric_error.exchange.make_map import MapLoss, map_loss, map_of, nodes_of, probes, refined
from machines.geometric_error.exchange.survey import PLACES as WORST_PLACES
from machines.geometric_error.exchange.survey import apart
from machines.geometric_error.exchange.tabulate import TablePositions, loss, merged, rows_for, sampled, tabulated, without
from machines.geometric_error.exchange.volume import corners, middle, ranges, samples
from machines.geometric_error.files.covariance import angular
from machines.geometric_error.tables.averages import SAME
from machines.geometric_error.tables.choices import MapDirections
from machines.geometric_error.tables.csv_table import UNITS, write_csv
from machines.geometric_error.tables.curves import Polynomial, TableCurve
from machines.geometric_error.tables.lattice import POINT, ErrorMap
from machines.geometric_error.tables.names import DIRECTIONS, OWN
from machines.geometric_error.tables.screw_tables import LINUXCNC_ROWS, to_linuxcnc
from machines.kinematics.chain import ROTARY, Joint
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.units import DEG

MOST_ROWS = 20_000
"""of a table per axis"""
MOST_NODES = 200_000
"""of a map"""
MOST_UNCERTAINTY = 1200
"""parameters whose covariance is written: a square table"""
TURN = 13
"""levels of one turn, where nothing says how many"""
TURNS = 2.0, 1.0, 0.5
"""in either direction, of an axis that goes round: rows of screw compensation are tried over these"""
PLACES = 5000
"""of the work volume at which an export is compared with its model"""
GridSteps = Mapping[str, float]


# ---- tables per axis ---------------------------------------------------------------------------------------

def to_tables(model: ErrorModel, machine: Machine, step: GridSteps, length: float,
              angle: float) -> tuple[ErrorModel, dict[str, float]]:
    """The model with every component a linear table along x, y, z of the bed (ISO 230-1), and what each loses (mm or rad).

    Args:
        step: mm or rad between rows, by axis; without it as few as lose no more than `length` mm and `angle` rad

    Raises:
        ValueError: no component there, or more rows would be needed than `MOST_ROWS`.
    """
    if not model.axes.components:
        raise ValueError("the model has no component errors: a map or dimensions of legs have no tables per axis")
    components, frame = in_bed_frame(model, machine)
    rows = rows_for(components, travel(machine), step, length, angle, MOST_ROWS)
    losses = {str(c.name): loss(c.curve, rows[str(c.name)]) for c in components}
    return tabulated(model, components, frame, rows, MOST_UNCERTAINTY), losses


def location_csv(model: ErrorModel) -> str:
    """Location errors as a table of one row, by their names."""
    columns = {name: ("arcsec" if angular(name) else "um", np.array([value]))
               for name, value in model.axes.constants.items()}
    return write_csv(columns, ["location errors: actual less commanded, tool relative to part"])


def travel(machine: Machine, turns: float = 0.5) -> dict[str, tuple[float, float]]:
    """mm or rad by axis letter: travel, so many turns in either direction where it is unlimited."""
    lower, upper = machine.limits.lower, machine.limits.upper
    most = 2.0 * np.pi * turns
    return {letter: (float(a) if np.isfinite(a) else -most, float(b) if np.isfinite(b) else most)
            for letter, a, b in zip(machine.axis_names, lower, upper, strict=True)}


# ---- screw compensation ------------------------------------------------------------------------------------

NotOfJoint = Literal["leans", "reference off the axis"]
"""why a joint cannot take a positioning error back"""


@dataclass(frozen=True)
class Screws:
    """Screw compensation of LinuxCNC: text per joint letter, tables, losses (mm or rad), the model that the
    tables are, and the model without them."""

    texts: dict[str, str]
    tables: dict[str, TableCurve]
    losses: dict[str, float]
    held: ErrorModel
    rest: ErrorModel
    left: Mapping[str, NotOfJoint]
    """positioning errors that are not along or about the joint, and why"""


def to_screws(model: ErrorModel, machine: Machine, step: GridSteps, length: float, angle: float) -> Screws:
    """Positioning errors as LinuxCNC's files; arguments as `to_tables`.

    Axes that go round have rows over two turns in either direction, or as many as rows allow. Beyond its rows
    LinuxCNC goes on with
    the last: where a joint can go there the rest has a component of zeros that ends with them, so that programs stop too.

    Raises:
        ValueError: no positioning error there, or more rows than LinuxCNC holds would be needed.
    """
    positioning = [c for c in model.axes.components if c.name.positioning]
    left = {str(c.name): why for c in positioning if (why := _not_of_joint(model, machine, c))}
    mine = tuple(c for c in positioning if str(c.name) not in left)
    if not mine:
        raise ValueError("the model has no positioning error of an axis (EXX, EYY, ... ECC) that moves along or about its "
                         "machine axis; LinuxCNC's screw compensation holds nothing else")
    rows = _screw_rows(mine, machine, step, length, angle)
    tables = {c.name.axis: sampled(c.curve, rows[str(c.name)].x) for c in mine}
    texts = {c.name.axis: to_linuxcnc(c.name, tables[c.name.axis], joint_sense(machine, c.name.axis)) for c in mine}
    losses = {str(c.name): loss(c.curve, rows[str(c.name)]) for c in mine}
    held = ErrorModel(SerialErrors(tuple(Component(c.name, tables[c.name.axis]) for c in mine)))
    ends = tuple(Component(c.name, Polynomial(np.zeros(1), c.curve.range)) for c in held.axes.components
                 if _goes_beyond(machine, c.name.axis, c.curve.range))
    rest = merged(without(model, [c.name for c in mine]), ErrorModel(SerialErrors(ends)))
    return Screws(texts, tables, losses, held, rest, left)


def _screw_rows(components: Sequence[Component], machine: Machine, step: GridSteps, length: float,
                angle: float) -> dict[str, TablePositions]:
    """Rows by component over as many turns of axes that go round as LinuxCNC has rows for."""
    for turns in TURNS[:-1]:
        with suppress(ValueError):
            return rows_for(components, travel(machine, turns), step, length, angle, LINUXCNC_ROWS,
                            repeat=False)
    return rows_for(components, travel(machine, TURNS[-1]), step, length, angle, LINUXCNC_ROWS, repeat=False)


def _goes_beyond(machine: Machine, letter: str, span: tuple[float, float]) -> bool:
    """True for a joint whose travel leaves `span` (mm or rad)."""
    j = machine.axis_names.index(letter)
    return bool(machine.limits.lower[j] < span[0] - SAME or machine.limits.upper[j] > span[1] + SAME)


def _not_of_joint(model: ErrorModel, machine: Machine, component: Component) -> NotOfJoint | None:
    """Why the joint cannot take a positioning error back; None where it can."""
    letter = component.name.axis
    if leans(machine, letter):
        return "leans"
    if letter in ROTARY and not on_line(model, machine, letter):
        return "reference off the axis"
    return None


def leans(machine: Machine, letter: str) -> bool:
    """True for an axis that is not along the machine axis of its letter: its EBB is not about itself."""
    direction, _ = machine.kinematics.axis_line(letter)
    return bool(abs(direction[DIRECTIONS.index(OWN[letter]) % 3]) < 1.0 - ALONG)


def joint_sense(machine: Machine, letter: str) -> float:
    """-1.0 where the joint counts against the machine axis of its letter."""
    rotary = machine.rotary[machine.axis_names.index(letter)]
    return sense(Joint(letter, rotary, *machine.kinematics.axis_line(letter)))


def ini_lines(machine: Machine, names: Mapping[str, str]) -> list[str]:
    """What LinuxCNC's INI file says of the files, by joint letter."""
    lines = []
    for letter, name in names.items():
        lines += [f"[JOINT_{machine.axis_names.index(letter)}]", f"COMP_FILE = {name}", "COMP_FILE_TYPE = 0"]
    return lines


def notices(model: ErrorModel, machine: Machine) -> list[str]:
    """What else tables per axis do not say: where they end, and along what the errors of a rotary axis are."""
    lower = dict(zip(machine.axis_names, machine.limits.lower, strict=True))
    sides = {"fixed": "the part's side of the axis", "moving": "the tool's side of the axis"}
    axes, frames = {c.name.axis for c in model.axes.components}, model.axes.frame
    own = {letter: frame for letter, frame in frames.items() if letter in axes and frame != bed_side(machine, letter)}
    ends = [f"{c.name.axis} goes round, its table holds from {c.curve.range[0] / DEG:g} to {c.curve.range[1] / DEG:g} "
            "degrees" for c in model.axes.components if c.name.axis in ROTARY and np.isfinite(c.curve.range).all()
            and not np.isfinite(lower[c.name.axis])]
    return [*dict.fromkeys(ends), *(f"errors of {letter} are along x, y, z of {sides[frame]}, not of the bed as in ISO 230-1"
                                    for letter, frame in sorted(own.items()))]


# ---- error map ---------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class MadeMap:
    """A map of a model: inside its lattice, the other joints as fixed, it loses `inside`; over the work volume `volume`."""

    model: ErrorModel
    lattice: ErrorMap
    inside: MapLoss
    volume: MapLoss | None
    uncertainty_lost: bool


def lattice_for(model: ErrorModel, machine: Machine, letters: str, step: GridSteps, at: Mapping[str, float], length: float,
                directions: MapDirections) -> tuple[ErrorMap, Floats]:
    """(an empty lattice, fixed joints (J,)).

    Args:
        letters: coordinates; "" for the slides of a serial machine, x y z of one on rods
        step: mm or rad between nodes, by coordinate; without it the rows that the model's own tables have of
            it, else its ends, or every 30 degrees of a turn
        at: mm or rad, joints that the lattice does not name and that do not stand in the middle of the volume
        length: mm, of the tool whose tip is displaced
        directions: "machine" or "table"

    Raises:
        ValueError: a step for what is no coordinate, or a place to stand for what is one or outside travel.
    """
    letters = letters or ("".join(x for x, turns in zip(machine.axis_names, machine.rotary, strict=True) if not turns)
                          if machine.kinematics.chain else POINT)
    fixed = middle(machine)
    for letter, value in at.items():
        j = machine.axis_names.index(letter)
        fixed[j] = value
        if not machine.limits.lower[j] <= value <= machine.limits.upper[j]:
            raise ValueError(f"{letter} cannot stand there: it is outside its travel")
    for what, names, wrong in (("step", step, set(step) - set(letters)),
                               ("place to stand", at, set(at) & set(letters))):
        if wrong:
            raise ValueError(f"a {what} is given for {', '.join(x for x in names if x in wrong)}; the map's coordinates are "
                             f"{', '.join(letters)}")
    bed = part_side(machine.kinematics, machine.structure) if directions == "machine" else ()
    ends = _box(model, machine, fixed, length)
    levels = [_levels(model, machine, letter, ends[letter], step.get(letter)) for letter in letters]
    empty = np.zeros((*(len(nodes) for nodes, _ in levels), 6))
    nodes, periods = zip(*levels, strict=True)
    return ErrorMap(tuple(letters), nodes, empty, periods, length, bed), fixed


def _box(model: ErrorModel, machine: Machine, fixed: Floats, length: float) -> dict[str, tuple[float, float]]:
    """Ends of every joint, and of the point x y z when the slides are at their ends and the rest is fixed."""
    lower, upper = ranges(model, machine)
    ends = {letter: (float(a), float(b)) for letter, a, b in zip(machine.axis_names, lower, upper, strict=True)}
    tip = machine.kinematics.with_tool(length).forward(corners(machine, lower, upper, fixed))[0]
    return ends | {x: (float(tip[:, k].min()), float(tip[:, k].max())) for k, x in enumerate(POINT)}


def _levels(model: ErrorModel, machine: Machine, letter: str, ends: tuple[float, float],
            step: float | None) -> tuple[Floats, float]:
    """(nodes, period) of one coordinate."""
    unlimited = letter in machine.axis_names and not np.isfinite(machine.limits.lower[machine.axis_names.index(letter)])
    whole = unlimited and ends == travel(machine)[letter]
    own = [c.curve.x for c in model.axes.components if c.name.axis == letter and isinstance(c.curve, TableCurve)]
    if model.map is not None and letter in model.map.letters:
        own = [model.map.nodes[model.map.letters.index(letter)]]
    if whole:
        count = TURN if step is None else 1 + max(int(np.ceil(2.0 * np.pi / step - 1e-9)), 3)
        return np.linspace(0.0, 2.0 * np.pi, count)[:-1], 2.0 * np.pi
    if step is not None:
        return np.linspace(*ends, 1 + max(int(np.ceil((ends[1] - ends[0]) / step - 1e-9)), 1)), 0.0
    inner = np.concatenate(own) if own else np.zeros(0)
    return np.unique(np.concatenate([ends, inner[(inner > ends[0]) & (inner < ends[1])]])), 0.0


def to_map(model: ErrorModel, machine: Machine, lattice: ErrorMap, fixed: Floats,
           tolerance: float | None) -> MadeMap:
    """The map of a model; where a `tolerance` (mm) is given its cells are divided until it loses no more inside.

    Raises:
        ValueError: a node is out of reach, or more than MOST_NODES are needed.
    """
    kinematics = machine.kinematics.with_tool(lattice.length)
    actual, nominal = model.on(kinematics), model.zero().on(kinematics)
    if lattice.table.size // 6 > MOST_NODES:
        raise ValueError(f"{lattice.table.size // 6} nodes, at most {MOST_NODES}; take longer steps or fewer coordinates")
    if tolerance is None:
        made = map_of(actual, nominal, lattice, fixed)
        places = nodes_of(ActualByMap(nominal, made), probes(made, np.random.default_rng(0)), fixed)
        inside = map_loss(ActualByMap(nominal, made), actual, places)
    else:
        made, inside = refined(actual, nominal, lattice, fixed, tolerance, MOST_NODES)
    _measured(actual, nodes_of(ActualByMap(nominal, made), made.places(), fixed))
    result = ErrorModel(map=made, corrected_by=model.corrected_by, name=model.name, machine=model.machine,
                        large=model.large)
    volume = samples(model, machine, actual, PLACES)
    volume = volume[~result.on(kinematics).outside(volume).any(axis=1)]
    lost = map_loss(result.on(kinematics), actual, volume) if len(volume) else None
    if model.covariance is None or made.table.size > MOST_UNCERTAINTY:
        return MadeMap(result, made, inside, lost, model.covariance is not None)
    rows = _rows(ActualByMap(nominal, made), actual, fixed)
    return MadeMap(replace(result, covariance=rows @ model.covariance @ rows.T), made, inside, lost, False)


def _measured(actual: Actual, w: Floats) -> None:
    """Nothing where all of w (N, 3 + R) was measured.

    Raises:
        ValueError: else, naming the axes.
    """
    beyond = np.asarray(actual.outside(w, SAME).any(axis=0))
    if beyond.any():
        axes = [x for x, bad in zip(actual.kinematics.axis_names, beyond.tolist(), strict=True) if bad]
        raise ValueError(f"nodes lie beyond what was measured of {', '.join(axes)}; take --at inside it")


def _rows(by_map: ActualByMap, actual: Actual, fixed: Floats) -> Floats:
    """(6 N, P): values of a map per parameter of its model, first order."""
    w = nodes_of(by_map, by_map.map.places(), fixed)
    turned = by_map.directions(by_map.joints(w))
    rows = actual.sensitivity(w).reshape(len(w), 2, 3, -1)
    result: Floats = np.einsum("nji,nkjp->nkip", turned, rows).reshape(6 * len(w), -1)
    return result


# ---- what stays --------------------------------------------------------------------------------------------

def worst(model: ErrorModel, machine: Machine, tool_length: float,
          places_of: ErrorModel) -> tuple[float, float]:
    """Worst tip (um) and axis (arcsec) of a model at the places of `survey` where `places_of` holds; 0 where
    that is nowhere. Two approach directions count by their mean."""
    kinematics = machine.kinematics.with_tool(tool_length)
    w = samples(places_of, machine, places_of.on(kinematics), WORST_PLACES)
    tip, axis = apart(model.on(kinematics), model.zero().on(kinematics), w)
    return float(tip.max(initial=0.0)) / UNITS["um"], float(axis.max(initial=0.0)) / UNITS["arcsec"]


def correlated(model: ErrorModel) -> bool:
    """True where the covariance is more than one standard deviation for each parameter."""
    return model.covariance is not None and bool(np.count_nonzero(model.covariance - np.diag(np.diag(model.covariance))))


def named(values: Mapping[str, float]) -> dict[str, float]:
    """Losses in um and arcsec, by component."""
    return {name: value / UNITS["arcsec" if angular(name) else "um"] for name, value in values.items()}


def in_units(values: Mapping[str, float]) -> dict[str, float]:
    """mm and degrees by axis or coordinate, as mm and rad."""
    return {letter: value * (DEG if letter in ROTARY else 1.0) for letter, value in values.items()}
