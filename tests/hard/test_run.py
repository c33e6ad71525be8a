"""`make hard` on one small file: outcomes by kind, and a planted fault is a failure of its own kind."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

import machines
from postproc.base.options import Options
from postproc.pipeline.result import PostResult
from postproc.setup.model import load_setup
from tests.hard import run
from tests.hard.run import INTERNAL, NO_HINT, PROVED, REFUSED, REFUSES_MORE, Task, failures, files_of, table, worked
from tests.postproc.kit import SAMPLES
from toolpaths.diagnostics import error

NX = SAMPLES / "dialects" / "inch_nx.cls"


def kinds(found: Counter[tuple[str, str, str]]) -> Counter[str]:
    return Counter({kind: sum(n for (k, _, _), n in found.items() if k == kind) for kind, _, _ in found})


def test_outcomes(tmp_path: Path) -> None:
    found = worked(Task(NX, "mill-3axis", ("generic-iso", "heidenhain-tnc640"), 0))
    assert kinds(found) == {PROVED: 2} and failures(found) == 0
    spoilt = tmp_path / "zero.cls"
    spoilt.write_text(NX.read_text().replace("FEDTO,-0.47244", "FEDTO,0.0000"))
    found = worked(Task(spoilt, "mill-3axis", ("siemens-840d", "heidenhain-tnc640"), 0))
    assert kinds(found) == {REFUSED: 2} and failures(found) == 0
    assert "cl.cycle-depth" in table(found)
    assert run.by_machine(found).split() == ["mill-3axis", "0", "written", "2", "refused:", "shows", "nothing"]


def test_faults_are_failures(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("postproc.pipeline.stages.prepare", fail)
    found = worked(Task(NX, "mill-3axis", ("generic-iso",), 0))
    assert kinds(found) == {INTERNAL: 1} and failures(found) == 1 and "ZeroDivisionError" in table(found)


def test_auto_that_refuses_what_another_mode_converts_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    task = Task(NX, "mill-3axis", ("generic-iso",), 0, law=True)
    assert kinds(worked(task)) == {PROVED: 1}
    asked = run._asked

    def refusing(task: Task, controller: str, options: Options) -> PostResult:
        result: PostResult = asked(task, controller, options)
        bad = error("verify.path", "planted", file="x")
        return result if options.output == "axes" else replace(result, reached="verify", diagnostics=[bad])
    monkeypatch.setattr(run, "_asked", refusing)
    found = worked(task)
    assert kinds(found) == {REFUSED: 1, REFUSES_MORE: 1, NO_HINT: 1} and failures(found) == 2
    assert "verify.path, axes converts" in table(found)


def test_all_samples_and_the_files_of_a_folder_are_taken(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "part").write_text("x")
    files = files_of(tmp_path)
    assert {p.name for p in files} >= {"pocket.cls", "inch_plate.apt", "catia.aptsource", "solidworks.clt", "ncl.as", "part",
                                     "leaning.cls"}


def test_places_are_of_machines_and_stand_before_the_other_set_ups() -> None:
    at = {file.stem: file for file in run.PLACES.glob("*.toml")}
    assert set(at) <= set(machines.names()) and load_setup(str(at["hexapod"]))[0].part.origin == (0.0, 0.0, -150.0)
    assert run._setup_of(Task(SAMPLES / "casting" / "casting.ncl", "hexapod", (), 0)) == at["hexapod"]
