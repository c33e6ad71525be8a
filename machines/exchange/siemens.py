"""A machine from Siemens machine data: TRAORI (types 24, 40, 56; 16 to 21, 32 to 35), a swivel data record, axis limits.

Units by the parameter manual: MD32000 mm/min and rev/min, MD32300 m/s2 and rev/s2, MD32431 m/s3 and rev/s3, MD36100 and
MD36110 mm and degrees. Vectors: SINUMERIK Operate, Commissioning Manual 6FC5397-1DP40-6BA1, 21.7 "Swiveling": axis 2 is
based on axis 1; an axis that moves the workpiece has the sign of its vector changed. Types 16 to 21 (tool) and 32 to 35
(workpiece), axes along X, Y, Z by letters: Function Manual Transformations A5E47435470B, 3.2, and the list of MD24100 in
Parameter Manual 6FC5397-8EP40 (the first axis turns the second).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from machines.exchange.draft import Draft
from machines.exchange.siemens_data import MachineDatum, SiemensData, read_data
from machines.kinematics.chain import ROTARY
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import has_errors
from toolpaths.units import MM_PER_INCH

Carried = Literal["T", "P", "M"]
"""$TC_CARR23: tool, part or both are swivelled"""
_TYPES: dict[int, Carried] = {24: "T", 40: "P", 56: "M"}
_SEQUENCES = ("AB", "AC", "BA", "BC", "CA", "CB")
"""of the rotary axes, by the last four bits of the older types, whose axes are not vectors"""
_OLDER: dict[int, tuple[Carried, str]] = {
    **{16 + k: ("T", _SEQUENCES[k]) for k in (0, 2, 4, 5)}, **{32 + k: ("P", _SEQUENCES[k]) for k in range(4)}}
UNLIMITED = 1e7
"""positions from which a limit is none: Siemens' own defaults are +-1e8"""
_FIGURES = {"velocity": ("MA_MAX_AX_VELO", "", 1.0 / 60.0, 360.0 / 60.0),
            "acceleration": ("MA_MAX_AX_ACCEL", "0,", 1000.0, 360.0), "jerk": ("MA_MAX_AX_JERK", "0,", 1000.0, 360.0)}
"""key: machine datum, index before the axis (DYNNORM), to mm and to degrees per s, s2, s3"""
_BETWEEN = 1e-6
"""mm, or of a unit vector: by how much TRAORI and a swivel data record may differ"""
_CLOSES = 0.01
"""mm that the vector which closes a chain may be off by"""
_VECTORS = "see to the signs of all vectors: where the machine keeps its coordinates their sum is 0"
_HINT = "state it: --set \"kinematics.structure=w A' b X Y Z (C1) t\" --set kinematics.axes.A.point=[0,0,0]"


@dataclass(frozen=True)
class SwivelGeometry:
    """Points of rotary axes 1 and 2 with all axes at 0, and vectors of both, in mm; where it stands."""

    carried: Carried
    vectors: tuple[list[float], list[float]]
    points: tuple[list[float], list[float]]
    letters: tuple[str, str]
    datum: MachineDatum

    @property
    def axes(self) -> list[int]:
        """Those of both that there are: a kinematics of one axis has it as the first."""
        return [k for k in (0, 1) if any(self.vectors[k])]


def read_siemens(path: Path, text: str, stated: Sequence[str]) -> tuple[Draft, dict[str, bool]]:
    """The draft of a machine file, and its axes: True for rotary ones."""
    draft = Draft(str(path), stated)
    return _SiemensMachine(draft, read_data(draft, text)).read()


