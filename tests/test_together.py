"""Which files of tests stay with one worker."""

from __future__ import annotations

from tests.together import WORK, of


def test_files_that_look_at_the_source_are_one_work_and_others_their_own() -> None:
    assert {of(f"tests/{name}.py") for name in ("test_imports", "test_contract", "test_reachable")} == {WORK}
    assert of("tests/test_cover.py") == "tests/test_cover.py"
