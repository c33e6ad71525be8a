"""Error files of every kind of curve for any machine file, drawn from a seed: 10 to 50 um, 5 to 20 arcsec in all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.machines.independent_machine import DIRECTIONS, UNITS, Axis, Machine

KINDS = {False: ("linear", "spline", "polynomial", "series"), True: ("series", "linear", "spline", "around")}
"""curves of slides and of rotary axes; "around": a table that repeats every turn"""

ROUND = ("series", "around")
"""of axes without an end"""


class Draw:
    """Numbers of one file and the text that holds them.

    Attributes:
        size: um and arcsec of one parameter
        both: the axis's own error and its turn about y by two paths
    """

    def __init__(self, folder: Path, machine: Machine, seed: int, size: tuple[float, float] = (8.0, 2.0), both: bool = False,
                 kinds: dict[bool, Sequence[str]] | None = None) -> None:
        self.folder, self.machine, self.size, self.both = folder, machine, size, both
        self.kinds = KINDS if kinds is None else kinds
        self.rng = np.random.default_rng(seed)
        self.unit = dict(zip(("length", "angle"), (("um", "arcsec"), ("mm", "urad"), ("um", "deg"))[seed % 3], strict=True))
        self.text = [f'length_unit = "{self.unit["length"]}"', f'angle_unit = "{self.unit["angle"]}"']

    def write(self, name: str = "errors.toml") -> Path:
        if self.machine.kinematics["kind"] == "serial":
            axes = self.machine.chain
        else:
            axes = [] if self.machine.rotary_axis is None else [self.machine.rotary_axis]
            self.legs()
        for axis in axes:
            self.axis(axis)
        constants = [line for axis in axes for line in self.location(axis)]
        spindle = [f"E{d}0S = {self.amount(k)!r}" for k, d in enumerate("XYZAB")]
        file = self.folder / name
        file.write_text("\n".join([*self.text, "[location]", *constants, *spindle]) + "\n")
        return file

    def amount(self, k: int, times: float = 1.0) -> float:
        """One number in the units of the file, for direction k."""
        wanted = UNITS["arcsec"] * self.size[1] if k > 2 else UNITS["um"] * self.size[0]
        return round(float(self.rng.normal() * times * wanted / UNITS[self.unit["angle" if k > 2 else "length"]]), 9)

    def axis(self, axis: Axis) -> None:
        for k, direction in enumerate(DIRECTIONS):
            self.text += [f"[components.E{direction}{axis.letter}]", *self.curve(axis, k, f"E{direction}{axis.letter}")]
            if self.rng.random() < 0.3:
                self.text.append("sign = -1")
        point = [round(float(v), 3) for v in self.rng.uniform(-80.0, 80.0, 3)]
        self.text += [f"[reference.{axis.letter}]", f"point = {point}"]
        if axis.rotary:
            self.text.append(f'frame = "{self.rng.choice(["bed", "fixed", "moving"])}"')

    def span(self, axis: Axis) -> tuple[float, float]:
        travel = self.machine.toml["axes"][axis.letter]["travel"]
        return (-180.0, 170.0) if travel == "unlimited" else (float(travel[0]), float(travel[1]))

    def curve(self, axis: Axis, k: int, name: str) -> list[str]:
        kinds = ROUND if self.machine.toml["axes"][axis.letter]["travel"] == "unlimited" else self.kinds[axis.rotary]
        kind = kinds[int(self.rng.integers(len(kinds)))]
        two = self.both and not axis.rotary and (DIRECTIONS[k] == axis.letter or k == 4)
        low, high = self.span(axis)
        if kind in ("linear", "spline", "around") or two:
            return self.table(axis, k, name, "linear" if two else kind, two)
        amounts = [self.amount(k, 0.5) for _ in range(5)]
        if kind == "polynomial":
            return [f"polynomial = {amounts[:4]}", f"origin = {0.5 * (low + high) + 7.0}", f"scale = {0.5 * (high - low)}",
                    f"range = [{low}, {high}]"]
        waves = [f"mean = {amounts[0]}", f"cosine = {amounts[1:3]}", f"sine = {amounts[3:5]}", "origin = 11.5"]
        return waves if axis.rotary else [*waves, "repeats = 640.0", f"range = [{low}, {high}]"]

    def table(self, axis: Axis, k: int, name: str, kind: str, two: bool) -> list[str]:
        unit = ("arcsec", "urad") if k > 2 else ("um", "mm")
        unit = unit[int(self.rng.integers(2))]
        low, high = (-180.0, 170.0) if kind == "around" else self.span(axis)
        x = np.round(np.sort(np.append(self.rng.uniform(low, high, 9), [low, high])), 3)
        size = (UNITS["arcsec"] * self.size[1] if k > 2 else UNITS["um"] * self.size[0]) / UNITS[unit]
        y = self.rng.normal(size=len(x)) * size
        if kind == "spline":  # a spline between random rows far apart swings
            x, y = np.linspace(low, high, 11), 0.6 * y
        gap = 0.2 * size * self.rng.random()
        columns = [y - gap, y + gap] if two else [y]
        heads = [f"{name}{approach} [{unit}]" for approach in ("+-" if two else [""])]
        rows = np.column_stack([x, *columns])
        place = "deg" if axis.rotary else "mm"
        (self.folder / f"{name}.csv").write_text("\n".join([f"{axis.letter} [{place}],{','.join(heads)}", *(
            ",".join(f"{v:.12g}" for v in row) for row in rows)]) + "\n")
        more = ['interpolation = "spline"'] if kind == "spline" else ["repeats = 360.0"] if kind == "around" else []
        return [f'table = "{name}.csv"', *more]

    def location(self, axis: Axis) -> list[str]:
        """Location errors that move something: all but along and about the line, and no shift of a slide; its zero."""
        own = axis.letter in DIRECTIONS and DIRECTIONS.index(axis.letter)
        found = []
        for k, direction in enumerate(DIRECTIONS):
            along = np.linalg.norm(np.cross(axis.line, np.eye(3)[k % 3])) < 1e-9
            if k == own or (not along and (axis.rotary or k > 2)):
                found.append(f"E{direction}0{axis.letter} = {self.amount(k)!r}")
        return found

    def legs(self) -> None:
        for letter, leg in self.machine.kinematics["legs"].items():
            pairs = 2 if "rods" not in leg else len(leg["rods"])
            points = {key: [[self.amount(0) for _ in range(3)] for _ in range(pairs)] for key in ("carriage", "platform")}
            self.text += [f"[legs.{letter}]", f"rail = {[self.amount(0) for _ in range(3)]}",
                          f"guide = {[self.amount(3) for _ in range(3)]}", *(f"{k} = {v}" for k, v in points.items()),
                          f"length = {[self.amount(0) for _ in range(pairs)]}"]
            if "rods" not in leg:
                self.text.append("pair = 60.0")
