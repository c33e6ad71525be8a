"""Bytes on disk until they are asked for again."""

from __future__ import annotations

import pickle

import pytest

from toolpaths import aside
from toolpaths.toolpath import ClSource


def test_bytes_put_aside_come_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also in another process; where there is no room for a file they are kept."""
    data = bytes(range(256)) * 4
    assert aside.aside(data) is data
    monkeypatch.setattr(aside, "LARGE", 1000)
    held = aside.aside(data)
    assert isinstance(held, aside.Aside)
    assert held.data() == held.data() == pickle.loads(pickle.dumps(held)).data() == ClSource(held).data == data

    def full(**_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tempfile.TemporaryFile", full)
    assert aside.aside(data) is data
