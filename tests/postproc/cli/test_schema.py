"""`postproc schema`: every command that writes JSON has a published schema, and what is not as it says is found."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from postproc.cli.app import app
from postproc.cli.shared.schemas import FILES, RESULTS, file_schema, result_schema
from tests.results_checked import faults


def commands(group: Any, words: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """Words of each command, and the command."""
    for name, one in group.commands.items():
        if hasattr(one, "commands"):
            yield from commands(one, (*words, name))
        else:
            yield " ".join((*words, name)), one


def test_every_command_that_writes_json_has_a_schema_and_no_other() -> None:
    found = dict(commands(get_command(app)))
    with_json = {name for name, one in found.items() if any("--json" in option.opts for option in one.params)}
    assert set(RESULTS) == with_json
    assert {name.split()[-1] for name in set(found) - with_json} == {"schema"}


def test_schemas_have_names_of_their_own() -> None:
    ids = [one["$id"] for one in (*map(file_schema, FILES), *map(result_schema, RESULTS))]
    assert len(set(ids)) == len(FILES) + len(RESULTS)
    for name in ("setup-file", "machine check"):
        printed = CliRunner().invoke(app, ["schema", *name.split()])
        assert json.loads(printed.stdout)["$id"] in ids
    assert CliRunner().invoke(app, ["schema"]).stdout.count("\n") == len(FILES) + len(RESULTS) + 2


def test_a_name_that_there_is_not_is_wrong_use() -> None:
    ran = CliRunner().invoke(app, ["schema", "machine", "chek"])
    assert ran.exit_code == 2 and "did you mean 'machine check'?" in ran.stderr


HEAD = {"schema_version": 1, "ok": True, "diagnostics": []}


@pytest.mark.parametrize(("value", "said"), [
    (HEAD | {"controllers": []}, ""), (HEAD | {"controllers": {}}, "controllers"), (HEAD, "no key controllers"),
    (HEAD | {"ok": False}, ""), (HEAD | {"ok": 1}, "ok"), ({"ok": False, "diagnostics": []}, "schema_version"),
    (HEAD | {"ok": False, "diagnostics": [{"code": "x"}]}, "no key hint")])
def test_what_is_not_as_the_schema_says_is_found(value: dict[str, Any], said: str) -> None:
    found = faults(result_schema("controller list"), value)
    assert said in "\n".join(found) and bool(found) == bool(said)
