"""The command line's outputs as one transaction, and what the header of a program says of the files that made it."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from postproc.cli.app import app
from postproc.cli.shared.console import print_json
from postproc.setup.fingerprint import fingerprint
from postproc.setup.model import load_setup
from tests.postproc.kit import SAMPLES, TOOLS
from toolpaths import interrupted_runs

GOLDEN = Path(__file__).parents[2] / "golden"
MIKRON = ["-m", "mikron-ucp710", "-c", "fanuc-30i"]
CONTROLLERS = ("fanuc-30i", "siemens-840d", "heidenhain-tnc640", "linuxcnc", "generic-iso")


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture
def shop(tmp_path: Path) -> Path:
    """A folder with a CL file of three operations and a set-up that writes each into a file of its own."""
    shutil.copy(GOLDEN / "three_laws.cls", tmp_path / "part.cls")
    (tmp_path / "shop.toml").write_text(Path(TOOLS).read_text() + "\n[output]\nfiles = true\n")
    return tmp_path


def convert(shop: Path, *more: str | Path) -> Result:
    return run("convert", shop / "part.cls", *MIKRON, "-o", shop / "out" / "main.nc", "--setup",
               shop / "shop.toml", *more)


def texts(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def test_programs_subprograms_and_figures_are_one_transaction(shop: Path,
                                                              monkeypatch: pytest.MonkeyPatch) -> None:
    json = shop / "s.json"
    assert convert(shop, "--json", json).exit_code == 0
    before, figures = texts(shop / "out"), json.read_bytes()
    assert sorted(before) == ["O1001", "O1002", "O1003", "main.nc"]
    (shop / "part.cls").write_text((shop / "part.cls").read_text().replace("SPINDL/RPM,", "SPINDL/RPM,1"))
    rename = Path.replace
    for last in ("s.json", "O1003", "main.nc"):
        def full(self: Path, target: Path, last: str = last) -> Path:
            if target.name == last:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return rename(self, target)

        with monkeypatch.context() as patch:
            patch.setattr(Path, "replace", full)
            got = convert(shop, "--json", json)
        assert got.exit_code == 1 and f"{last}: error [file.write] cannot be written: No space left" in got.stderr
        assert "written" not in got.stdout and isinstance(got.exception, SystemExit)
        assert texts(shop / "out") == before and json.read_bytes() == figures
    assert convert(shop, "--json", json).exit_code == 0
    assert texts(shop / "out") != before


def test_read_only_outputs_are_refused(shop: Path) -> None:
    assert convert(shop).exit_code == 0
    before = texts(shop / "out")
    (shop / "out" / "O1002").chmod(0o444)
    (shop / "part.cls").write_text((shop / "part.cls").read_text().replace("SPINDL/RPM,", "SPINDL/RPM,1"))
    got = convert(shop)
    assert got.exit_code == 1 and "O1002: error [file.write] cannot be written: it is read-only" in got.stderr
    assert texts(shop / "out") == before


def test_no_subprogram_replaces_an_input(shop: Path) -> None:
    shutil.move(shop / "part.cls", shop / "O1002")
    before = (shop / "O1002").read_bytes()
    arguments = ["convert", shop / "O1002", *MIKRON, "--setup", shop / "shop.toml", "-o"]
    got = run(*arguments, shop / "main.nc")
    assert got.exit_code == 1 and "O1002: error [file.input] the output would replace the CL file" in got.stderr
    assert (shop / "O1002").read_bytes() == before and not (shop / "O1001").exists()
    assert run(*arguments, shop / "other" / "main.nc").exit_code == 0  # the hint


def test_machine_and_controller_files_are_not_replaced(shop: Path) -> None:
    (shop / "m.toml").write_text('base = "mikron-ucp710"\n')
    (shop / "c.toml").write_text('base = "fanuc-30i"\n')
    for file in ("m.toml", "c.toml"):
        got = run("convert", shop / "part.cls", "-m", shop / "m.toml", "-c", shop / "c.toml", "-o",
                  shop / file)
        assert got.exit_code == 2 and "the output would replace the" in got.stderr.replace("\n", " ")


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_header_has_names_and_no_places(tmp_path: Path, controller: str) -> None:
    """Not of machine, controller, set-up, error model or CL file; the set-up is known by its fingerprint."""
    places = {}
    for key, name, text in (("m", "mikron-ucp710.toml", 'base = "mikron-ucp710"\n'),
                            ("c", "ctrl.toml", f'base = "{controller}"\n'),
                            ("s", "shop.toml", Path(TOOLS).read_text()), ("e", "errors.toml", "")):
        (tmp_path / f"secret_{key}").mkdir()
        places[key] = tmp_path / f"secret_{key}" / name
        places[key].write_text(text)
    shutil.copy(SAMPLES / "errors" / "mikron-ucp710.toml", places["e"])
    shutil.copytree(SAMPLES / "errors", tmp_path / "secret_e", dirs_exist_ok=True)  # its tables
    shutil.copy(GOLDEN / "short_five_axis.apt", tmp_path / "secret_m" / "part.cls")
    out = tmp_path / "out" / "p.nc"
    errors = ["--error-model", places["e"]] if controller == "linuxcnc" else []
    arguments = [tmp_path / "secret_m" / "part.cls", "-m", places["m"], "-c", places["c"], "--setup", places["s"], *errors]
    got = run("convert", *arguments, "-o", out)
    assert got.exit_code == 0, got.output
    text = out.read_text()
    assert "secret" not in text.lower() and str(tmp_path).lower() not in text.lower()
    mark = fingerprint(load_setup(places["s"])[0], str(places["s"]))
    assert re.search(rf"setup shop\.toml, fingerprint of the set-up {mark}", text, re.IGNORECASE)
    got = run("verify", out, *arguments)
    assert got.exit_code == 0 and "verify.setup" not in got.output, got.output


def test_verify_says_when_the_set_up_is_another(tmp_path: Path) -> None:
    setup, out = tmp_path / "shop.toml", tmp_path / "p.ngc"
    setup.write_text(Path(TOOLS).read_text())
    part = [GOLDEN / "short_five_axis.apt", "-m", "mikron-ucp710", "-c", "linuxcnc"]
    assert run("convert", *part, "--setup", setup, "-o", out).exit_code == 0
    setup.write_text("# a remark\n" + Path(TOOLS).read_text())
    assert "verify.setup" not in run("verify", out, *part, "--setup", setup).output
    setup.write_text(Path(TOOLS).read_text() + "\n[joints]\nsingular_distance = 0.06\n")
    got = run("verify", out, *part, "--setup", setup)
    assert got.exit_code == 0 and "warning [verify.setup] the header of the program names the set-up shop.toml" in got.stderr
    setup.write_text(Path(TOOLS).read_text() + "\n[part]\norigin = [0, 0, 5]\n")
    got = run("verify", out, *part, "--setup", setup)
    assert got.exit_code == 1 and "error [verify.setup]" in got.stderr.splitlines()[0]
    got = run("verify", out, *part)
    assert "[verify.setup]" in got.stderr and "none is given" in got.stderr
    (tmp_path / "as_it_was.toml").write_text(Path(TOOLS).read_text())  # the hint
    assert "verify.setup" not in run("verify", out, *part, "--setup", tmp_path / "as_it_was.toml").output
    bare = tmp_path / "bare.ngc"
    mill = [SAMPLES / "pocket.cls", "-m", "mill-3axis", "-c", "linuxcnc"]
    if run("convert", *mill, "-o", bare).exit_code == 0:
        got = run("verify", bare, *mill, "--setup", tmp_path / "as_it_was.toml")
        assert "names no set-up" in got.stderr and "verify without --setup" in got.stderr
        assert "verify.setup" not in run("verify", bare, *mill).output


def test_fingerprints_follow_meshes_not_names(tmp_path: Path) -> None:
    mesh = "solid s\nendsolid s\n"
    marks = []
    for folder, name, text in (("a", "part.stl", mesh), ("b", "other.stl", mesh),
                               ("c", "part.stl", mesh + "\n")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / name).write_text(text)
        file = tmp_path / folder / "s.toml"
        file.write_text(f'description = "{folder}"\n[bodies]\npart = "{name}"\n')
        setup, found = load_setup(file)
        assert setup is not None, found
        marks.append(fingerprint(setup, str(file)))
    assert marks[0] == marks[1] != marks[2] and all(re.fullmatch("[0-9a-f]{8}", mark) for mark in marks)


def test_a_killed_run_is_reported_by_verify_and_put_right_by_convert(shop: Path,
                                                                     monkeypatch: pytest.MonkeyPatch) -> None:
    assert convert(shop).exit_code == 0
    out = shop / "out"
    run_of_dead = f"postproc-{interrupted_runs._where()}-999999999-1-00000000"
    old = interrupted_runs.temporary(out / "O1001", run_of_dead, interrupted_runs.OLD)
    (out / "O1001").rename(old)
    (out / "O1001").write_text("new text of a run that was killed")
    entry = interrupted_runs.Entry("O1001", "gone", old.name, interrupted_runs.mark_of(out / "O1001"))
    interrupted_runs.temporary(out / "main.nc", run_of_dead,
                               interrupted_runs.JOURNAL).write_text(interrupted_runs.journal_text([entry]))
    verify = ["verify", out / "main.nc", shop / "part.cls", *MIKRON, "--setup", shop / "shop.toml"]
    got = run(*verify)
    assert got.exit_code == 1 and "warning [file.unfinished]" in got.stderr
    got = convert(shop)  # the hint
    assert got.exit_code == 0 and "info [file.recovered]" in got.stderr and "replaced 1 of 1 files" in got.stderr
    assert sorted(texts(out)) == ["O1001", "O1002", "O1003", "main.nc"]
    got = run(*verify)
    assert got.exit_code == 0 and "file.unfinished" not in got.stderr


def test_values_of_arrays_are_json_of_their_own_kind(capsys: pytest.CaptureFixture[str]) -> None:
    """A truth is no word "True", a number no text; a path is one."""
    print_json({"above": np.True_, "count": np.int64(3), "file": Path("a.nc")})
    assert json.loads(capsys.readouterr().out) == {"above": True, "count": 3, "file": "a.nc"}
