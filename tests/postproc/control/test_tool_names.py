"""Tools that the control calls by name: written, prepared and read back by it, refused where there are no names."""

from __future__ import annotations

import re
from functools import cache

import pytest

from postproc.pipeline.result import PostResult
from postproc.verification.read_back import read_back
from tests.postproc.kit import convert, good, setup_of, toolpath
from toolpaths.diagnostics import Severity

NAMED = ["siemens-840d", "heidenhain-tnc640"]
CUT = ["RAPID", "GOTO/0,0,40", "FEDRAT/MMPM,500", "GOTO/0,0,30", "GOTO/20,8,30", "RAPID", "GOTO/20,8,40"]
TWO = [*CUT, "LOADTL/2", "SPINDL/RPM,2000,CLW", *CUT]


@cache
def called(controller: str, one: str = "EM10_ROUGH", two: str = "") -> PostResult:
    tools = [f"[tools.{n}]\ngauge_length = {length}\n" + (f'called = "{name}"\n' if name else "")
             for n, length, name in ((1, 90, one), (2, 65, two))]
    return convert(toolpath(*TWO), "mill-3axis", controller, setup_of("".join(tools)))


def errors(result: PostResult) -> list[str]:
    return [d.code for d in result.diagnostics if d.severity is Severity.ERROR]


@pytest.mark.parametrize("controller", NAMED)
def test_tools_are_called_by_their_names(controller: str) -> None:
    pairs = (("EM10_ROUGH", ""), ("EM10_ROUGH", "BM6"), ("", ""))
    one, both, plain = (good(called(controller, *names)).text for names in pairs)
    if controller == "siemens-840d":
        assert re.search(r'N\d+ T="EM10_ROUGH"\nN\d+ M6\nN\d+ T2\n', one) and re.search(r'T="BM6"\n(N\d+ S.*\n)?', both)
        assert not re.search(r"\bT\d", re.sub(r";.*", "", both)) and '"' not in re.sub(r";.*|CYCLE.*", "", plain)
    else:
        assert 'TOOL CALL "EM10_ROUGH" Z S' in one and "TOOL CALL 2 Z" in one and 'TOOL DEF "BM6"' in both
        assert 'TOOL CALL "BM6" Z S2000' in both and '"' not in plain


@pytest.mark.covering
@pytest.mark.parametrize("controller", NAMED)
@pytest.mark.parametrize(("old", "new", "code"), [
    ("EM10_ROUGH", "BM6", "verify."), ("EM10_ROUGH", "EM99", "gcode.tool_name"), ("BM6", "EM10_ROUGH", "verify.")])
def test_the_reader_knows_the_names(controller: str, old: str, new: str, code: str) -> None:
    result = good(called(controller, "EM10_ROUGH", "BM6"))
    assert result.job is not None
    found = read_back(result.text.replace(f'"{old}"', f'"{new}"').encode(), result.job, "test.apt")[1]
    assert any(d.code.startswith(code) and d.severity is Severity.ERROR for d in found), [str(d) for d in found]
    same = result.text.replace('"EM10_ROUGH"', '"em10_rough"')
    assert not [d for d in read_back(same.encode(), result.job, "test.apt")[1] if d.severity is Severity.ERROR]


@pytest.mark.parametrize("controller", NAMED)
def test_a_number_in_the_place_of_a_name_is_refused(controller: str) -> None:
    result = good(called(controller, "EM10_ROUGH", "BM6"))
    assert result.job is not None
    text = re.sub(r'T="BM6"|"BM6"', lambda call: call[0].replace('="BM6"', "2").replace('"BM6"', "2"), result.text)
    found = [d for d in read_back(text.encode(), result.job, "test.apt")[1] if d.severity is Severity.ERROR]
    [line] = [d.lines for d in found if d.code == "gcode.tool_name" and "tool 2 is called by its number" in d.message]
    assert all(re.search(r"\bT2$|TOOL (CALL|DEF) 2\b", text.splitlines()[n - 1]) for n in line)


@pytest.mark.parametrize(("controller", "before", "call", "said"), [
    ("siemens-840d", "R10=1", "T=R10", "the number in R10"), ("siemens-840d", "DEF STRING[16] NM, OT", "T=NM", ""),
    ("heidenhain-tnc640", "Q1 = 1", "TOOL CALL Q1", "the number in Q1"),
    ("heidenhain-tnc640", 'QS1 = "EM10_ROUGH"', "TOOL CALL QS1", "")])
def test_a_tool_called_by_a_variable_with_a_number_is_refused(controller: str, before: str, call: str, said: str) -> None:
    """A variable that holds the name is as good as the name."""
    result = good(called(controller))
    assert result.job is not None
    before += '\nNM="EM10_ROUGH"' * ("STRING" in before)
    old = 'T="EM10_ROUGH"' if controller == "siemens-840d" else 'TOOL CALL "EM10_ROUGH"'
    rows = result.text.splitlines()
    at = next(k for k, row in enumerate(rows) if old in row)
    rows[at:at + 1] = [*before.splitlines(), rows[at].replace(old, call)]
    found = [d for d in read_back("\n".join(rows).encode(), result.job, "test.apt", gcode="p.nc")[1]
             if d.severity is not Severity.INFO]
    assert [d.message for d in found if said and said in d.message] == [d.message for d in found]
    assert bool(found) == bool(said) and all(call in rows[d.lines[0] - 1] for d in found)


def test_a_program_by_names_needs_the_set_up() -> None:
    named, bare = good(called("siemens-840d", "EM10_ROUGH", "BM6")), good(called("siemens-840d", ""))
    assert bare.job is not None
    [bad, other] = [d for d in read_back(named.text.encode(), bare.job, "test.apt")[1] if d.severity is Severity.ERROR]
    assert bad.code == other.code == "gcode.tool_name" and "[tools.N] called" in bad.hint


@pytest.mark.parametrize("controller", ["fanuc-30i", "haas-ngc", "linuxcnc", "generic-iso"])
def test_controls_of_numbers_refuse_names(controller: str) -> None:
    result = called(controller)
    assert errors(result) == ["tool.called"] and result.text == ""
    assert good(called(controller, "")).text


def test_two_tools_of_one_name_are_refused() -> None:
    assert errors(called("siemens-840d", "EM10", "em10")) == ["tool.called"]
