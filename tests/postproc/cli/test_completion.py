"""Completion in a shell: commands, options, names of machines and controllers."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

import machines
from postproc.cli.app import app
from postproc.controllers.model import builtin_files


@pytest.mark.parametrize(("typed", "found"), [
    ("postproc conv", ["convert"]), ("postproc setup ", ["new", "align", "check", "schema"]),
    ("postproc convert --feed-", ["--feed-mode"]),
    ("postproc convert part.cls -m mikron-u", ["mikron-ucp710"]), ("postproc time part.cls -m haas-umc-7", ["haas-umc-750"]),
    ("postproc convert part.cls -c sie", ["siemens-840d"])])
def test_what_is_begun_is_completed(typed: str, found: list[str]) -> None:
    words = typed.split(" ")
    ran = CliRunner().invoke(app, [], prog_name="postproc", env={
        "COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1), "_POSTPROC_COMPLETE": "complete_bash"})
    assert sorted(ran.output.split()) == sorted(found)


def test_all_names_are_known() -> None:
    from postproc.cli.shared.options import _controllers, _machines

    assert set(machines.names()) <= set(_machines("")) and set(builtin_files()) <= set(_controllers(""))
