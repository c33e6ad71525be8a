"""The form that a set-up asks of its program: a program of a post that ignores the key is found."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from postproc.base.options import Options
from postproc.pipeline.result import PostResult
from postproc.verification.read_back import read_back
from tests.postproc.control.test_clamps import clamping
from tests.postproc.kit import codes, good, setup_of, toolpath
from tests.postproc.writing.test_golden_programs import GOLDEN
from tests.postproc.writing.test_restart_anywhere import FLAT
from toolpaths.diagnostics import Diagnostic, Severity

TOOLS = "[tools.1]\ngauge_length = 90\n[tools.2]\ngauge_length = 80\n[tools.3]\ngauge_length = 85\n"
PLACES = "".join(f'[[places]]\nname = "{n}"\nwork_offset_code = "G5{4 + k}"\norigin = [{99.0 * k}, 0.0, 0.0]\n'
                 for k, n in enumerate(("left", "right")))
BY_CALLS = ("fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640")
ASKED = [
    *((name, "mill-3axis", "[output]\nrestart = true\n", Severity.ERROR) for name in (*BY_CALLS, "linuxcnc", "generic-iso")),
    *((name, "mill-3axis", "[output]\nsubprograms = true\n", Severity.WARNING) for name in BY_CALLS),
    *((name, "mill-3axis", "[output]\nfiles = true\n", Severity.WARNING) for name in ("fanuc-30i", "siemens-840d")),
    ("fanuc-30i", "mill-3axis", "[output]\nprogram_number = 77\n", Severity.WARNING),
    ("heidenhain-tnc640", "mill-3axis", '[output]\nprogram_name = "LID"\n', Severity.WARNING),
    *((name, "mikron-ucp710", f'[output]\ndefault = "{mode}"\n', Severity.WARNING)
      for name, mode in (("fanuc-30i", "axes"), ("siemens-840d", "tcp"), ("heidenhain-tnc640", "axes"))),
    ("fanuc-30i", "mikron-ucp710", '[output.operations]\nFACE = "axes"\n', Severity.WARNING),
    ("linuxcnc", "mill-3axis", PLACES, Severity.ERROR)]
ON_PLANES = '[clearance]\nbetween = "plane"\n'
"""written so, read with a set-up that has the tool go home between two places"""


@cache
def made(controller: str, machine: str, more: str) -> PostResult:
    path = toolpaths.read_bytes(FLAT.encode(), file="flat.cls")[0] if machine == "mill-3axis" else toolpaths.read(
        GOLDEN / "three_laws.cls")[0]
    return good(postproc.convert(path, machines.load(machine), controller, setup_of(TOOLS + more), Options()))


def found(result: PostResult, text: str) -> list[Diagnostic]:
    assert result.job is not None
    return [d for d in read_back(text.encode(), result.job, "part.cls", gcode="p.nc")[1] if d.severity is not Severity.INFO]


@pytest.mark.parametrize(("controller", "machine", "asked", "severity"), ASKED, ids=lambda v: str(v)[:30])
def test_a_program_that_ignores_a_key_of_its_form_is_found(controller: str, machine: str, asked: str,
                                                           severity: Severity) -> None:
    usual = PLACES + ON_PLANES if asked == PLACES else ""
    result, ignoring = made(controller, machine, asked), made(controller, machine, usual)
    assert "verify.asked" not in codes(result.diagnostics)
    noted = found(result, ignoring.text)
    assert [d.severity for d in noted if d.code == "verify.asked"][:1] == [severity]
    assert {d.code for d in noted} <= {"verify.asked", "verify.safe_plane"}  # operations apart go home


@pytest.mark.parametrize(("controller", "word", "says"), [
    ("fanuc-30i", "G54", "work offset"), ("fanuc-30i", "G21 ", "units"), ("linuxcnc", "G17 ", "G17"),
    ("fanuc-30i", "G05.1 Q1", "smoothing"), ("haas-ngc", "G187 P3 E0.003", "smoothing"),
    ("linuxcnc", "G64 P0.002 Q0.001", "smoothing"),
    ("siemens-840d", "G54", "work offset"), ("heidenhain-tnc640", "Q339", "preset")])
def test_each_state_that_an_operation_does_not_restate_is_named(controller: str, word: str, says: str) -> None:
    """The last of its kind, which stands behind the start of the second operation, left out."""
    result = made(controller, "mill-3axis", "[output]\nrestart = true\n")
    rows = result.text.splitlines()
    at = max(k for k, row in enumerate(rows) if word in row and not row.startswith(("(", ";", "M30")))
    if controller == "heidenhain-tnc640":
        rows[at - 1:at + 1] = []
    else:
        rows[at] = rows[at].replace(word, "")
    noted = [d for d in found(result, "\n".join(rows) + "\n") if d.code == "verify.asked"]
    assert len(noted) == 1 and says in noted[0].message and "OP1" in noted[0].message


@cache
def turning() -> PostResult:
    """Two operations that turn A while they cut, the second from where the first has ended; with codes for clamps."""
    def operation(name: str, start: int, step: int, side: int) -> list[str]:
        axes = [np.array([np.sin(a), 0.0, np.cos(a)]) if side else np.array([0.0, np.sin(a), np.cos(a)])
                for a in np.deg2rad([start, start + step, start + 2 * step])]
        ends = [f"GOTO/{5 * k},0,40," + ",".join(f"{v:.9f}" for v in axis) for k, axis in enumerate(axes)]
        above = [end.replace(",0,40,", ",0,80,") for end in ends]
        load = ["LOAD/TOOL,1"] if side else []
        return [f"TOOL PATH/{name},TOOL,T1", "MSYS/0,0,0,1,0,0,0,1,0", *load, "SPINDL/RPM,1000,CLW", "RAPID", above[0],
                "FEDRAT/MMPM,600", *ends, "RAPID", above[-1], "END-OF-PATH"]

    path = toolpath(*operation("ONE", 10, 10, 1), *operation("TWO", 30, -10, 0), head=["UNITS/MM"])
    setup = setup_of(TOOLS + "[output]\nrestart = true\n")
    return good(postproc.convert(path, clamping(), "fanuc-30i", setup, Options(output="axes")))


@pytest.mark.parametrize(("old", "new", "says"), [
    ("A30. C", "C", "where A stands"), ("M11\n", "", "the clamp of A is open")])
def test_axes_and_clamps_that_an_operation_leaves_as_they_are_are_named(old: str, new: str, says: str) -> None:
    """A stands free at 30 degrees behind the first operation, and nobody knows where if it begins with the second."""
    head, _, second = turning().text.partition("(TWO)")
    assert old in second
    noted = [d for d in found(turning(), f"{head}(TWO){second.replace(old, new, 1)}") if d.severity is Severity.ERROR]
    assert [d.code for d in noted] == ["verify.asked"] and says in noted[0].message and "TWO" in noted[0].message


def test_a_block_left_out_of_the_first_operation_is_no_fault_of_ours() -> None:
    """Where the motion behind it serves no operation that is known, nothing is said of taking it up."""
    result = made("fanuc-30i", "mill-3axis", "[output]\nrestart = true\n")
    head, _, text = result.text.partition("T1 M6\n")
    first = text.partition("(OP1)")[0].splitlines(keepends=True)
    for block in ("T1 M6\n", *first[1:6]):
        left = (head + "T1 M6\n" + text).replace(block, "", 1)
        assert any(d.severity is Severity.ERROR for d in found(result, left)) or block.startswith("G0"), block
