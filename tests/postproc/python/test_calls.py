"""The calls of the package: docs/python.md as it stands, values of the calls against those of the stages, faults raised."""

from __future__ import annotations

import doctest
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import postproc
from postproc.setup.model import SetupFile
from tests.postproc.orientation.part_choice import PART
from tests.postproc.placement.test_placement import passes, setup_of
from tests.source import ROOT
from toolpaths import read
from toolpaths.diagnostics import DiagnosticError, error

SAMPLES = ROOT / "samples"


def test_every_example_of_the_page_gives_what_it_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(SAMPLES)
    done = doctest.testfile(str(ROOT / "docs" / "python.md"), module_relative=False)
    assert done.attempted > 20 and done.failed == 0


def test_all_names_are_there() -> None:
    assert all(getattr(postproc, name) is not None for name in postproc.__all__)
    with pytest.raises(AttributeError, match="no attribute 'covert'"):
        _ = postproc.covert


def test_time_of_a_program_is_that_of_its_conversion(tmp_path: Path) -> None:
    path = passes((1.0, 0.0), 1)
    setup = setup_of((0.0, 0.0, 50.0))
    program = tmp_path / "a program.ngc"
    program.write_text(postproc.convert(path, "mill-3axis", setup=setup).checked().text)
    from_file = postproc.time(program, "mill-3axis", setup=setup)
    assert from_file.seconds == pytest.approx(postproc.time(path, "mill-3axis", setup=setup).seconds, rel=1e-3)
    assert postproc.verify(program, path, "mill-3axis", setup=setup).checked().ok


def test_what_a_call_cannot_do_it_raises_with_all_diagnostics(tmp_path: Path) -> None:
    path = passes((1.0, 0.0), 1)
    wrong = tmp_path / "shop.toml"
    wrong.write_text("speed = 3\n")
    with pytest.raises(DiagnosticError) as found:
        postproc.time(path, "mill-3axis", setup=wrong)
    assert found.value.diagnostics[0].code == "file.unknown-key" and found.value.diagnostics[0].lines == (1,)
    with pytest.raises(DiagnosticError):
        postproc.place(path, "mill-3axis", SetupFile())
    with pytest.raises(DiagnosticError):
        postproc.calibrate(tmp_path / "none.toml")
    with pytest.raises(ValueError, match="above 0"):
        postproc.time(path, "mill-3axis", override=np.nan)
    far = passes((1.0, 0.0), 1, 9000.0)
    with pytest.raises(DiagnosticError, match="travel"):
        postproc.time(far, "mill-3axis", setup=setup_of())
    with pytest.raises(DiagnosticError, match="travel"):
        postproc.convert(far, "mill-3axis", setup=setup_of()).checked()
    with pytest.raises(DiagnosticError):
        postproc.orient(far, "mill-3axis")


def test_a_path_that_was_not_read_whole_is_placed_by_nobody() -> None:
    from dataclasses import replace

    path = replace(passes((1.0, 0.0), 1), faults=(error("cl.word", "a fault of the file"),))
    with pytest.raises(DiagnosticError, match="a fault of the file"):
        postproc.place(path, "mill-3axis", setup_of(x=(-10.0, 10.0)))


@pytest.mark.slow
def test_place_gives_what_its_command_writes() -> None:
    choice = postproc.place(passes((1.0, 0.0), 1), "mill-3axis", setup_of((0.0, 0.0, 50.0), x=(-10.0, 10.0)))
    assert -10.0 <= choice.part.origin[0] <= 10.0 and choice.looked > 0


def test_calibrate_gives_what_its_command_writes() -> None:
    outcome = postproc.calibrate(SAMPLES / "calibration" / "reversal.toml")
    assert outcome.model is not None and all(one["sigma"] > 0.0 for one in outcome.figures["parameters"].values())


@pytest.mark.slow
def test_orient_gives_the_plans_of_its_command() -> None:
    choice = postproc.orient(read(PART)[0], "mikron-ucp710", options=postproc.Options(setup="", orient="auto"))
    assert choice.plans["auto"].seconds <= choice.plans["keep"].seconds


def test_convert_imports_nothing_of_scipy_numba_and_searches() -> None:
    """In a process of its own: what this one has imported says nothing."""
    code = ("import sys, numpy, postproc; from postproc import Toolpath\n"
            "p = Toolpath.from_arrays([[0, 0, 50], [0, 0, 10], [5, 0, 10]], feed=[numpy.nan, 5, 5], spindle=9)\n"
            "r = postproc.convert(p, 'mikron-ucp710', setup='tools.setup.toml').checked()\n"
            "from postproc.cycle_time.conversion import estimate_of; estimate_of(r)\n"
            "heavy = ('scipy', 'numba', 'matplotlib', 'trimesh', 'postproc.placement.region')\n"
            "print(*[m for m in heavy if m in sys.modules])")
    done = subprocess.run([sys.executable, "-c", code], cwd=SAMPLES, capture_output=True, text=True, check=True, timeout=60,
                          env={"PYTHONPATH": str(ROOT), "PATH": ""})
    assert done.stdout.strip() == ""
