"""Random paths in random frames, spelt by each system: counts, sweeps and places are those that were asked for."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from toolpaths.cl.inspect import inspect
from toolpaths.cl.read import read_bytes
from toolpaths.diagnostics import has_errors

sys.path.insert(0, str(Path(__file__).parents[3] / "samples"))

from cltext import UP, WORLD, Frame, face_frame
from make_dialects import DRILL, MILL, SYSTEMS
from spellings import Operation, Spelling

SEEDS = 10


@dataclass
class Walk:
    """Writes one random path; the same generator gives the same path in every spelling."""

    file: Spelling
    rng: np.random.Generator
    frame: Frame = WORLD
    tips: list[np.ndarray] = field(default_factory=list)
    sweeps: list[float] = field(default_factory=list)
    cycles: int = 0

    @property
    def axis(self) -> tuple[float, ...]:
        return UP if self.frame is WORLD else tuple(self.frame.rotation[:, 2])

    def somewhere(self) -> np.ndarray:
        return self.frame.point_out(self.rng.uniform(-50, 50, 3).round(3))

    def move(self, rapid: bool) -> None:
        (self.file.rapid if rapid else self.file.go)(self.somewhere(), self.axis)
        self.tips.append(self.file.position)

    def arc(self) -> None:
        """Any sweep, or a helix of a whole turn."""
        here = self.frame.point_in(self.file.position)
        radius, begin, sweep = self.rng.uniform((1, 0, 0.05), (40, 2 * np.pi, 2 * np.pi - 0.05))
        ccw, turns = bool(self.rng.random() < 0.5), int(self.rng.random() < 0.25)
        rise = -1.5 if turns else float(self.rng.choice([0.0, -2.5]))
        sweep = 2 * np.pi if turns else sweep
        center = here - radius * np.array([np.cos(begin), np.sin(begin), 0.0])
        angle = begin + (sweep if ccw else -sweep)
        end = np.array([*center[:2] + radius * np.array([np.cos(angle), np.sin(angle)]), here[2] + rise])
        self.file.arc(self.frame.point_out(center), self.frame.point_out(end), ccw, turns)
        self.tips.append(self.file.position)
        self.sweeps.append(sweep)

    def holes(self) -> None:
        self.file.cycle(float(self.rng.integers(1, 30)), 3, 20, 100, float(self.rng.choice([0, 4])))
        for _ in range(self.rng.integers(1, 4)):
            self.move(rapid=False)
        self.file.cycle_off()
        self.move(rapid=True)
        self.cycles += 1

    def operation(self, number: int, tilted: bool) -> None:
        origin, normal = tuple(self.rng.uniform(-50, 50, 3).round(4)), tuple(self.rng.normal(size=3))
        self.frame = face_frame(origin, normal) if tilted and self.rng.random() < 0.6 else WORLD
        self.file.begin(Operation(f"OP{number}", MILL if self.rng.random() < 0.5 else DRILL, self.frame, 1000))
        self.move(rapid=True)
        self.file.feed(float(self.rng.integers(10, 900)))
        for k in self.rng.random(self.rng.integers(1, 8)):
            self.move(rapid=False) if k < 0.4 else self.arc() if k < 0.8 else self.holes()
        self.file.end()


@pytest.mark.covering
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("name", list(SYSTEMS))
def test_random_path(name: str, seed: int) -> None:
    unit = "MM" if seed % 3 else "INCH"
    walk = Walk(SYSTEMS[name](unit), np.random.default_rng(seed))
    for number in range(4):
        walk.operation(number, tilted=not name.endswith(".clt"))
    walk.file.close()
    units = {"MM": "mm", "INCH": "inch"}[unit] if name in ("nx.cls", "catia.aptsource") else None
    result = read_bytes(walk.file.text(), units=units)
    assert not has_errors(result.diagnostics), [str(d) for d in result.diagnostics]
    found = inspect(result)
    assert (found["points"], found["arcs"], found["cycles"]) == (len(walk.tips), len(walk.sweeps),
                                                                 walk.cycles)
    assert result.toolpath.tip == pytest.approx(np.array(walk.tips), abs=2e-3)
    assert result.toolpath.arcs.sweep == pytest.approx(np.array(walk.sweeps), abs=2e-2)
