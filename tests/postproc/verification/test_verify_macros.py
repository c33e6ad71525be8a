"""Programs with variables, loops and subprograms: timed, proved against their CL file, refused where a figure is changed."""

from __future__ import annotations

import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import postproc
import toolpaths
from machines.machine import ClampCodes
from postproc.base.options import Options
from postproc.controllers.model import load_controller
from postproc.cycle_time.source import from_gcode
from postproc.pipeline.result import VerifyResult
from postproc.verification.neighbour_files import NeighbourFiles
from tests.postproc.kit import SAMPLES, codes, good, machine, tool_setup
from toolpaths.toolpath import Toolpath

MACROS = SAMPLES / "macros"
PROGRAMS = {"fanuc-30i": "fanuc.nc", "haas-ngc": "haas.nc", "siemens-840d": "siemens.mpf", "heidenhain-tnc640": "klartext.h",
            "linuxcnc": "linuxcnc.ngc", "generic-iso": "linuxcnc.ngc"}
CHANGES = {"fanuc-30i": ("#102=20.", "#102=20.1"), "haas-ngc": ("#104= #5041 + 76.", "#104= #5041 + 75.9"),
           "siemens-840d": ("SLOT(-8, NR*PITCH, 1, 76)", "SLOT(-8, NR*PITCH, 1.1, 76)"),
           "heidenhain-tnc640": ("Q1 = 3 ;", "Q1 = 2 ;"), "linuxcnc": ("#<slots> = 3", "#<slots> = 4"),
           "generic-iso": ("F[300 * 2]", "F[300 * 3]")}
REFUSED = {"fanuc-30i": "verify.tip", "haas-ngc": "verify.tip", "siemens-840d": "verify.tip",
           "heidenhain-tnc640": "verify.not_reached", "linuxcnc": "verify.link", "generic-iso": "verify.feed"}
"""what is said of each change"""


@cache
def plate() -> Toolpath:
    return toolpaths.read(MACROS / "plate.apt")[0]


def verified(control: str, program: Path) -> VerifyResult:
    return postproc.verify(program, plate(), machine("mill-3axis"), controller=control, setup=tool_setup())


@pytest.mark.parametrize("control", PROGRAMS)
def test_samples_are_timed_and_proved(control: str) -> None:
    program = MACROS / PROGRAMS[control]
    spec, _ = load_controller(control)
    assert spec is not None
    blocks, found = from_gcode(program.read_bytes(), machine("mill-3axis"), spec, tool_setup(), str(program),
                               NeighbourFiles(program))
    assert blocks is not None and found == []
    result = verified(control, program)
    assert result.ok, [str(d) for d in result.diagnostics]
    assert result.comparison is not None and result.comparison.unbounded == 0
    assert result.witness is not None and result.witness.points == 19 and result.witness.not_compared == ()


@pytest.mark.parametrize("control", PROGRAMS)
def test_a_changed_figure_is_refused(control: str, tmp_path: Path) -> None:
    shutil.copytree(MACROS, tmp_path, dirs_exist_ok=True)
    program = tmp_path / PROGRAMS[control]
    text = program.read_text()
    assert CHANGES[control][0] in text
    program.write_text(text.replace(*CHANGES[control]))
    result = verified(control, program)
    assert not result.ok and REFUSED[control] in codes(result.diagnostics), codes(result.diagnostics)


def test_what_is_read_of_the_text_alone_is_not_claimed_of_variables(tmp_path: Path) -> None:
    """The second witness reads clamps in the text itself: of a program that computes its words it says that it has not."""
    trunnion = machine("mikron-ucp710")
    trunnion = replace(trunnion, clamps=tuple({"A": ClampCodes("M10", "M11"), "C": ClampCodes("M12", "M15")}.get(
        a, ClampCodes()) for a in trunnion.axis_names))
    made = good(postproc.convert(plate(), trunnion, controller="fanuc-30i", setup=tool_setup()))
    assert "F600." in made.text
    said = []
    for text in (made.text, made.text.replace("F600.", "F[300.*2]", 1)):
        (tmp_path / "p.nc").write_text(text)
        result = postproc.verify(tmp_path / "p.nc", plate(), trunnion, controller="fanuc-30i", setup=tool_setup())
        assert result.ok and result.witness is not None, [str(d) for d in result.diagnostics]
        said.append(([one.what for one in result.witness.compared], [str(one) for one in result.witness.not_compared]))
    strict = postproc.verify(tmp_path / "p.nc", plate(), trunnion, controller="fanuc-30i", setup=tool_setup(),
                             options=Options(require_proof=True))
    assert not strict.ok and "verify.not_compared" in codes(strict.diagnostics)
    (plain, nothing), (computed, left) = said
    assert nothing == [] and len(left) == 1 and "clamps" in left[0]
    assert [one for one in plain if one not in computed] == ["clamps"]
