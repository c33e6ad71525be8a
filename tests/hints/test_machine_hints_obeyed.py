"""The law of hints for commands about machines, errors, calibrations, times, axes; it is in `test_hints_obeyed.py`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hints.case import HintCase
from tests.hints.cases import OF_MACHINES
from tests.hints.test_hints_obeyed import faults_of, few_places

__all__ = ["few_places"]


@pytest.mark.parametrize("case", OF_MACHINES.values(), ids=OF_MACHINES)
def test_a_hint_about_a_machine_is_obeyed(case: HintCase, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert not faults_of(case, tmp_path, monkeypatch)
