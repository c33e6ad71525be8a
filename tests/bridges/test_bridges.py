"""Bridges from CAM systems: what they write is read without an error, means what the system meant, converts and verifies."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

import postproc
import toolpaths
from postproc.cli.app import app
from tests.postproc.kit import SAMPLES, good, machine, tool_setup
from toolpaths.diagnostics import Severity

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "samples/bridges"
WORD = re.compile(r"([A-Z])\s*(-?[\d.]+)")


def read(text: str) -> toolpaths.Toolpath:
    path, found = toolpaths.read_bytes(text.encode())
    assert [d for d in found if d.severity is not Severity.INFO] == []
    return path


@dataclass
class Command:
    """FreeCAD's Path.Command: a name, and parameters by their letters."""

    text: str
    Name: str = ""
    Parameters: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.text.startswith("("):
            self.Name = self.text
            return
        self.Name, *words = self.text.split()
        self.Parameters = {letter: float(value) for letter, value in WORD.findall(" ".join(words))}


@pytest.fixture(scope="module")
def freecad() -> ModuleType:
    spec = importlib.util.spec_from_file_location("postproc_apt_post", FOLDER / "freecad/postproc_apt_post.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def operation(*commands: str, **more: object) -> SimpleNamespace:
    return SimpleNamespace(Label="Profile", Path=SimpleNamespace(Commands=[Command(one) for one in commands]), **more)


PLATE = (FOLDER / "freecad/plate.commands").read_text().splitlines()
CONTROLLER = SimpleNamespace(ToolNumber=1, SpindleSpeed=3000.0, SpindleDir="Forward",
                             Tool=SimpleNamespace(Diameter=SimpleNamespace(Value=10.0), ShapeName="endmill"))


def test_commands_of_freecad_are_the_moves_that_another_reader_has(freecad: ModuleType) -> None:
    """The project's own reader of FreeCAD's form shares no code with the post."""
    ours = read(freecad.export([operation(*PLATE, ToolController=CONTROLLER)], "-"))
    other, found = toolpaths.read_bytes("\n".join(PLATE).encode(), dialect="freecad")
    assert not [d for d in found if d.severity is Severity.ERROR]
    before = slice(0, int((other.cycle < 0).argmin()) - 1)  # up to the holes, which the post spells out
    same = ours.tip[:len(other.tip[before])]
    np.testing.assert_allclose(same, other.tip[before], atol=1e-6)
    np.testing.assert_allclose(ours.feed[:len(same)], other.feed[before], rtol=1e-6)
    arcs = ours.arc[:len(same)] >= 0
    assert (arcs == (other.arc[before] >= 0)).all() and arcs.sum() == 2
    for name in ("center", "normal", "sweep"):
        np.testing.assert_allclose(getattr(ours.arcs, name)[:2], getattr(other.arcs, name)[:2], atol=1e-6)
    assert ours.tools[0].number == 1


def test_holes_of_freecad_are_spelt_out(freecad: ModuleType) -> None:
    path = read(freecad.export([operation(*PLATE)], "-"))
    z = path.tip[len(path.tip) - 17:, 2]
    assert z.min() == -9.0 and {-6.0, -1.0, -4.0, -7.0, -9.0, -3.0, 2.0} <= set(path.tip[:, 2].tolist())
    assert [event.values for event in path.events if event.word == "DELAY"] == [(0.5,)]


def verified(part: Path, name: str, folder: Path, change: tuple[str, str] | None = None) -> int:
    """Exit code of `postproc verify` of the program that `postproc convert` writes of a file, its first text changed."""
    program, given = folder / "p.ngc", ["-m", name, "-c", "linuxcnc", "--setup", str(SAMPLES / "tools.setup.toml"), "-q"]
    done = CliRunner().invoke(app, ["convert", str(part), *given, "-o", str(program)])
    assert done.exit_code == 0, done.output
    if change is not None:
        program.write_text(program.read_text("utf-8").replace(*change, 1), encoding="utf-8")
    return CliRunner().invoke(app, ["verify", str(program), str(part), *given]).exit_code


def test_a_job_of_freecad_converts_and_is_proved(freecad: ModuleType, tmp_path: Path) -> None:
    place = tmp_path / "a part.apt"
    freecad.export([operation(*PLATE, ToolController=CONTROLLER), operation("G1 X999", Active=False)], str(place))
    path, found = toolpaths.read(place)
    assert not [d for d in found if d.severity is not Severity.INFO]
    result = good(postproc.convert(path, machine("mill-3axis"), controller="linuxcnc", setup=tool_setup()))
    assert result.comparison is not None and result.comparison.unbounded == 0
    assert verified(place, "mill-3axis", tmp_path) == 0
    assert verified(place, "mill-3axis", tmp_path, ("G1 ", "G1 X1.5 ")) == 1, "a changed program is not that of the job"


@pytest.mark.parametrize(("commands", "words"), [
    (["G0 X0 Y0 Z5", "G1 A30 F5"], "A, B and C"), (["G0 X0 Y0 Z5", "G5 X1"], "command 2 (G5)"),
    (["G1 X5 F5"], "before X, Y and Z"), (["G0 X0 Y0 Z5", "G1 X5"], "without a feed"),
    (["G0 X0 Y0 Z5", "G2 X5 I2 K1 F5"], "arcs lie in XY"), (["G0 X0 Y0 Z5", "G83 Z-5 R2 F5"], "pecks need Q"),
    (["G0 X0 Y0 Z5", "G81 Z-5 F5"], "a hole needs"), (["G20"], "not known"), (["G0 X0 Y0 Z5 W3"], "nothing takes W")])
def test_what_cannot_be_said_is_refused(freecad: ModuleType, commands: list[str], words: str) -> None:
    with pytest.raises(freecad.Refused, match=re.escape(words)):
        freecad.export([operation(*commands)], "-")


def test_a_placement_is_refused(freecad: ModuleType) -> None:
    with pytest.raises(freecad.Refused, match="placement"):
        freecad.export([operation("G0 X0 Y0 Z5", Placement=SimpleNamespace(isIdentity=lambda: False))], "-")


def fusion(*how: str) -> str:
    node = shutil.which("node")
    if node is None:
        pytest.skip("node, which runs the post, is not installed")
    words = [node, str(ROOT / "tests/bridges/fusion_engine.js"), str(FOLDER / "fusion/neutral_apt.cps"), *how]
    done = subprocess.run(words, capture_output=True, text=True, timeout=30, check=True)
    return done.stdout


def test_the_post_of_fusion_writes_the_path_in_the_work_coordinate_system() -> None:
    path = read(fusion())
    assert [op.name for op in path.operations] == ["Face 0", "Face 1", "Face 2"]
    level, tilted, many = (path.operation == k for k in range(3))
    c, s = np.cos(np.pi / 6.0), 0.5
    np.testing.assert_allclose(path.axis[level], np.tile([0.0, 0.0, 1.0], (level.sum(), 1)))
    np.testing.assert_allclose(path.axis[tilted], np.tile([0.0, -s, c], (tilted.sum(), 1)), atol=1e-8)
    np.testing.assert_allclose(path.tip[tilted][[0, 3, 4]], np.array([[0, 0, 40], [15, 0, 0], [19, 4, 0.0]]) @ np.array(
        [[1, 0, 0], [0, c, s], [0, -s, c]]) + [5, 6, 7], atol=1e-6)
    np.testing.assert_allclose(path.axis[many][-1], [0.0, np.sin(0.1), np.cos(0.1)], atol=1e-8)
    np.testing.assert_allclose(path.arcs.normal, [[0, 0, 1], [0, 0, -1], [0, -s, c]], atol=1e-8)
    np.testing.assert_allclose(path.arcs.sweep, [np.pi / 2, np.pi / 2, np.pi / 2], atol=1e-6)


def test_a_program_from_fusion_is_proved(tmp_path: Path) -> None:
    result = good(postproc.convert(read(fusion()), machine("mikron-ucp710"), controller="linuxcnc", setup=tool_setup()))
    assert result.comparison is not None and result.comparison.unbounded == 0
    part = tmp_path / "from fusion.apt"
    part.write_text(fusion(), encoding="utf-8")
    assert verified(part, "mikron-ucp710", tmp_path) == 0


def test_inches_of_fusion_stay_inches() -> None:
    text = fusion("inch")
    assert "UNITS/INCHES" in text and "FEDRAT/IPM,300" in text
    np.testing.assert_allclose(read(text).tip[1], [0.0, 0.0, 3 * 25.4])


def test_what_fusion_cannot_hand_on_is_refused_there() -> None:
    text = fusion("faults")
    assert all(words in text for words in ("In computer", "Text for one control (M98)", "This coolant", "linearized 1"))


@pytest.mark.skipif(os.name == "nt", reason="a script of the shell")
def test_the_batch_file_of_nx(tmp_path: Path) -> None:
    """Paths with blanks, the command before it, its failure, wrong use: exit codes and what is written."""
    folder = tmp_path / "my parts"
    folder.mkdir()
    calls = folder / "postproc"
    calls.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m postproc "$@"\n')
    calls.chmod(0o755)
    tools = ROOT / "samples/tools.setup.toml"
    given = os.environ | {"MACHINE": "mill-3axis", "CONTROLLER": "siemens-840d", "SETUP": str(tools), "POSTPROC": str(calls),
                          "PYTHONPATH": str(ROOT), "NX_CL_COMMAND": f"cp '{ROOT}/samples/pocket.cls' 'a part.cls'"}

    def run(*words: str, **more: str) -> int:
        return subprocess.run([FOLDER / "nx/postprocess.sh", *words], cwd=folder, env=given | more, capture_output=True,
                              timeout=60, check=False).returncode

    assert run("a part.cls", "a part.mpf") == 0
    assert {"a part.mpf", "a part.mpf.proof.json", "a part.mpf.json"} <= {one.name for one in folder.iterdir()}
    assert run("a part.cls") == 2 and run("a part.cls", "b.mpf", NX_CL_COMMAND="exit 7") == 7
    assert run("a part.cls", "b.mpf", MACHINE="") != 0 and not (folder / "b.mpf").exists()


def test_both_batch_files_of_nx_call_the_same_command() -> None:
    """The one of Windows is not run elsewhere; its line ends are those that cmd needs."""
    shell, batch = ((FOLDER / f"nx/postprocess.{ending}").read_bytes() for ending in ("sh", "bat"))
    assert b"\r" not in shell and batch.count(b"\r\n") == batch.count(b"\n")
    called = [text.partition(b"convert ")[2] for text in (shell.replace(b"[ -n", b"["), batch)]
    options = [re.findall(rb"(?<= )--?[a-z]+", text) for text in called]
    assert set(options[0]) == {b"-m", b"-c", b"-o", b"--proof", b"--json", b"--setup"}
    assert {*options[1], b"--setup"} == {*options[0]} and b'set MORE=--setup "%SETUP%"' in batch
