"""CONTRIBUTING, ARCHITECTURE and the README of the tests: files that they name are there, numbers are those
of the program."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from postproc.cli.app import app

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "tests/README.md"])
def test_files_that_are_named_are_there(page: str) -> None:
    here = (ROOT / page).parent
    named = re.findall(r"`([\w./-]+(?:\.py|\.md|\.toml|\.yaml)|[\w]+(?:/[\w]+)+)`",
                       (ROOT / page).read_text("utf-8"))
    assert len(named) > 8
    assert [name for name in named if not ((ROOT / name).exists() or (here / name).exists())] == []


def test_one_point_in_every_frame() -> None:
    """The table of ARCHITECTURE.md against `trace`: machine frame from the joints, less the gauge length."""
    text = (ROOT / "ARCHITECTURE.md").read_text("utf-8")
    rows = {cells[0]: [[float(x) for x in cell.split(",")] for cell in cells[1:3]] for cells in
            ([c.strip() for c in line.strip("| ").split("|")] for line in text.splitlines()
             if re.match(r"\| (part|table|machine|platform|tool) \| -?\d", line))}
    assert list(rows) == ["part", "table", "machine", "platform", "tool"]
    done = CliRunner().invoke(app, ["trace", str(ROOT / "samples/blade.cls"), "--line", "1200", "-m", "mikron-ucp710", "-c",
                                    "linuxcnc", "--setup", str(ROOT / "samples/tools.setup.toml"), "--json", "-"])
    point = json.loads(done.stdout)["points"][0]
    move, length = point["moves"][0], point["gauge_length_mm"]
    q = move["joints"][-1]
    for frame, tip, axis in (("part", point["toolpath"]["tip_mm"], point["toolpath"]["axis"]),
                             ("table", move["table_frame"]["tip_mm"], move["table_frame"]["axis"]),
                             ("machine", [q["X"], q["Y"], q["Z"] - length], [0.0, 0.0, 1.0])):
        assert rows[frame][0] == pytest.approx(tip, abs=1e-6) and rows[frame][1] == pytest.approx(axis, abs=1e-6)
    assert rows["platform"][0] == pytest.approx([0.0, 0.0, -length]) and rows["tool"] == [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    assert move["blocks"][-1].split(" F")[0].removeprefix("feed ") in text


def test_local_hooks_are_what_make_lint_runs() -> None:
    """Rules of `.pre-commit-config.yaml` hold in CI too."""
    hooks = re.findall(r"entry: \.venv/bin/(.*)", (ROOT / ".pre-commit-config.yaml").read_text("utf-8"))
    lint = re.search(r"^lint:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    assert lint is not None and len(hooks) == 3
    for hook in hooks:
        assert f"$(BIN)/{hook.replace(' --fix', '')}" in lint[1]


def test_the_forge_runs_every_python_that_is_promised() -> None:
    workflow = (ROOT / ".github/workflows/ci.yml").read_text("utf-8")
    versions = re.findall(r'"(3\.\d+)"', workflow)
    least = re.search(r'requires-python = ">=(3\.\d+)"', (ROOT / "pyproject.toml").read_text("utf-8"))
    assert least is not None and versions[0] == least[1] and len(versions) >= 3
    targets = set(re.findall(r"make PYTHON=python (\w+)", workflow))
    assert targets and all(re.search(rf"^{name}:", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE) for name in targets)
