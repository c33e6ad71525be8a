"""A program with tools of other lengths, known without executing it again: where registers take the lengths up.

The control adds the length of the active register to words of Z (ISO 6983-1, G43), not to those in machine
coordinates. Without a law of its own every place of Z is a word, a word of an earlier block, or a step from one: it goes up
by what the register of that word has gained. Cycles and arcs are moved as they are where all that they are made of goes up
alike; what else there is has to be executed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from postproc.readback.execution.execute import Motion
from postproc.readback.execution.offsets import Offsets
from postproc.readback.text.canonical import REGISTER, Canonical
from postproc.readback.text.modal import codes, fill
from toolpaths.arrays import Floats

ARC = 2
MACHINE = 53.0
"""the code of a block in machine coordinates"""


def lifted(motion: Motion, code: Canonical, letters: tuple[str, ...], offsets: Offsets,
           held: Mapping[int, float]) -> Motion | None:
    """The motion (E blocks) of a program with the lengths `held` (mm) in its registers, from that with those of `offsets`,
    as `run` has both; None where it has to be executed. The motion itself where no place depends on them."""
    z = int(offsets.xyz[2])
    if not motion.table.plain or motion.contour.any():
        return None
    if not offsets.on_z or z < 0:
        return motion
    own, gained = _gained(code, letters[z], offsets, held)
    gain = gained[motion.block]
    whole = motion.hole | (motion.code == ARC)
    apart = (gained[np.maximum(motion.block - 1, 0)] != gain) | (own[motion.block] != gain)
    if (whole & apart).any():
        return None
    if not gain.any():
        return motion
    end, center = np.array(motion.end), np.array(motion.center)
    end[:, z] += gain
    center[:, 2] += np.where(motion.code == ARC, gain, 0.0)
    return replace(motion, end=end, center=center)


def always_lifted(motion: Motion) -> bool:
    """Whether `lifted` needs no words but those of the register and of the height, whatever lengths are held."""
    whole = motion.hole.any() or (motion.code == ARC).any() or motion.contour.any()
    return motion.table.plain and not whole


def _gained(code: Canonical, letter: str, offsets: Offsets, held: Mapping[int, float]) -> tuple[Floats, Floats]:
    """(B + 1,) mm that the active register holds more at each block, and that the axis of `letter` stands higher by behind
    it."""
    words = code.words
    register = fill(*words.pick(REGISTER), words.lines, -1.0).astype(np.int64)
    known, which = np.unique(register, return_inverse=True)
    more = [held.get(one, 0.0) - offsets.length(one) if one >= 0 else 0.0 for one in known.tolist()]
    own = np.array(more)[which]
    by_machine = np.zeros(words.lines + 1, dtype=bool)
    by_machine[codes(words, "G", (MACHINE,))[0]] = True
    stated = words.pick(letter)[0]
    return own, fill(stated, np.where(by_machine, 0.0, own)[stated], words.lines, 0.0)
