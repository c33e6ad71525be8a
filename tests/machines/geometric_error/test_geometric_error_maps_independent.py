"""Error maps of any order, unit, sign, zero, period and direction, read a second time by scipy's grid interpolation."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial.transform import Rotation

import machines
from machines.geometric_error.actual.correction import correct
from machines.geometric_error.files.loader import load
from tests.machines.independent_machine import UNITS, Machine, moved
from tests.machines.random_slides import random_slides
from toolpaths.arrays import Floats

TOOL = 77.0
SIZE = dict(zip(("dx", "dy", "dz", "rx", "ry", "rz"), (0.02, 0.02, 0.02, 4e-5, 4e-5, 4e-5), strict=True))
"""mm and rad"""
CASES = [("mikron-ucp710", "ZCx"), ("mikron-ucp710", "AyC"), ("head-table", "BXz"), ("linuxcnc-xyzac-trt", "CA"),
         ("nutating-head", "CBY"), ("mill-3axis", "zxy"), ("h4a-c-table", "Cyz"), ("uranesx", "XYZ")]


@dataclass
class Map:
    """A drawn map: text of its files, and what it says.

    Attributes:
        grid: nodes of each coordinate, mm and rad
        point: mm, how far below the gauge point the displaced point is
    """

    own: Machine
    letters: str
    seed: int
    rng: np.random.Generator = field(init=False)
    grid: list[Floats] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)
        for letter in self.letters:
            turning = letter in "ABC"
            low, high = (-1.0, 1.0) if turning else (900.0, 1300.0) if "legs" in self.own.kinematics and letter.isupper() \
                else (-900.0, 400.0)
            self.grid.append(np.sort(np.append(self.rng.uniform(low, high, 3), [low, high])))
        if self.rounds:
            self.grid[0] = np.radians([-180.0, -70.0, 20.0, 110.0])  # the last row is left out: it is the first
        self.values = self.rng.normal(size=(*(len(x) for x in self.grid), 6)) * list(SIZE.values())
        self.point = float(self.seed % 2) * 30.0
        self.machine_wide = self.seed % 3 == 1
        self.sign = -1.0 if self.seed % 4 == 2 else 1.0
        self.zero = np.array([0.5 * (x[0] + x[1]) for x in self.grid]) if self.seed % 2 else None

    @property
    def rounds(self) -> bool:
        return self.letters[0] == "C"

    def write(self, folder: Path) -> Path:
        rows = np.stack(np.meshgrid(*self.grid, indexing="ij"), axis=-1).reshape(-1, len(self.letters))
        rows = np.hstack([rows, self.values.reshape(-1, 6)])
        names = [*self.letters, *SIZE]
        units = ["deg" if n in "ABC" else self.rng.choice(["arcsec", "urad"]) if n[0] == "r" else
                 self.rng.choice(["um", "mm", "in"]) for n in names]
        columns = self.rng.permutation(len(names))
        lines = [";".join(f"{names[k]} [{units[k]}]" for k in columns)]
        lines += [";".join(f"{row[k] / UNITS[units[k]]:.15g}" for k in columns) for row in self.rng.permutation(rows)]
        (folder / "map.csv").write_text("\n".join(lines) + "\n")
        text = f'[map]\ntable = "map.csv"\ntool_length = {self.point}\nsign = {self.sign:.0f}\n'
        text += 'directions = "machine"\n' if self.machine_wide else ""
        text += "repeats = { C = 360 }\n" if self.rounds else ""
        if self.zero is not None:
            at = (v / UNITS["deg" if n in "ABC" else "mm"] for n, v in zip(self.letters, self.zero.tolist(), strict=True))
            text += f"zero = {{ {', '.join(f'{n} = {v!r}' for n, v in zip(self.letters, at, strict=True))} }}\n"
        (folder / "e.toml").write_text(text)
        return folder / "e.toml"

    def at(self, places: Floats) -> Floats:
        """(N, 6) of places (N, D); beyond the nodes as at the last of them."""
        grid, values = list(self.grid), self.values
        if self.rounds:
            grid[0] = np.append(grid[0], np.pi)
            values = np.concatenate([values, values[:1]])
            places = places.copy()
            places[:, 0] = (places[:, 0] + np.pi) % (2.0 * np.pi) - np.pi
        places = np.column_stack([np.clip(column, x[0], x[-1]) for column, x in zip(places.T, grid, strict=True)])
        noted = RegularGridInterpolator(tuple(grid), values)
        found = noted(places) - (0.0 if self.zero is None else noted(self.zero[None]))
        return np.asarray(self.sign * found)

    def displaced(self, q: Floats, tip: Floats, axis: Floats) -> tuple[Floats, Floats]:
        """(tip, axis) (N, 3) of nominal ones at joints q (N, J)."""
        point = tip + (TOOL - self.point) * axis
        places = np.column_stack([q[:, self.own.letters.index(n)] if n.isupper() else point[:, "xyz".index(n)]
                                  for n in self.letters])
        noted = self.at(places)
        if self.machine_wide:
            noted = np.array([np.concatenate([r @ v[:3], r @ v[3:]]) for r,
                              v in zip(map(self.table, q), noted, strict=True)])
        turned = Rotation.from_rotvec(noted[:, 3:]).apply(axis)
        return point + noted[:, :3] - (TOOL - self.point) * turned, turned

    def table(self, q: Floats) -> Floats:
        """Machine to table, (3, 3): all axes that carry the part."""
        if "legs" in self.own.kinematics:
            axes = [] if self.own.rotary_axis is None else [self.own.rotary_axis]
        else:
            axes = self.own.chain
        result = np.eye(3)
        for axis in axes:
            if axis.carries_part:
                result = result @ moved(axis, q[self.own.letters.index(axis.letter)], 0.0, None)[:3, :3]
        return result


@pytest.mark.covering
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("name", "letters"), CASES)
def test_a_second_reading_of_the_map_agrees(name: str, letters: str, seed: int, tmp_path: Path) -> None:
    machine = machines.load(name)
    drawn = Map(Machine(name), letters, seed)
    model, kin = load(drawn.write(tmp_path), machine), machine.kinematics.with_tool(TOOL)
    rng = np.random.default_rng(seed)
    if "legs" in drawn.own.kinematics:
        q = random_slides(kin, rng, 200)
        q = np.column_stack([q, rng.uniform(-0.9, 0.9, len(q))]) if any(machine.rotary) else q
    else:
        q = rng.uniform(-1.0, 1.0, (200, kin.joints)) * np.where(machine.rotary, 0.9, 150.0)
    if drawn.rounds:
        q[:, drawn.own.letters.index("C")] *= 7.0
    tip, axis = kin.forward(q)
    actual = model.on(kin)
    w = actual.coordinates(q, np.hstack([tip, axis]))
    inside = ~actual.outside(w).any(axis=1)
    assert inside.sum() > 20
    wanted = drawn.displaced(q[inside], tip[inside], axis[inside])
    found = actual.aim(w[inside])
    assert np.abs(found[0] - tip[inside]).max() > 5e-3
    np.testing.assert_allclose(found[0], wanted[0], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(found[1], wanted[1], rtol=0.0, atol=1e-12)
    done = correct(actual, q[inside], tip[inside], axis[inside], beyond=True)
    nominal = kin.forward(done.q, np.hstack([tip, axis])[inside])
    assert np.linalg.norm(drawn.displaced(done.q, *nominal)[0] - tip[inside], axis=1).max() < 1e-7
