"""A data sheet as a machine file: every fault of it at once, each at the line of the sheet where the figure stands."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import field, replace
from pathlib import Path

from machines.figures import ASSUMED, SOURCE
from machines.key_problem import KeyProblem
from machines.loader import assemble, check
from machines.machine import Machine
from machines.plausible import implausible
from machines.sheet.distances import against_distances, distances
from machines.sheet.file_text import FileValue, machine_text, nested
from machines.sheet.jog import sense
from machines.sheet.model import AxisSheet, DataSheet, TouchedSheet
from machines.sheet.pivot_text import read_pivots
from machines.sheet.pivots import points_of
from machines.sheet.quantity import QuantityKind, WrongFigureError, angles_of, read_quantity
from machines.sheet.touched import AGREE, apart_by, strange_turns, untold, wrong_sign
from machines.toml_lines import KeyPath, own_copy
from machines.user_file import UserFile, ValueSource, read_toml, validate, wrong_keys
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, Severity, has_errors

ENDLESS = "endless"
ALSO_ENDLESS = "unlimited", "continuous"
"""words of machine files and brochures for it, which a sheet or an answer may hold too"""
NAME = "sheet"
"""what the document is called in [sources] of the machine file"""
_ACCELERATION, _TURNING_ACCELERATION = 2000.0, 500.0
"""mm/s2, deg/s2, where the sheet states none"""
_JERK = 10.0
"""1/s, jerk over acceleration: none is ever printed"""
_OF_FIGURES = frozenset({"sheet.figure", "machine.plausible", "file.range", "file.value"})
"""codes of figures, which keys that do not fit leave as they are"""
_TIMES = {"tool_change": 6.0, "clamp": 0.5, "unclamp": 0.5}


@dataclass(frozen=True)
class NewMachine:
    """What became of a sheet.

    Attributes:
        machine: None where the sheet has errors
        text: of the machine file, "" likewise
        unread: rotary axes whose pivots no readings prove
    """

    machine: Machine | None
    text: str
    diagnostics: list[Diagnostic]
    unread: tuple[str, ...] = ()

    @property
    def assumed(self) -> list[str]:
        """Figures that the sheet does not state, by name."""
        known = self.machine.figures if self.machine is not None else {}
        return [name for name, origin in known.items() if origin == ASSUMED]


@dataclass
class _Making:
    """The values of the machine file as they are found, with the line of the sheet that each is from."""

    file: UserFile
    figures: dict[KeyPath, FileValue] = field(default_factory=dict)
    origins: dict[KeyPath, ValueSource] = field(default_factory=dict)
    found: list[Diagnostic] = field(default_factory=list)

    def put(self, path: KeyPath, value: FileValue, sheet: KeyPath) -> None:
        """A value of the machine file, and the key of the sheet that it is from."""
        self.figures[path] = value
        self.origins[path] = self.file.origin(sheet)

    def stated(self, path: KeyPath, value: FileValue, sheet: KeyPath, place: str) -> None:
        """The same of a figure that the sheet states."""
        self.put(path, value, sheet)
        self.put((*path[:-1], SOURCE, path[-1]), f"{NAME}: {place}", sheet)

    def assume(self, path: KeyPath, value: FileValue, sheet: KeyPath) -> None:
        """The same of one that it does not state."""
        self.put(path, value, sheet)
        self.mark(path, sheet)

    def mark(self, path: KeyPath, sheet: KeyPath) -> None:
        """A figure that is assumed."""
        words = (*path[:-1], ASSUMED)
        known = self.figures.get(words, [])
        self.put(words, [*(known if isinstance(known, list) else []), str(path[-1])], sheet)

    def fault(self, sheet: KeyPath, says: str, hint: str = "") -> None:
        """One more fault of the sheet."""
        self.found.append(self.file.problem("sheet.figure", sheet, says, hint))

    def read(self, sheet: KeyPath, text: str, measure: QuantityKind) -> float | None:
        """A quantity; None where it is none, with its fault."""
        try:
            return read_quantity(text, measure)
        except WrongFigureError as wrong:
            self.fault(sheet, f"{'.'.join(str(key) for key in sheet)}: {wrong.says}", wrong.hint)
            return None


def new_machine(source: str | Path, name: str = "") -> NewMachine:
    """The machine of a sheet; every fault of the sheet at once where it has some."""
    file, found = read_toml(source, kind="data sheet")
    sheet, more = validate(file, DataSheet) if file is not None else (None, [])
    if file is None or sheet is None:
        rest = _without_wrong_keys(file) if file is not None and not found else None
        others = _made(file, rest, name).diagnostics if file is not None and rest is not None else []
        return NewMachine(None, "", [*found, *more, *(d for d in others if d.code in _OF_FIGURES)])
    made = _made(file, sheet, name)
    return made if made.machine is None else _compared(made, file, sheet)


def _without_wrong_keys(file: UserFile) -> DataSheet | None:
    """The rest of a sheet with keys that do not fit, to find faults that they do not touch."""
    values = own_copy(file.values)
    for *tables, key in wrong_keys(file, DataSheet):
        at = values
        for one in tables:
            inside = at.get(str(one))
            at = inside if isinstance(inside, dict) else {}
        at.pop(str(key), None)
    return validate(replace(file, values=values), DataSheet)[0]


def _compared(made: NewMachine, file: UserFile, sheet: DataSheet) -> NewMachine:
    """The machine, where the readings of [touched] are of one point by it; else what would make them so."""
    if sheet.touched is None or made.machine is None:
        return made
    says, hint = _against(made.machine, sheet, sheet.touched, lambda other: _made(file, other, "").machine)
    return made if not says else NewMachine(None, "", [*made.diagnostics, file.problem(
        "sheet.figure", ("touched",), f"[touched]: {says}", hint)])


def _against(machine: Machine, sheet: DataSheet, touched: TouchedSheet,
             made: Callable[[DataSheet], Machine | None]) -> tuple[str, str]:
    """(what the readings say against pivots and signs of the sheet, or why they prove none, what to do); "" for nothing."""
    still, strange = strange_turns(sheet, touched)
    if strange:
        return f"{' and '.join(strange)} is no rotary axis of the sheet", "name the axes that the machine has"
    if still:
        return f"no reading turns {' and '.join(still)}", "add a reading in which it stands elsewhere"
    if (apart := apart_by(machine, touched)) > AGREE:
        return (f"the readings are of one point, and by pivots and signs of the sheet they are {apart:.3f} mm apart",
                wrong_sign(sheet, touched, made))
    others = untold(sheet, touched, machine, made)
    return ("", "") if not others else (
        f"the readings prove too little: they agree with {' or with '.join(others[:3])} as well",
        "add readings with each rotary axis turned by about 90 degrees")


def _made(file: UserFile, sheet: DataSheet, name: str) -> NewMachine:
    """The machine of a sheet, its readings aside."""
    making = _Making(file)
    _header(making, sheet)
    for letter, axis in sheet.axes.items():
        _axis(making, letter, axis, letter in sheet.rotary)
    _geometry(making, sheet)
    _times(making, sheet)
    _table_top(making, sheet)
    if making.found:
        return NewMachine(None, "", [*making.found, *_odd_besides(making, sheet)])
    whole = UserFile(name or file.name, file.file, nested(making.figures), making.origins)
    model, faults = check(whole)
    if model is None or has_errors(faults):
        return NewMachine(None, "", faults)
    machine = assemble(whole, model)
    odd = [file.problem(p.code, p.path, p.message, p.hint) for p in against_distances(machine, sheet)]
    found = [*faults, *_odd(whole, machine, sheet), *(replace(one, severity=Severity.WARNING) for one in odd)]
    text = machine_text(making.figures, Path(file.file).name)
    return NewMachine(machine, text, found, () if sheet.touched else sheet.rotary)


def _odd_besides(making: _Making, sheet: DataSheet) -> list[Diagnostic]:
    """Figures that no machine has, next to the faults of a sheet. In the place of figures that could not be read stand usual
    ones, small and large: what is said with both has nothing to do with them."""
    found = [_odd_with(making, sheet, slide, fast) for slide, fast in (([-500.0, 0.0], 500.0), ([-3000.0, 3000.0], 200.0))]
    return [one for one in found[0] if one in found[1]]


def _odd_with(making: _Making, sheet: DataSheet, slide: FileValue, fast: float) -> list[Diagnostic]:
    """The same with these figures of a slide, mm and mm/s, where there are none."""
    figures = dict(making.figures)
    for letter in sheet.axes:
        rotary = letter in sheet.rotary
        acceleration = _TURNING_ACCELERATION if rotary else _ACCELERATION
        usual: dict[str, FileValue] = {"travel": [-100.0, 100.0] if rotary else slide, "velocity": 100.0 if rotary else fast,
                                       "acceleration": acceleration, "jerk": _JERK * acceleration, "home": 0.0}
        for key, value in usual.items():
            figures.setdefault(("axes", letter, key), value)
    whole = UserFile(making.file.name, making.file.file, nested(figures), making.origins)
    model, faults = check(whole)
    if model is None or has_errors(faults):
        return [d for d in faults if d.code in ("file.range", "file.value")]
    return _odd(whole, assemble(whole, model), sheet)


def _odd(whole: UserFile, machine: Machine, sheet: DataSheet) -> list[Diagnostic]:
    """Figures that no machine has: a warning each, at the line of the sheet."""
    return [replace(whole.problem(p.code, p.path, p.message, _of_sheet(p, sheet)), severity=Severity.WARNING)
            for p in implausible(machine)]


def _of_sheet(problem: KeyProblem, sheet: DataSheet) -> str:
    """What to do about it in the sheet, whose figures have units of their own."""
    table, letter, key = (str(one) for one in problem.path[:3])
    axis = sheet.axes.get(letter) if table == "axes" else None
    if axis is None:
        return problem.hint
    word, given = {"travel": ("travel", str(axis.travel)), "velocity": ("rapid", axis.rapid)}.get(
        key, ("acceleration", axis.acceleration))
    return f"see to the unit of {letter} {word}, which the sheet has as {given}" if given else (
        f"see to the unit of {letter} rapid, which the sheet has as {axis.rapid}, or state its acceleration")


def _header(making: _Making, sheet: DataSheet) -> None:
    making.put(("description",), sheet.description, ("description",))
    making.put(("retract_axis",), "Z", ("Z",))
    making.put(("sources", NAME, "document"), sheet.source, ("source",))
    making.put(("sources", NAME, "by"), "maker", ("source",))
    if sheet.spindle and (speed := making.read(("spindle",), sheet.spindle, "turning speed")):
        making.put(("control", "largest_spindle_speed"), _round(speed / 6.0), ("spindle",))
    for letter in sorted(set(sheet.rotary) - set(sheet.axes)):
        where = "table" if letter in sheet.table else "head"
        making.fault((where,), f"axis {letter} has no table", f"add [{letter}] with travel and rapid")
    for letter in sorted(set(sheet.axes) - set(sheet.rotary) - set("XYZ")):
        making.fault((letter,), f"axis {letter} is neither in `table` nor in `head`",
                     f'write table = ["{letter}"] or head = ["{letter}"]')


def _axis(making: _Making, letter: str, axis: AxisSheet, rotary: bool) -> None:
    """Travel, speed, home of one axis, and what is assumed of it."""
    travel = _travel(making, letter, axis, rotary)
    rapid = making.read((letter, "rapid"), axis.rapid, "turning speed" if rotary else "speed")
    at = ("axes", letter)
    if travel is not None:
        ends = "unlimited" if travel == (-math.inf, math.inf) else list(travel)
        making.stated((*at, "travel"), ends, (letter, "travel"), f"{letter} travel")
    if rapid is not None:
        making.stated((*at, "velocity"), _round(rapid), (letter, "rapid"), f"{letter} rapid")
    acceleration = _TURNING_ACCELERATION if rotary else _ACCELERATION
    if axis.acceleration:
        read = making.read((letter, "acceleration"), axis.acceleration, "turning acceleration" if rotary else "acceleration")
        acceleration = read or acceleration
        making.stated((*at, "acceleration"), _round(acceleration), (letter, "acceleration"), f"{letter} acceleration")
    else:
        making.assume((*at, "acceleration"), acceleration, (letter,))
    making.assume((*at, "jerk"), _round(_JERK * acceleration), (letter,))
    if axis.home:
        home = making.read((letter, "home"), axis.home, "angle" if rotary else "length")
        making.stated((*at, "home"), _round(home or 0.0), (letter, "home"), f"{letter} home")
    elif travel is not None:
        making.assume((*at, "home"), min(max(0.0, travel[0]), travel[1]), (letter,))


def says_endless(text: str) -> bool:
    """True where a travel has no ends."""
    return any(word in text.lower() for word in (ENDLESS, *ALSO_ENDLESS))


def _travel(making: _Making, letter: str, axis: AxisSheet, rotary: bool) -> tuple[float, float] | None:
    """Both ends, mm or degrees."""
    measure: QuantityKind = "angle" if rotary else "length"
    path = (letter, "travel")
    if isinstance(axis.travel, str) and says_endless(axis.travel):
        if not rotary:
            making.fault(path, f"{letter}.travel: a linear axis has ends", 'write its length, "762 mm"')
            return None
        return -math.inf, math.inf
    if not isinstance(axis.travel, str):
        ends = [making.read(path, text, measure) for text in axis.travel]
        if ends[0] is None or ends[1] is None:
            return None
        if ends[0] >= ends[1]:
            first, last = axis.travel[1], axis.travel[0]
            making.fault(path, f"{letter}.travel: {list(axis.travel)} is empty",
                         f'write the lower end first, ["{first}", "{last}"]' if ends[0] > ends[1] else "write both ends")
            return None
        return _round(ends[0]), _round(ends[1])
    if rotary:
        if (both := angles_of(axis.travel)) is not None:  # "-35 to 120 deg" as brochures print it
            return both
        making.fault(path, f"{letter}.travel: {axis.travel!r} is one figure", 'write both ends, ["-35 deg", "120 deg"], or '
                     '"endless"')
        return None
    length = making.read(path, axis.travel, measure)
    if length is None:
        return None
    low = {"upper": -length, "lower": 0.0, "middle": -length / 2.0}[axis.zero]
    return _round(low), _round(low + length)


def _geometry(making: _Making, sheet: DataSheet) -> None:
    """Structure, points and senses of the rotary axes."""
    spindle = [letter for letter in "XYZ" if letter not in sheet.table_slides]
    carried = [f"{letter}'" for letter in (*sheet.table[::-1], *sheet.table_slides[::-1])]
    making.put(("kinematics", "kind"), "serial", ("table",))
    making.put(("kinematics", "structure"), " ".join(["w", *carried, "b", *spindle, *sheet.head, "(C1)", "t"]), ("table",))
    points, pivots = _points(making, sheet), sheet.pivots
    for letter in sheet.rotary:
        at, axis = ("kinematics", "axes", letter), sheet.axes.get(letter)
        if letter in points and pivots is not None:
            making.stated((*at, "point"), points[letter], ("pivots", "points"), f"pivots, {pivots.form}")
        if axis is None or axis.jog is None:
            making.mark((*at, "direction"), (letter,))
            continue
        try:
            positive = sense(letter, letter in sheet.table, axis.jog)
        except WrongFigureError as wrong:
            making.fault((letter, "jog"), wrong.says, wrong.hint)
            continue
        making.put((*at, "positive"), positive, (letter, "jog"))
        making.put((*at, SOURCE, "direction"), f"{NAME}: {letter} jog", (letter, "jog"))


def _points(making: _Making, sheet: DataSheet) -> dict[str, list[float]]:
    if not sheet.rotary:
        return {}
    if sheet.pivots is None:
        making.fault(("table",), f"where {' and '.join(sheet.rotary)} lie{'s' * (len(sheet.rotary) == 1)} is not stated",
                     'add [pivots] form = "haas", "siemens", "heidenhain", "fanuc" or "machine", and its numbers')
        return {}
    read, unread = read_pivots(sheet.pivots.form, sheet.pivots.text) if sheet.pivots.text else ({}, [])
    for one in unread:
        making.fault(("pivots", "text"), f"[pivots] text: {one}",
                     "as the control puts it out: all three numbers of each vector, of one carrier or path")
    if twice := sorted(read.keys() & sheet.pivots.points):
        making.fault(("pivots", "points"), f"[pivots]: {' and '.join(twice)} in `text` and in `points`",
                     "give it in one of them")
    if unread or twice:
        return {}
    try:
        points, wrong = points_of(sheet.pivots.form, sheet.table, sheet.head, read | sheet.pivots.points)
    except WrongFigureError as fault:
        making.fault(("pivots", "form"), fault.says, fault.hint)
        return {}
    for one in wrong:
        making.fault(("pivots", "points"), f"[pivots]: {one}", "as the control shows them, in its own order of signs")
    return {letter: [_round(float(v)) for v in point] for letter, point in points.items()}


def _times(making: _Making, sheet: DataSheet) -> None:
    given = {"tool_change": sheet.times.tool_change, "clamp": sheet.times.clamp, "unclamp": sheet.times.clamp}
    for key, text in given.items():
        of_sheet = "clamp" if key == "unclamp" else key
        if text:
            value = making.read(("times", of_sheet), text, "time")
            making.stated(("timing", key), _round(value or 0.0), ("times", of_sheet), f"times {of_sheet}")
        else:
            making.assume(("timing", key), _TIMES[key], ("description",))


def _table_top(making: _Making, sheet: DataSheet) -> None:
    """Faults of the distances' texts."""
    try:
        distances(sheet)
    except WrongFigureError as wrong:
        making.fault(("table_top",), f"table_top: {wrong.says}", wrong.hint)


def _round(value: float) -> float:
    """Without the digits that a change of units adds."""
    return round(value, 6)


