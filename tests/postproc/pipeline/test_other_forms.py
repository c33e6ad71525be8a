"""Files of other forms than APT text, and of SURFCAM, on a machine: proved by both readings; a spoilt one is refused."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from typer.testing import CliRunner

import postproc
import toolpaths
from postproc.cli.app import app
from postproc.pipeline.result import PostResult
from postproc.witness.clfile import commanded
from tests.mutants.plant import Fault, planted
from tests.postproc.kit import machine, setup_of
from toolpaths.cl.read import read_bytes
from toolpaths.diagnostics import has_errors

SAMPLES = Path(__file__).parents[3] / "samples/other_forms"
ON = {"plate.nci": "mikron-ucp710", "plate.nc": "mill-3axis", "tilted.stp": "mikron-ucp710", "surfcam.apt": "mill-3axis"}
SHOP = "[tool_numbers]\nEM10 = 1\nBALL8 = 2\n"


@cache
def converted(name: str, fault: Fault | None = None) -> PostResult:
    def made() -> PostResult:
        path, found = toolpaths.read(SAMPLES / name, units="mm")
        return postproc.convert(path, machine(ON[name]), controller="linuxcnc", diagnostics=found,
                                setup=setup_of(SHOP if name == "tilted.stp" else ""))
    if fault is None:
        return made()
    with planted(fault):
        return made()


@pytest.mark.parametrize("name", sorted(ON))
def test_it_is_proved_and_all_of_it_is_seen_twice(name: str) -> None:
    result = converted(name)
    assert result.ok and result.witness is not None, result.diagnostics
    assert result.witness.own_kinematics and not result.witness.not_compared


FAULTS = (
    ("plate.nci", Fault("NCI arcs the other way round", "reader", "NciReader.arc", "1.0 if code == 3", "1.0 if code == 2")),
    ("plate.nci", Fault("NCI: feed -1 as a rapid", "reader", "NciReader._feed", "feed == _RAPID", "feed < 0.0")),
    ("plate.nci", Fault("NCI holes 1 deeper", "reader", "NciReader._drilled", "length + top - clearance", "length + top - "
                        "clearance + 1.0")),
    ("plate.nc", Fault("FreeCAD: G98 as G99", "reader", "FreeCadReader._g", "code == 98.0", "code == 0.0")),
    ("plate.nc", Fault("FreeCAD: feed of a post per second", "reader", "FreeCadReader._state_feed",
                       "'MMPS' if self.native else 'PERMIN'", "'MMPS'")),
    ("tilted.stp", Fault("STEP-NC: curves never backwards", "reader", "StepNcReader._trajectory", 'path.value(5) == ".F."',
                         "False")),
    ("tilted.stp", Fault("STEP-NC: feeds in mm/s", "reader", "StepNcReader._technology", "* _MM_PER_M", "* 1000.1 * 1.02")),
    ("tilted.stp", Fault("STEP-NC: mist not read", "reader", "StepNcReader._machine", '("MIST", 2)', '("MIST", 1)')),
)


@pytest.mark.parametrize(("name", "fault"), FAULTS, ids=lambda v: getattr(v, "name", ""))
def test_a_reader_that_errs_is_refused(name: str, fault: Fault) -> None:
    result = converted(name, fault)
    assert not result.ok


@pytest.mark.parametrize("name", sorted(ON))
def test_a_changed_byte_is_refused_or_read_alike_by_both(name: str) -> None:
    """Every 29th byte of a file as another: no exception, and no position on which the two readings differ."""
    data = (SAMPLES / name).read_bytes()
    dialect = read_bytes(data).dialect
    assert dialect != "generic"
    for at in range(7, len(data), 29):
        changed = data[:at] + b"7-.(#Z,"[at % 7:at % 7 + 1] + data[at + 1:]
        path, found = toolpaths.read_bytes(changed, units="mm", dialect=dialect)
        if not has_errors(found):
            seen = commanded(changed, "mm", dialect)
            assert seen.tip == pytest.approx(path.tip, abs=1e-6) and seen.axis == pytest.approx(path.axis, abs=1e-9), at


def test_inspect_takes_a_file_that_freecad_exported(tmp_path: Path) -> None:
    said = CliRunner().invoke(app, ["inspect", str(SAMPLES / "plate.nc"), "--json", "-"])
    assert said.exit_code == 0 and '"points": 11' in said.output
    own = tmp_path / "own.nc"
    own.write_text("G0 X0 Y0 Z5\nG1 Z0 F2\n")
    assert "file.program" in CliRunner().invoke(app, ["inspect", str(own)]).stderr
    assert CliRunner().invoke(app, ["inspect", str(own), "--dialect", "freecad"]).exit_code == 0
