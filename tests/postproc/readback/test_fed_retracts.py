"""Linking moves that are written as feed, as rapids of slides with several speeds would leave their line: no cut owns them.

Only what comes down to a cut that no RAPID leads to is made at the feed of that cut, with its tool and in its states.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import postproc
import toolpaths
from postproc.pipeline.result import PostResult
from postproc.readback.comparison.approaches import leads_down
from postproc.readback.comparison.compare import Comparison, compare
from postproc.readback.execution.execute import Motion
from postproc.reference.holes import Phase
from postproc.verification.second_witness import second_witness
from tests.postproc.kit import machine, setup_of
from toolpaths.arrays import Bools
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Kind

SETUP = setup_of("[tools.1]\ngauge_length = 120.0\n[tools.2]\ngauge_length = 120.0\n"
                 "[tools.3]\ngauge_length = 120.0\n[output]\nrapids_as_feed = true\n")
BEFORE = """TOOL PATH/OP1,TOOL,EM10
MSYS/0,0,0,1,0,0,0,1,0
LOAD/TOOL,1
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,0,50,0,0,1
RAPID
GOTO/-10,0,50,0.2588190451,0,0.9659258263
FEDRAT/MMPM,250
GOTO/-10,0,5
"""
BEHIND = "GOTO/0,10,5\nGOTO/10,10,5\nEND-OF-PATH\nFINI\n"
BORED = "CYCLE/BORE,RAPTO,3,FEDTO,-13,RTRCTO,10,MMPM,120\nGOTO/-10,-20,5\nCYCLE/OFF\n"
CHANGE = "LOAD/TOOL,2\nSPINDL/RPM,1500,CCLW\nCOOLNT/ON\n"
HOME = "SPINDL/RPM,1500,CCLW\nGOHOME\nCOOLNT/MIST\n"
STOPPED = "STOP\nLOAD/TOOL,2\nSPINDL/RPM,1500,CLW\n"
CASES = [("fork-head-ab", "fanuc-30i", "", CHANGE), ("fork-head-ab", "haas-ngc", BORED, CHANGE),
         ("fork-head-ab", "haas-ngc", "", HOME), ("fork-head-ab", "fanuc-30i", BORED, STOPPED),
         ("fork-head-ab", "fanuc-30i", "", CHANGE + "RAPID\n"), ("fork-head-ab", "linuxcnc", BORED, HOME),
         ("nutating-head", "siemens-840d", BORED, CHANGE), ("nutating-head", "heidenhain-tnc640", "", STOPPED),
         ("head-table", "generic-iso", "", CHANGE)]
FED = ("fork-head-ab", "haas-ngc", "", CHANGE)
"""has a retract and a path down to the cut at feed"""


def converted(name: str, control: str, between: str, change: str) -> PostResult:
    path, found = toolpaths.read_bytes(BEFORE + between + change + BEHIND, file="part.cls")
    return postproc.convert(path, machine(name), control, SETUP, diagnostics=found)


@pytest.fixture(scope="module")
def fed() -> PostResult:
    return converted(*FED)


def parts(result: PostResult) -> tuple[Motion, Comparison, Bools, Bools]:
    """(motion, comparison, (E,) fed blocks of linking moves that lead to a cut, (E,) those of them that come down to it)."""
    assert result.comparison is not None and result.comparison.executed is not None and result.job is not None
    compared, moves = result.comparison, result.job.moves.without_pecks()
    motion = result.comparison.executed[1]
    move = np.minimum(compared.owner, len(moves) - 1)
    led = (compared.owner < len(moves)) & moves.link[move] & (moves.kind[move] != Kind.RAPID) & (motion.code > 0)
    return motion, compared, led, leads_down(motion, moves, compared.owner, compared.tip)


def again(result: PostResult, motion: Motion) -> Comparison:
    """The comparison of a motion that was changed."""
    assert result.job is not None and result.comparison is not None
    with np.errstate(all="ignore"):
        return compare(result.comparison.executed[0], motion, result.job, result.comparison.poses)


@pytest.mark.covering
@pytest.mark.parametrize(("name", "control", "between", "change"), CASES)
def test_what_is_fed_on_the_way_to_a_tool_change_has_the_states_of_before(name: str, control: str, between: str,
                                                                          change: str) -> None:
    result = converted(name, control, between, change)
    assert result.ok, [str(d) for d in result.diagnostics]


def test_the_retract_is_fed_and_the_way_down_is_that_of_the_cut(fed: PostResult) -> None:
    motion, compared, led, down = parts(fed)
    rises = np.diff(compared.tip[:, 2], prepend=0.0) > 0.0
    assert (led & rises).any() and (down & ~rises).any() and not (down & rises).any()
    assert (motion.tool[led & ~down] == 1).all() and (motion.tool[down] == 2).all()


@pytest.mark.parametrize("state", ["tool", "spindle", "rpm", "coolant", "register", "offset"])
def test_the_way_down_to_a_cut_has_the_states_of_that_cut(fed: PostResult, state: str) -> None:
    """Both are fed, only the approach is compared: a wrong state there is an error, on the retract it is that of before."""
    motion, _, led, down = parts(fed)
    values = getattr(motion, state)
    for rows, expected in ((down, {"verify.state"}), (led & ~down, set[str]())):
        spoilt = np.array(np.broadcast_to(values, (len(motion),)))
        spoilt[rows] = spoilt[rows] == 0 if state == "coolant" else spoilt[rows] + 1
        found = {d.code for d in again(fed, replace(motion, **{state: spoilt})).diagnostics}
        assert found == expected, rows


@pytest.mark.parametrize(("factor", "code"), [(1.1, "verify.feed"), (0.9, "verify.slow")])
def test_the_fed_retract_is_as_fast_as_its_slowest_axis(fed: PostResult, factor: float, code: str) -> None:
    motion, _, led, down = parts(fed)
    feed = np.where(led & ~down, factor, 1.0) * motion.feed
    assert {d.code for d in again(fed, replace(motion, feed=feed)).diagnostics} == {code}


def test_compensation_that_is_left_on_is_seen_on_a_fed_retract(fed: PostResult) -> None:
    motion, _, led, down = parts(fed)
    side = np.where(led & ~down, 41, np.broadcast_to(motion.compensation, (len(motion),))).astype(np.int8)
    found = again(fed, replace(motion, compensation=side)).diagnostics
    assert any("cutter compensation is" in d.message and d.code == "verify.state" for d in found)


def test_the_second_witness_counts_no_fed_retract_with_a_cut(fed: PostResult) -> None:
    """A spindle that stands in the first block of the cut is found; on the retract before the tool change it is free."""
    motion, compared, led, down = parts(fed)
    assert fed.job is not None and fed.asked is not None and compared.executed is not None
    for rows, expected in ((led & ~down, set[str]()), (np.roll(down, 1), {"witness.spindle"})):
        spoilt = replace(motion, spindle=np.where(rows, 0, motion.spindle))
        seen = replace(compared, executed=(compared.executed[0], spoilt))
        found = second_witness(fed.source, fed.asked, fed.options, fed.job, seen)[1]
        assert {d.code for d in found} == expected


def test_a_rapid_down_to_a_hole_that_leaves_its_line_is_no_move_from_hole_to_hole() -> None:
    """The stop on the way down at the level of the retract is on the line of the hole: a dog-leg there is beside it."""
    holes = "CYCLE/DRILL,RAPTO,2,FEDTO,-3,RTRCTO,8,MMPM,250\nGOTO/-10,-20,-15\nGOTO/-10,10,-15\nCYCLE/OFF\n"
    result = converted("fork-head-ab", "haas-ngc", holes, "FEDRAT/MMPM,250\n")
    assert result.ok and result.job is not None
    motion, compared, *_ = parts(result)
    moves = result.job.moves.without_pecks()
    move = np.minimum(compared.owner, len(moves) - 1)
    fed = (compared.owner < len(moves)) & (moves.phase[move] == Phase.POSITION) & (motion.code == 1)
    level = np.einsum("ni,ni->n", moves.curves(move).end - moves.curves(move).start, moves.axis[move])
    down = np.flatnonzero(fed & (moves.hole[move] >= 0) & (level < -1.0))
    assert len(down)
    bad = again(result, replace(motion, code=np.where(np.arange(len(motion)) == down[0], 0, motion.code)))
    assert "verify.tip" in {d.code for d in bad.diagnostics if d.severity is Severity.ERROR}
