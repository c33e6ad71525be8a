"""Every example of docs/reference/error-models.md and of the room's README as it stands; its commands run in tests/docs."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
from machines.geometric_error import load
from machines.geometric_error.exchange import survey
from postproc.cli.app import app

ROOT = Path(__file__).parents[3]
PAGES = ("machines/geometric_error/README.md", "docs/reference/error-models.md")
TEXT = "".join((ROOT / page).read_text("utf-8") for page in PAGES)
SAMPLES = ROOT / "samples/errors"
COMMANDS = [line.split("#")[0].strip() for block in re.findall(r"```sh\n(.*?)```", TEXT, re.DOTALL)
            for line in block.splitlines() if line.startswith("postproc")]
TABLES = dict(re.findall(r"```text\n# (\S+\.csv)\n(.*?)```", TEXT, re.DOTALL))
MODELS = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)
ADJACENT = {"x.comp": "-100 -100.002 -100.001\n0 0 0.001\n100 100.003 100.004\n",
            "y.csv": "Y [mm],EYY [um],EXY [um]\n-200,0,1\n200,4,2\n", "x.csv": "X [mm],EXX [um]\n-300,0\n300,4\n"}
"""files that the README names and does not show"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What the commands name; models are looked at in few places."""
    monkeypatch.setattr(survey, "PLACES", 1000)
    for file in SAMPLES.iterdir():
        shutil.copy(file, tmp_path)
    shutil.copy(SAMPLES / "mikron-ucp710.toml", tmp_path / "errors.toml")
    shutil.copy(SAMPLES / "map-mikron-ucp710.csv", tmp_path / "map.csv")
    for name, text in (ADJACENT | TABLES).items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_there_are_all_of_them() -> None:
    assert {words.split()[2] for words in COMMANDS} == {"check", "to-tables", "to-linuxcnc", "to-map", "import"}
    assert set(TABLES) == {"location.csv", "covariance.csv", "laser.csv"} and len(MODELS) == 2


@pytest.mark.parametrize("text", MODELS)
def test_models_are_read(text: str, folder: Path) -> None:
    (folder / "example.toml").write_text(text)
    assert len(load(folder / "example.toml", machines.load("mikron-ucp710")).names) > 5


def test_the_python_lines_run(folder: Path) -> None:
    code = re.search(r"```python\n(.*?)```", TEXT, re.DOTALL)
    assert code is not None
    machine = machines.load("mikron-ucp710")
    q = np.array([[10.0, 20.0, -30.0, 0.5, 1.0]])
    tip, axis = machine.kinematics.with_tool(80.0).forward(q)
    names = {"machine": machine, "q": q, "tip": tip, "axis": axis}
    exec(code[1], names)
    assert np.linalg.norm(names["found"].q - q) > 1e-4 and names["found"].tip_after < 1e-6
    assert 0.0 < names["spread"].tip_worst[0] < 0.02


def test_what_the_tables_say_is_what_the_models_hold(folder: Path) -> None:
    mill = machines.load("mill-3axis")
    for command in COMMANDS:
        if "covariance.csv" in command or "laser.csv" in command:
            assert CliRunner().invoke(app, shlex.split(command)[1:]).exit_code == 0
    square, laser = load(folder / "square.toml", mill), load(folder / "x.toml", mill)
    arcsec = np.radians(1.0 / 3600.0)
    assert square.axes.constants == pytest.approx({"EC0Y": 6 * arcsec, "EB0Z": -4 * arcsec, "EA0Z": 5 * arcsec})
    assert square.covariance is not None
    assert square.covariance / arcsec**2 == pytest.approx(np.array([[0.25, -0.1, 0], [-0.1, 0.36, 0], [0, 0, 0]]))
    assert 1e3 * laser.values == pytest.approx([-9.45, 0.25, 8.2, -12.8, -3.5, 4.9])
    assert laser.axes.components[0].curve.range == pytest.approx((-500.0, 500.0))
