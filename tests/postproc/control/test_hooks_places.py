"""Blocks of the shop are looked for where they are asked for, each line once; optional stops between tools."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest

import postproc
from machines.hooks import HooksModel
from postproc.base.options import Options
from postproc.pipeline.result import PostResult
from postproc.readback.comparison.hooks import unmatched
from postproc.reference.events import stops_between
from postproc.setup.model import OutputSettings
from postproc.verification.read_back import read_back
from tests.postproc.control.test_clamps import SETUP, clamping
from tests.postproc.control.test_hooks import converted, own_blocks, verdict, work
from tests.postproc.kit import setup_of, toolpath
from toolpaths.diagnostics import Severity


@cache
def same() -> PostResult:
    """The same block at all places, Fanuc, with T in three digits, and a name that is too long for its line."""
    places = [f"{a}_{b}" for a, b in product(("before", "after"), ("tool", "operation", "stop", "index"))]
    hooks = HooksModel(**dict.fromkeys(places, ("(T{tool_number:03d} {operation})",)))
    return postproc.convert(work(), replace(clamping(), hooks=hooks), "fanuc-30i", SETUP,
                            Options(output="axes"))


def test_the_same_block_at_several_places_is_asked_for_at_each() -> None:
    result = same()
    assert result.ok, [str(d) for d in result.diagnostics]
    lines = result.text.splitlines()
    own = [n for n, line in enumerate(lines) if re.fullmatch(r"\(T00\d .*\)", line)]
    assert len(own) >= 16
    for n in own:
        assert "verify.hook" in verdict(result, "\n".join(lines[:n] + lines[n + 1:]) + "\n"), n


def test_a_work_offset_by_number_is_that_of_each_place() -> None:
    """Before the first register is stated it is that of the first place."""
    setup = setup_of('[tools.1]\ngauge_length = 90\n[tools.2]\ngauge_length = 65\n[[places]]\nname = "front"\n'
                     'work_offset_code = "G54"\n[[places]]\nname = "back"\nwork_offset_code = "G55"\norigin = [40, 0, 0]\n'
                     '[clearance]\nmargin = 5\n')
    hooks = HooksModel(after_tool=("G65 P9010 W{work_offset:02d}",), before_operation=("G65 P9020 W{work_offset:02d}",),
                       passive=("G65",))
    result = postproc.convert(work(), replace(clamping(), hooks=hooks), "fanuc-30i", setup, Options(output="axes"))
    assert result.ok, [str(d) for d in result.diagnostics]
    assert {"W54", "W55"} <= set(re.findall(r"P90[12]0 (W\d+)", result.text))
    for wrong in ("W55", "W56"):
        assert "verify.hook" in verdict(result, result.text.replace("P9010 W54", f"P9010 {wrong}", 1))


@pytest.mark.covering
@pytest.mark.parametrize("controller", ["fanuc-30i", "heidenhain-tnc640"])
@pytest.mark.parametrize("number", ["101", "102", "111", "112", "121", "122", "131", "132"])
def test_a_block_beyond_the_nearest_cut_is_not_where_it_is_asked_for(controller: str, number: str) -> None:
    result = converted(controller)
    lines = result.text.splitlines()
    own = [n for n, found in own_blocks(controller, result.text) if found == number]
    cuts = [n for n, line in enumerate(lines) if re.search(r"F[35]00\b", line)]
    assert own and len(cuts) >= 2
    n = own[-1]
    beyond = [c for c in cuts if c < n][-1:] if int(number) % 2 else [c + 1 for c in cuts if c > n][:1]
    for at in beyond or cuts[:1]:
        moved = [line for k, line in enumerate(lines) if k != n]
        moved.insert(at - (n < at), lines[n])
        assert "verify.hook" in verdict(result, "\n".join(moved) + "\n"), at


def test_lines_go_to_gaps_so_that_as_few_as_can_be_are_left() -> None:
    rng = np.random.default_rng(5)
    for _ in range(300):
        lines = np.unique(rng.integers(1, 12, rng.integers(0, 6)))
        gaps = [(int(a), int(a + w)) for a, w in zip(rng.integers(0, 10, 5), rng.integers(1, 6, 5), strict=True)]
        assert len(unmatched(lines.tolist(), gaps)) == len(gaps) - _most(lines.tolist(), gaps)


def _most(lines: list[int], gaps: list[tuple[int, int]]) -> int:
    """The greatest number of gaps that have a line of their own, by trying all."""
    if not gaps:
        return 0
    (a, b), rest = gaps[0], gaps[1:]
    with_it = [1 + _most([m for m in lines if m != n], rest) for n in lines if a < n < b]
    return max([_most(lines, rest), *with_it])


def test_a_program_with_subprograms_says_that_nothing_was_looked_for() -> None:
    hooks = HooksModel(before_tool=("(NEXT TOOL)",))
    setup = SETUP.model_copy(update={"hooks": hooks, "output": OutputSettings(subprograms=True)})
    result = postproc.convert(work(), clamping(), "fanuc-30i", setup, Options(output="axes"))
    assert result.ok and "M98" in result.text and result.job is not None, [str(d) for d in result.diagnostics]
    said = [d for d in read_back(result.text, result.job, "test.apt", gcode="p.nc")[1] if d.code == "verify.hook"]
    assert [d.severity for d in said] == [Severity.INFO] and said[0].hint


def test_operations_that_the_file_does_not_name_have_their_blocks_too() -> None:
    path = toolpath("RAPID", "GOTO/0,0,40", "GOTO/0,0,30")
    setup = SETUP.model_copy(update={"hooks": HooksModel(before_operation=("(A)",), after_operation=("(B)",))})
    result = postproc.convert(path, clamping(), "fanuc-30i", setup, Options(output="axes"))
    assert result.ok and result.text.count("(A)") == result.text.count("(B)"), [str(d) for d in result.diagnostics]


def test_a_long_name_is_cut_to_the_line() -> None:
    path = toolpath("UNITS/MM", f"TOOL PATH/{'N' * 150},TOOL,T1", "MSYS/0,0,0,1,0,0,0,1,0", "LOAD/TOOL,1",
                    "SPINDL/RPM,1000,CLW", "RAPID", "GOTO/0,0,40", "FEDRAT/MMPM,500", "GOTO/0,0,30", "END-OF-PATH", head=[])
    setup = SETUP.model_copy(update={"hooks": HooksModel(before_operation=("(BEGIN {operation})",))})
    result = postproc.convert(path, clamping(), "fanuc-30i", setup, Options(output="axes"))
    assert result.ok, [str(d) for d in result.diagnostics]
    found = next(line for line in result.text.splitlines() if line.startswith("(BEGIN"))
    assert re.fullmatch(r"\(BEGIN N{50,}\)", found) and len(found) <= 120


@pytest.mark.parametrize(("records", "stops"), [
    (("OPSTOP",), 0), ((), 1), (("STOP", "RAPID", "GOTO/0,0,45"), 0), (("OPSTOP", "RAPID", "GOTO/0,0,45", "GOTO/9,0,45"), 1),
    (("STOP", "FEDRAT/MMPM,200", "GOTO/1,0,30"), 1), (("RAPID", "GOTO/0,0,45", "OPSTOP", "RAPID", "GOTO/5,0,45"), 0)])
def test_any_stop_since_the_last_cut_is_the_stop_between_tools(records: tuple[str, ...], stops: int) -> None:
    path = toolpath("RAPID", "GOTO/0,0,40", "FEDRAT/MMPM,200", "GOTO/0,0,30", *records, "LOADTL/2", "RAPID", "GOTO/0,0,40",
                    "FEDRAT/MMPM,200", "GOTO/0,0,20")
    assert len(stops_between(path)) == stops
