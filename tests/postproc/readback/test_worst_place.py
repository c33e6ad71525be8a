"""In long programs the worst deviation is looked for where bounds leave it open: it is that of looking everywhere."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.readback.comparison import compare
from tests.postproc.kit import sample


@pytest.mark.parametrize(("name", "share"), [("mikron-ucp710", 0.9), ("nutating-head", 1.0)])
def test_the_worst_place_is_the_same(name: str, share: float, monkeypatch: pytest.MonkeyPatch) -> None:
    result = sample("blade.cls", name)
    assert result.comparison is not None and result.job is not None
    c, looked, look = result.comparison, list[int](), compare._deviations
    monkeypatch.setattr(compare, "CHUNK", 50)
    monkeypatch.setattr(compare, "FIRST", 3)
    monkeypatch.setattr(compare, "_deviations", lambda *given: (looked.append(len(given[3])), look(*given))[1])
    again = compare.compare(*c.executed, result.job, c.poses)
    for value in ("worst_tip", "worst_axis", "worst_tip_line", "worst_axis_line", "tip_bound", "axis_bound"):
        assert getattr(again, value) == getattr(c, value)
    assert 0 < sum(looked) < share * len(c.owner)


def test_nothing_is_known_of_arcs_and_of_blocks_farther_off() -> None:
    most = np.array([[0.001, 0.001, 0.02, np.inf], [1e-4, 1e-4, 1e-4, np.inf]])
    found = compare._known_limits(most, np.array([False, True, False, False]), 0.01)
    assert found[:, 0].tolist() == [0.001, 1e-4] and np.isinf(found[:, 1:]).all()