class _SiemensMachine:
    def __init__(self, draft: Draft, data: SiemensData) -> None:
        self.draft, self.data = draft, data
        metric = data.get("MN_SCALING_SYSTEM_IS_METRIC")
        self.scale = MM_PER_INCH if metric is not None and metric.number == 0.0 else 1.0
        self.machine_axes = self._machine_axes()
        self.unread: MachineDatum | None = None
        """a transformation of a type that is not read"""

    def _machine_axes(self) -> dict[str, list[str]]:
        """What the axis of a letter is called in $MA_ data: AX1, or the machine axis name."""
        names = {int(one.index): one.text for one in self.data.of("MN_AXCONF_MACHAX_NAME_TAB") if one.index.isdigit()}
        channel = {int(one.index): one.text for one in self.data.of("MC_AXCONF_CHANAX_NAME_TAB") if one.index.isdigit()}
        result: dict[str, list[str]] = {}
        for k, name in channel.items():
            used = round(self.data.number("MC_AXCONF_MACHAX_USED", str(k), k + 1.0))
            if used > 0:
                result[_letter(name)] = [f"AX{used}", names.get(used - 1, name)]
        for k, name in names.items():
            if _letter(name) not in result and not channel:
                result[_letter(name)] = [f"AX{k + 1}", name]
        return {letter: found for letter, found in result.items() if letter}

    def read(self) -> tuple[Draft, dict[str, bool]]:
        """Geometry, then limits of each axis."""
        self.draft.made(("description",), f"from machine data {Path(self.draft.file).name}", "")
        self.draft.made(("retract_axis",), "Z", "")
        self.draft.made(("kinematics", "kind"), "serial", "")
        geometry = self._geometry()
        turning = [geometry.letters[k] for k in geometry.axes] if geometry else self._turning()
        if geometry is not None:
            self._put(geometry)
        elif "kinematics.structure" in self.draft.stated:
            pass
        elif turning and has_errors(self.draft.found):
            pass  # what is wrong has been said
        elif turning:
            self._nowhere(turning)
        else:
            self.draft.made(("kinematics", "structure"), "w b X Y Z (C1) t", "")
        letters = [*"XYZ", *sorted(turning)]
        for letter in letters:
            self._axis(letter)
        return self.draft, {letter: letter in ROTARY for letter in letters}

    def _nowhere(self, turning: list[str]) -> None:
        """Nothing that is read says where the rotary axes are: one cause, by what the file has in its place."""
        chain = next((one for (name, _), one in self.data.data.items() if name.startswith(("NK_", "NT_"))), None)
        if self.unread is not None:
            self.draft.error("import.kinematics", f"{self.unread.said}: of the 5-axis transformations types 24, 40, 56, 16 "
                             "to 21 and 32 to 35 are read; of 48 to 51 no document at hand says which vector goes to the "
                             "table", self.unread.line, _HINT)
        elif chain is not None:
            self.draft.error("import.kinematics", f"{chain.said}: kinematic chains ($NK_..., $NT_...) are not read",
                             chain.line, _HINT)
        else:
            self.draft.error("import.geometry", "neither a transformation that is read nor a swivel data record "
                             f"says where {' and '.join(turning)} {'are' if turning[1:] else 'is'}", hint=_HINT)

    def _turning(self) -> list[str]:
        """Axes that are called like rotary ones, and are not said to be linear."""
        stated = {letter: self._ma("MA_IS_ROT_AX", letter) for letter in self.machine_axes if letter in ROTARY}
        return sorted(letter for letter, datum in stated.items() if datum is None or datum.number != 0.0)

    def _ma(self, name: str, letter: str, before: str = "") -> MachineDatum | None:
        for axis in [*(one.upper() for one in self.machine_axes.get(letter, [])), letter, f"{letter}1"]:
            if found := self.data.get(name, f"{before}{axis}") or (self.data.get(name, axis) if before else None):
                return found
        return None

    def _geometry(self) -> SwivelGeometry | None:
        """That of TRAORI; that of the swivel data record where there is no other, or compared with it."""
        first, second = self._transformation(), self._record()
        if first is None or second is None:
            return first or second
        same = first.carried == second.carried and np.allclose(first.vectors, second.vectors, atol=_BETWEEN) and np.allclose(
            first.points, second.points, atol=_BETWEEN)
        if not same:
            self.draft.warning("import.contradiction", f"the swivel data record ({second.datum.said}) and TRAORI ("
                            f"{first.datum.said}, line {first.datum.line}) differ: TRAORI counts", second.datum.line,
                            "measure with CYCLE996 and enter the result in both")
        return first

    def _transformation(self) -> SwivelGeometry | None:
        for datum in sorted(self._types(), key=lambda one: one.name):
            kind, n = round(datum.number or 0.0), datum.name.removeprefix("MC_TRAFO_TYPE_")
            if kind in _TYPES:
                return self._of_type(datum, _TYPES[kind], n)
            if kind in _OLDER:
                return self._of_older_type(datum, *_OLDER[kind], n)
            if 16 <= kind <= 51:
                self.unread = datum
        return None

    def _types(self) -> list[MachineDatum]:
        return [one for (name, _), one in self.data.data.items() if name.startswith("MC_TRAFO_TYPE_")]

    def _of_type(self, datum: MachineDatum, carried: Carried, n: str) -> SwivelGeometry | None:
        base, joint = self._vector(f"MC_TRAFO5_BASE_TOOL_{n}"), self._joint(carried, n)
        vectors = (self.data.vector(f"MC_TRAFO5_AXIS1_{n}")[0], self.data.vector(f"MC_TRAFO5_AXIS2_{n}")[0])
        if not any(vectors[0]) or not self._plain(n):
            if not any(vectors[0]) and not has_errors(self.draft.found):
                self.draft.error("import.geometry", f"{datum.said}, and no $MC_TRAFO5_AXIS1_{n}", datum.line, _HINT)
            return None
        self._closes(carried, base, joint, n)
        self._say_absent(datum, [f"MC_TRAFO5_AXIS1_{n}", f"MC_TRAFO5_AXIS2_{n}" if any(vectors[1]) else ""])
        self._say_absent(datum, self._lines(carried, n))
        letters = self._letters(self._entering(n), vectors)
        return SwivelGeometry(carried, vectors, _points(carried, base, joint), letters, datum)

    def _entering(self, n: str) -> list[str]:
        """Letters of the rotary axes that go into the transformation, "" where the file does not name them."""
        numbers = [self.data.number(f"MC_TRAFO_AXES_IN_{n}", str(3 + k), 0.0) for k in (0, 1)]
        names = [self.data.get("MC_AXCONF_CHANAX_NAME_TAB", str(round(number) - 1)) for number in numbers]
        return [_letter(name.text) if name else "" for name in names]

    def _closes(self, carried: Carried, base: list[float], joint: list[float], n: str) -> None:
        """MD24500 is what is left of the vectors of the axes; where it is not, one of them is wrong."""
        part, datum = self._vector(f"MC_TRAFO5_PART_OFFSET_{n}"), self.data.vector(f"MC_TRAFO5_PART_OFFSET_{n}")[1]
        would = [0.0 - b - (0.0 if carried == "M" else a) for a, b in zip(base, joint, strict=True)]
        if datum is not None and any(part) and not np.allclose(part, would, atol=_CLOSES):
            self.draft.warning("import.contradiction", f"$MC_TRAFO5_PART_OFFSET_{n} = {part} closes the chain and would be "
                               f"{would}: the lines of the axes are taken from the vectors before it", datum.line, _VECTORS)

    def _of_older_type(self, datum: MachineDatum, carried: Carried, letters: str, n: str) -> SwivelGeometry | None:
        """Axes along X, Y, Z by their letters; in which direction they count is not documented, so it is said."""
        if not self._plain(n):
            return None
        named = self._entering(n)
        if any(name in ROTARY and name != letter for name, letter in zip(named, letters, strict=True)):
            self.draft.error("import.geometry", f"{datum.said} is of axes {' and '.join(letters)}, $MC_TRAFO_AXES_IN_{n} "
                             f"names {' and '.join(named)}", datum.line, _HINT)
            return None
        base, joint = self._vector(f"MC_TRAFO5_BASE_TOOL_{n}"), self._joint(carried, n)
        self._closes(carried, base, joint, n)
        self._say_absent(datum, self._lines(carried, n))
        points = _points(carried, base, joint)
        sense = -1.0 if carried == "P" else 1.0
        first, second = ([sense * float(letter == axis) for axis in "ABC"] for letter in letters)
        self.draft.info("import.sense", f"{datum.said}: {letters[0]} and {letters[1]} are taken to turn the tool relative "
                        "to the part as ISO 841 has them: the type does not say it, so turn both by hand at the machine and "
                        "compare", datum.line)
        return SwivelGeometry(carried, (first, second), points, (letters[0], letters[1]), datum)

    def _plain(self, n: str) -> bool:
        """No zero offset, no reversed count, tool along z: what is not modelled is refused."""
        wanted = [(f"MC_TRAFO5_ROT_AX_OFFSET_{n}", k, 0.0) for k in "01"]
        wanted += [(f"MC_TRAFO5_ROT_SIGN_IS_PLUS_{n}", k, 1.0) for k in "01"]
        wanted += [(f"MC_TRAFO5_BASE_ORIENT_{n}", k, 0.0) for k in "01"]
        strange = next((one for name, k, value in wanted if (one := self.data.get(name, k)) and one.number != value), None)
        if strange is not None:
            self.draft.error("import.kinematics", f"{strange.said} is not read", strange.line, _HINT)
        return strange is None

    def _joint(self, carried: Carried, n: str) -> list[float]:
        """The vector between both axes, or of the table where tool and part swivel: MD24558 or MD24560."""
        part, tool = f"MC_TRAFO5_JOINT_OFFSET_PART_{n}", f"MC_TRAFO5_JOINT_OFFSET_{n}"
        if carried == "M":
            return self._vector(part)
        if carried == "T" or not any(self._vector(part)):
            return self._vector(tool)
        datum = self.data.vector(part)[1]
        if any(self._vector(tool)) and self._vector(tool) != self._vector(part) and datum is not None:
            self.draft.error("import.contradiction", f"${part} and ${tool} differ", datum.line,
                             "for a table, enter one of them")
        return self._vector(part)

    def _lines(self, carried: Carried, n: str) -> list[str]:
        """Names of the vectors that `_points` takes."""
        part = f"MC_TRAFO5_JOINT_OFFSET_PART_{n}"
        of_part = carried == "M" or (carried == "P" and self.data.vector(part)[1] is not None)
        return [f"MC_TRAFO5_BASE_TOOL_{n}", part if of_part else f"MC_TRAFO5_JOINT_OFFSET_{n}"]

    def _say_absent(self, datum: MachineDatum, names: Sequence[str], index: str = "") -> None:
        """Elements of vectors that no line states: 0 on the control, unless the file is cut off.

        Args:
            datum: what the vectors belong to
            names: of vectors [0] to [2]; with `index` of their elements, which all have it
        """
        places = [(name, index) for name in names] if index else [(name, k) for name in names if name for k in "012"]
        missing = [f"${name}[{k}]" for name, k in places if self.data.get(name, k) is None]
        if missing and len(missing) == len([name for name in names if name]) * (1 if index else 3):
            self.draft.error("import.geometry", f"{datum.said}, and no line states where its axes are: {', '.join(missing)}",
                             datum.line, _HINT)
        elif missing:
            self.draft.warning("import.default", f"no line states {', '.join(missing)}: the control's default, 0, counts",
                               datum.line, "compare with the control, and write the lines that are not 0 there")

    def _vector(self, name: str) -> list[float]:
        return [value * self.scale for value in self.data.vector(name)[0]]

    def _record(self) -> SwivelGeometry | None:
        """The first swivel data record that has a vector."""
        for datum in self.data.of("TC_CARR23"):
            n, carried = datum.index, datum.text.upper()
            vectors = (self._carr(n, 7), self._carr(n, 10))
            if not any(vectors[0]):
                continue
            if carried not in ("T", "P", "M"):
                self.draft.error("import.kinematics", f"{datum.said}: neither T nor P nor M", datum.line, _HINT)
                return None
            self._fine(n)
            known: Carried = "T" if carried == "T" else "P" if carried == "P" else "M"
            two = any(vectors[1])
            self._say_absent(datum, [f"TC_CARR{k}" for k in range(7, 13 if two else 10)], n)
            self._say_absent(datum, [f"TC_CARR{k}" for k in (4, 5, 6, *((15, 16, 17) if two else ()))], n)
            mm = [[value * self.scale for value in self._carr(n, k)] for k in (4, 15)]
            points = _points(known, *((mm[1], mm[0]) if known == "T" else (mm[0], mm[1])))
            named = [self.data.get(f"TC_CARR{k}", n) for k in (35, 36)]
            letters = [_letter(name.text) if name else "" for name in named]
            return SwivelGeometry(known, vectors, points, self._letters(letters, vectors), datum)
        return None

    def _carr(self, n: str, first: int) -> list[float]:
        return [self.data.number(f"TC_CARR{first + k}", n, 0.0) for k in range(3)]

    def _fine(self, n: str) -> None:
        fine = [self.data.get(f"TC_CARR{k}", n) for k in range(41, 61)]
        if found := next((one for one in fine if one is not None and one.number), None):
            self.draft.warning("import.fine", f"{found.said}: fine offsets are not added; the control adds them where "
                               "SD42974 is set", found.line, "add them to the vectors, or state the points")

    def _letters(self, given: list[str], vectors: tuple[list[float], list[float]]) -> tuple[str, str]:
        """As the file names the axes, else by the direction of each vector."""
        by_vector = ["ABC"[int(np.argmax(np.abs(vector)))] for vector in vectors]
        first, second = (name if name in ROTARY and name else other for name, other in zip(given, by_vector, strict=True))
        return first, second

    def _put(self, found: SwivelGeometry) -> None:
        turning = [found.letters[k] for k in found.axes]
        tables = [] if found.carried == "T" else turning[1:] if found.carried == "M" else turning
        heads = [letter for letter in turning if letter not in tables]
        code = ["w", *(f"{letter}'" for letter in reversed(tables)), "b", "X", "Y", "Z", *heads, "(C1)", "t"]
        where = found.datum.line, found.datum.said
        self.draft.put(("kinematics", "structure"), " ".join(code), *where)
        for k in found.axes:
            letter, vector = found.letters[k], np.array(found.vectors[k])
            sense = -1.0 if letter in tables else 1.0
            direction = sense * vector / np.linalg.norm(vector) + 0.0
            self.draft.put(("kinematics", "axes", letter, "point"), [float(v) for v in found.points[k]], *where)
            self.draft.put(("kinematics", "axes", letter, "direction"), [float(v) for v in direction], *where)

    def _axis(self, letter: str) -> None:
        turns = letter in ROTARY
        for key, (name, before, linear, rotary) in _FIGURES.items():
            found = self._ma(name, letter, before)
            if found is not None and found.number is not None:
                self.draft.put(("axes", letter, key), found.number * (rotary if turns else linear * self.scale), found.line,
                               found.said)
        self._travel(letter, 1.0 if turns else self.scale)

    def _travel(self, letter: str, scale: float) -> None:
        low, high = self._ma("MA_POS_LIMIT_MINUS", letter), self._ma("MA_POS_LIMIT_PLUS", letter)
        modulo, path = self._ma("MA_ROT_IS_MODULO", letter), ("axes", letter, "travel")
        numbers = [one.number for one in (low, high) if one is not None and one.number is not None]
        ends = [end for end in numbers if abs(end) < UNLIMITED]
        if modulo is not None and modulo.number and letter in ROTARY:
            self.draft.put(path, "unlimited", modulo.line, modulo.said)
            self.draft.put(("axes", letter, "modulo"), True, modulo.line, modulo.said)
        elif len(ends) == 2 and low is not None and high is not None:
            self.draft.put(path, [end * scale for end in ends], low.line, f"{low.said}, {high.said}")
        elif letter in ROTARY and not ends and (datum := low or high):
            self.draft.put(path, "unlimited", datum.line, datum.said)
        elif ends and all(one is None or one.number is not None for one in (low, high)) and (datum := low or high):
            self.draft.error("import.travel", f"axis {letter} has {datum.said} and no other end", datum.line,
                             "write $MA_POS_LIMIT_MINUS and $MA_POS_LIMIT_PLUS")


def _points(carried: Carried, base: list[float], joint: list[float]) -> tuple[list[float], list[float]]:
    """Points of axes 1 and 2 of the vectors from the zero (MD24550, $TC_CARR4 or 15) and between the axes.

    A head's first vector goes to axis 2, the one nearest the tool; tool and part: `joint` goes to the table.
    """
    both = [a + b for a, b in zip(base, joint, strict=True)]
    return (both, base) if carried == "T" else (base, joint) if carried == "M" else (base, both)


def _letter(name: str) -> str:
    """X of X1, MX1 or X; "" where no letter of an axis is in it."""
    letters = [c for c in name.upper() if c.isalpha() and c != "M"]
    return letters[0] if len(letters) == 1 and letters[0] in "XYZUVWABC" else ""
