"""Rests, stops, registers of CUTCOM, limits: what the second witness says of right and of wrong programs."""

from __future__ import annotations

from dataclasses import replace

import pytest

import machines
import postproc
import toolpaths
from postproc.pipeline.result import PostResult
from postproc.readback.comparison.compare import Comparison
from postproc.setup.model import SetupFile
from postproc.verification.second_witness import second_witness

HEAD = "UNITS/MM\nLOADTL/1\nSPINDL/RPM,3000,CLW\nCOOLNT/ON\nRAPID\nGOTO/0,0,40\n"
CUTS = "FEDRAT/400,MMPM\nGOTO/0,0,0\n{}GOTO/20,0,0\n{}GOTO/20,0,0\nGOTO/20,20,0\n{}RAPID\nGOTO/20,20,40\n{}"
HOLE = "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3,DWELL,0.5\nGOTO/5,5,0\nCYCLE/OFF\n{}RAPID\nGOTO/5,5,40\n"
CONTROLS = ("linuxcnc", "fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc", "generic-iso")


def converted(text: str, control: str = "linuxcnc") -> PostResult:
    path, found = toolpaths.read_bytes(text, file="part.cls")
    setup = SetupFile.model_validate({"tools": {"1": {"gauge_length": 80.0}}, "part": {"origin": (5.0, 6.0, 7.0)}})
    return postproc.convert(path, machines.load("mill-3axis"), control, setup, diagnostics=list(found))


def said(result: PostResult, comparison: Comparison) -> set[str]:
    assert result.job is not None
    return {d.code for d in second_witness(result.source, result.asked or result.setup, result.options, result.job,
                                           comparison)[1]}


@pytest.mark.covering
@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("text", [
    HEAD + CUTS.format("DELAY/1.5\n", "DELAY/2\n", "DELAY/1\nSTOP\n", "STOP\n") + "FINI\n",
    HEAD + "DELAY/1\nSTOP\nOPSTOP\n" + CUTS.format("", "STOP\nDELAY/10,REV\nSTOP\n", "", "DELAY/0.25\n") + "FINI\n",
    HEAD + "DELAY/1\n" + HOLE.format("DELAY/1\nSTOP\n") + HOLE.format("") + CUTS.format("", "", "", "") + "FINI\n",
    HEAD + "STOP\n" + HOLE.format("STOP\n").replace("CYCLE/OFF", "GOTO/8,5,0\nCYCLE/OFF") + "DELAY/2\nFINI\n"])
def test_rests_and_stops_are_found_where_the_file_has_them(text: str, control: str) -> None:
    result = converted(text, control)
    assert result.ok, [str(d) for d in result.diagnostics]
    assert result.witness is not None
    count = sum(text.count(word) for word in ("DELAY", "OPSTOP", "\nSTOP"))
    assert 0 < {c.what: c.count for c in result.witness.compared}["rests and stops"] <= count


def test_a_rest_at_another_place_and_a_stop_left_out_are_found() -> None:
    result = converted(HEAD + CUTS.format("DELAY/1.5\n", "", "STOP\n", "") + "FINI\n")
    assert result.comparison is not None and result.comparison.executed is not None
    code, motion = result.comparison.executed
    dwell = motion.dwell.copy()
    at = int(dwell.argmax())
    dwell[[at, at + 1]] = dwell[[at + 1, at]]
    moved = replace(result.comparison, executed=(code, replace(motion, dwell=dwell)))
    assert said(result, result.comparison) == set()
    assert said(result, moved) == {"witness.rest"}
    late = replace(result.comparison, executed=(code, replace(motion, block=motion.block + 3)))
    assert said(result, late) == {"witness.rest"}


def test_limits_that_are_not_those_of_the_machine_file_are_found() -> None:
    result = converted(HEAD + CUTS.format("", "", "", "") + "FINI\n")
    assert result.job is not None and result.comparison is not None
    limits = result.job.machine.limits
    for name in ("upper", "velocity", "acceleration", "jerk"):
        other = replace(limits, **{name: getattr(limits, name) * 1.01})
        job = replace(result.job, machine=replace(result.job.machine, limits=other, stated=other))
        assert said(replace(result, job=job), result.comparison) == {"witness.limits"}, name


def test_a_register_that_cutcom_names_is_compared() -> None:
    result = converted(HEAD + CUTS.format("CUTCOM/LEFT,7\n", "", "CUTCOM/OFF\nGOTO/20,30,0\n", "") + "FINI\n", "fanuc-30i")
    assert result.ok and result.comparison is not None and result.comparison.executed is not None
    code, motion = result.comparison.executed
    assert said(result, result.comparison) == set()
    other = replace(result.comparison, executed=(code, replace(motion, radius=motion.radius + 1.0)))
    assert said(result, other) == {"witness.compensation"}
