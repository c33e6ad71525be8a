"""Blocks and commanded positions: the loop compiled gives what the loop as it stands gives, and leaves it as it is."""

from __future__ import annotations

from types import FunctionType

import numpy as np
import pytest

from postproc.witness import loops


@pytest.mark.numeric
@pytest.mark.slow  # make numeric
@pytest.mark.parametrize("folder", [True, False])
def test_compiled_and_interpreted_loops_agree(folder: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of which every third ends at a position that the file commands; with and without a folder for machine code."""
    if not folder:
        monkeypatch.setattr(pytest.importorskip("numba.core.caching").CacheImpl, "_locator_classes", [])
    monkeypatch.setattr(loops, "_compiled", [])
    tip = np.random.default_rng(1).uniform(-9.0, 9.0, (300, 3))
    axis, none = np.tile([0.0, 0.0, 1.0], (300, 1)), np.zeros((300, 3))
    given = (tip, axis, none, tip[::3], axis[::3], np.zeros(100), np.zeros((100, 6)), np.zeros(100, dtype=bool),
             np.zeros(100), (1e-6, 1e-6))
    plain = loops.walk(*given)
    monkeypatch.setattr(loops, "COMPILED_FROM", 0)
    assert plain.tolist() == list(range(0, 300, 3)) == loops.walk(*given).tolist()
    assert loops._compiled and isinstance(loops._near, FunctionType)
