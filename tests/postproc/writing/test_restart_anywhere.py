"""A program taken up at any of its operations, from wherever the tool stands and in whatever modes: the same cuts."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import toolpaths
from postproc.pipeline.result import PostResult
from postproc.readback.dialects.readers import reader_for
from postproc.readback.execution.execute import Motion, run
from postproc.readback.execution.offsets import Offsets
from tests.postproc.kit import convert, good, tool_setup
from tests.postproc.writing.test_golden_programs import GOLDEN
from toolpaths.diagnostics import has_errors

PAIRS = [("linuxcnc", "mikron-ucp710"), ("generic-iso", "head-table"), ("fanuc-30i", "mikron-ucp710"),
         ("fanuc-30i", "head-table"), ("haas-ngc", "trunnion-bc"), ("siemens-840d", "mikron-ucp710"),
         ("siemens-840d", "head-table"), ("heidenhain-tnc640", "mikron-ucp710"), ("heidenhain-tnc640", "head-table")]
LABELS = {"linuxcnc": "G21 G90", "generic-iso": "G21 G90", "fanuc-30i": "N", "haas-ngc": "N", "siemens-840d": "; ",
          "heidenhain-tnc640": "* - "}
"""how the first block of an operation begins, behind its number"""
FOREIGN = {"linuxcnc": "G91 G20 G93 G18 G42 D1", "generic-iso": "G91 G20 G93 G18 G42 D1",
           "fanuc-30i": "G91 G20 G93 G18 G42 D1 G55", "haas-ngc": "G91 G20 G93 G18 G42 D1 G55",
           "siemens-840d": "G91 G700 G93 G18 G42 G55", "heidenhain-tnc640": "L RR F100"}
"""modes that another program may have left"""

FLAT = "UNITS/MM\n" + "".join(
    f"TOOL PATH/OP{k},TOOL,T\nTLDATA/MILL,10,0,80,0,0\nMSYS/0,0,0,1,0,0,0,1,0\nLOAD/TOOL,1\nSPINDL/RPM,1000,CLW\nRAPID\n"
    f"GOTO/{10 * k},0,40,0,0,1\nFEDRAT/MMPM,300\nGOTO/{10 * k},0,-1\nGOTO/{10 * k},9,-1\nRAPID\nGOTO/{10 * k},9,40\n"
    f"END-OF-PATH\n" for k in range(2)) + "FINI\n"


@cache
def restartable(controller: str, machine: str, name: str = "") -> PostResult:
    path, _ = toolpaths.read(GOLDEN / "three_laws.cls") if not name else toolpaths.read_bytes(FLAT.encode(), file=name)
    usual = tool_setup()
    return good(convert(path, machine, controller,
                        usual.model_copy(update={"output": usual.output.model_copy(update={"restart": True})})))


def labels(result: PostResult, controller: str) -> list[int]:
    """Lines (from 0) of the blocks that the second and later operations begin with."""
    lines = [n.lstrip("0123456789 ") if controller.startswith("heid") else n.split(" ", 1)[-1]
             if controller.startswith("siem") and n.startswith("N") else n for n in result.text.split("\n")]
    names = ("; TOP", "; FACE", "; SWEEP") if controller.startswith("siem") else (LABELS[controller],)
    found = [k for k, n in enumerate(lines) if n.startswith(names)]
    assert len(found) == 3
    return found[1:]


def executed(result: PostResult, text: str, start: np.ndarray) -> Motion:
    """What the control makes of a text when the axes stand at `start` (machine coordinates, mm and degrees)."""
    job = result.job
    assert job is not None
    control = job.control
    home = control.words(job.machine.home[None, :], job.machine.kinematics, 0.0)[0] + control.work_offset
    reader = reader_for(job.controller, job.machine.axis_names, home)
    code, found = reader.read(text.encode(), "MAIN")
    assert code is not None and not has_errors(found), [str(d) for d in found]
    motion, found = run(code, job.machine.axis_names,
                        Offsets(control.work_offset, control.xyz, job.register_lengths(), start, control.length_on_z,
                                job.controller.cycles.peck_relief, control, reader.rises_first, reader.arc_slack,
                                home_in_planes=reader.home_in_planes), "MAIN")
    assert not has_errors(found), [str(d) for d in found]
    return motion


def cuts(motion: Motion, first: int) -> list[tuple[object, ...]]:
    """Each block from the first cut behind row `first` on: where it ends, and the state that it is run in."""
    begin = first + int(np.flatnonzero(motion.code[first:] > 0)[0])
    state = (motion.code, motion.feed, motion.inverse, motion.unit, motion.plane, motion.ccw, motion.tool, motion.register,
             motion.spindle, motion.rpm, motion.flood, motion.compensation, motion.offset, motion.blend, motion.dwell)
    return [(*motion.end[k].round(9), *(str(a[k]) for a in state), motion.frames[motion.frame[k]].law)
            for k in range(begin, len(motion))]


def taken_up(result: PostResult, text: str, at: int, start: np.ndarray, whole: Motion, label: int) -> int:
    """From block `at` of a text on: the tool rises to home alone, nothing cuts before it has come back down;
    how many blocks behind that are as in the whole program."""
    motion = executed(result, text, start)
    first = int(np.searchsorted(motion.line, at + 1))
    z = result.machine.axis_names.index("Z")
    before = motion.end[first - 1] if first else start
    assert motion.code[first] == 0 and np.flatnonzero(motion.end[first] != before).tolist() in ([z], [])
    home = result.machine.home[z]
    assert motion.end[first, z] == home
    down = first + int(np.flatnonzero(motion.end[first:, z] != home)[0])
    assert (motion.code[first:down + 1] == 0).all()
    same = cuts(motion, first)
    assert same == cuts(whole, int(np.searchsorted(whole.line, label + 1)))
    return len(same)


@pytest.mark.covering
@pytest.mark.parametrize(("controller", "machine"), PAIRS)
def test_after_a_stop_anywhere_in_the_operation_before(controller: str, machine: str) -> None:
    """The program is broken off at a block and goes on at a label, in the modes and at the place that it left."""
    result = restartable(controller, machine)
    lines = result.text.split("\n")
    home = result.machine.home * result.job.control.unit
    whole = executed(result, result.text, home)
    begins = [next(k for k, n in enumerate(lines) if "M6" in n or "TOOL CALL" in n), *labels(result, controller)]
    rng = np.random.default_rng(5)
    for before, label in pairwise(begins):
        possible = [k for k in range(before + 10, label) if not lines[k - 1].endswith("~")
                        and not any(word in lines[k - 1] for word in ("G68.2", "DEF 32.0", "DEF 9.0"))]  # one with the next
        for stop in rng.choice(possible, 5).tolist():
            broken = [*lines[:stop], *lines[label:]]
            assert taken_up(result, "\n".join(broken), stop, home, whole, label) > 0


@pytest.mark.covering
@pytest.mark.parametrize(("controller", "machine"), PAIRS)
def test_from_an_arbitrary_pose_in_modes_of_another_program(controller: str, machine: str) -> None:
    result = restartable(controller, machine)
    lines, limits = result.text.split("\n"), result.machine.limits
    whole = executed(result, result.text, result.machine.home * result.job.control.unit)
    rng = np.random.default_rng(6)
    head = {"heidenhain-tnc640": ["0 BEGIN PGM MAIN MM"], "siemens-840d": []}.get(controller, ["%"])
    tail = ["END PGM MAIN MM"] if controller.startswith("heid") else []
    for label in labels(result, controller):
        start = rng.uniform(np.maximum(limits.lower, -700.0), np.minimum(limits.upper, 700.0))
        body = [n for n in lines[label:] if "END PGM" not in n]
        foreign = FOREIGN[controller].replace(" RR", "")  # on a TNC radius compensation ends with its program
        text = "\n".join([*head, foreign, *body, *tail])
        assert taken_up(result, text, len(head) + 1, start * result.job.control.unit, whole, label) > 0


@pytest.mark.parametrize("controller", ["generic-iso", "fanuc-30i"])
def test_a_machine_on_rods_goes_home_with_all_axes(controller: str) -> None:
    """No axis lifts the tool by itself: the first block behind the label states them all, in machine coordinates."""
    result = restartable(controller, "uranesx", "flat.cls")
    lines = result.text.split("\n")
    label = [k for k, n in enumerate(lines) if n.startswith(LABELS[controller])][-1]
    motion = executed(result, "\n".join(["%", FOREIGN[controller], *lines[label:]]),
                      result.machine.home - [9.0, 5.0, 2.0])
    whole = executed(result, result.text, result.machine.home)
    first = int(np.searchsorted(motion.line, 3))
    assert motion.code[first] == 0 and motion.end[first].tolist() == result.machine.home.tolist()
    assert cuts(motion, first) == cuts(whole, int(np.searchsorted(whole.line, label + 1)))
