"""Random sequences of canned cycles: where LinuxCNC's interpreter goes, and where the reader goes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from postproc.readback.execution.offsets import Offsets
from postproc.readback.text.words import tokenise
from tests.linuxcnc.interpreter import Move
from tests.postproc.reader_kit import execute

LETTERS = ("X", "Y", "Z")
WORDS = {81: "", 82: " P0.5", 83: " Q4", 73: " Q3", 86: " P0.5"}
"""cycles and what they need next to Z and R; the retract at feed of 84, 85, 89 is cut in two by the reader"""


def program(rng: np.random.Generator) -> str:
    """Sequences of cycles under G98 and G99, words restated here and there, G80 and rapids between them."""
    def hole(code: int) -> str:
        return (f"G9{rng.integers(8, 10)} G{code} X{rng.integers(-50, 50)} Z{-rng.integers(1, 20)} "
                f"R{rng.integers(0, 70)}{WORDS[code]}")

    lines = ["G21 G90 G94 G17 G40 G49 G80", f"G0 X0 Y0 Z{rng.integers(1, 60)}", "F100 S100 M3"]
    for _ in range(4):
        lines.append(hole(int(rng.choice(list(WORDS)))))
        for _ in range(rng.integers(0, 4)):
            again = ["", "G98 ", "G99 "][rng.integers(0, 3)]
            plane = ["", f" R{rng.integers(0, 70)}"][rng.integers(0, 2)]
            lines.append(f"{again}X{rng.integers(-50, 50)} Y{rng.integers(-50, 50)}{plane}")
        lines += [[], ["G80"], ["M8", "G80"], ["G80", f"G0 Z{rng.integers(0, 60)}"], ["G0 X7"]][rng.integers(0, 5)]
    return "\n".join([*lines, "G80", "M2", ""])


def places(points: np.ndarray) -> list[tuple[float, ...]]:
    """Points without those where nothing moves."""
    rounded = [tuple(p) for p in np.round(points, 6).tolist()]
    return [p for before, p in zip([(), *rounded], rounded, strict=False) if p != before]


@pytest.mark.covering(count=5)
@pytest.mark.parametrize("seed", range(12))
def test_cycles_go_where_the_interpreter_goes(interpret, tmp_path: Path, seed: int) -> None:
    text = program(np.random.default_rng(seed))
    (tmp_path / "p.ngc").write_text(text)
    canonical = interpret(tmp_path / "p.ngc")
    assert canonical.error == ""
    moves = (canonical.kind == Move.FEED) | (canonical.kind == Move.TRAVERSE)
    words, _ = tokenise(text.encode(), "p.ngc")
    zero = np.zeros(3)
    offsets = Offsets(zero, np.arange(3), {}, zero, True, 0.254, None, True, math.inf)
    motion, found = execute(words, LETTERS, offsets, "p.ngc")
    assert not found, [str(d) for d in found]
    assert places(motion.end) == places(canonical.pos[moves][:, :3])
