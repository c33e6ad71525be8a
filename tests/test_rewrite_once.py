"""Asserts of a test file are prepared by one worker; the others read what it has kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from _pytest.assertion import rewrite

from tests import rewrite_once


@pytest.mark.skipif(pytest.version_tuple[0] != rewrite_once.KNOWN,
                    reason="another pytest prepares its files as it does")
def test_the_second_worker_finds_what_the_first_has_kept(tmp_path: Path, pytestconfig: pytest.Config) -> None:
    file, calls = tmp_path / "test_x.py", []
    file.write_text("def test() -> None:\n    assert True\n")
    rewrite.get_cache_dir(file).mkdir(parents=True)

    def prepare(source: Path, config: Any) -> Any:
        calls.append(source)
        return rewrite._rewrite_test.__wrapped__(source, config)

    first, second = (rewrite_once.one_at_a_time(prepare)(file, pytestconfig) for _ in range(2))
    assert calls == [file] and first == second
    file.write_text("def test() -> None:\n    assert 1 + 1 == 2\n")
    third = rewrite_once.one_at_a_time(prepare)(file, pytestconfig)
    assert len(calls) == 2 and third[0] != first[0]
