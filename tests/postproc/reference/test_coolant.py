"""Coolant by its kind: written one at a time, ended by the code that ends it, read back as what the CL file asks for."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from postproc.pipeline.result import PostResult
from postproc.verification.read_back import read_back
from tests.postproc.kit import codes, convert, good, shop_file, toolpath
from toolpaths.diagnostics import DiagnosticError

CONTROLLERS = ["linuxcnc", "generic-iso", "fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640"]
SHOP = '[codes]\nthrough = "M51"\nair = "M60"\nair_off = "M61"\n'
AT = ["GOTO/10,0,5", "GOTO/20,0,5", "GOTO/30,0,5"]


def cut(controller: str | Path, *lines: str) -> PostResult:
    return convert(toolpath("RAPID", "GOTO/0,0,5", *lines), "mill-3axis", controller)


def switches(text: str) -> list[str]:
    """The M codes of coolant, in order."""
    return re.findall(r"(?<![A-Z])M(?:[789]|51|6[01]|8[3489])(?!\d)", re.sub(r"\(.*?\)|;.*", "", text))


def verified(result: PostResult, text: str) -> list[str]:
    assert result.job is not None
    found = read_back(text.encode(), result.job, "test.apt", gcode="MAIN")[1]
    return [d.message for d in found if d.severity.name == "ERROR"]


def test_haas_has_codes_of_its_own() -> None:
    """M88, M89 through the tool, M83, M84 air; M7 is the shower, so mist becomes flood and is reported."""
    lines = [w for k, one in enumerate(("THRU", "FLOOD", "AIR", "MIST")) for w in (f"COOLNT/{one}", AT[k % 3])]
    result = good(cut("haas-ngc", *lines, "COOLNT/OFF"))
    assert switches(result.text) == ["M88", "M89", "M8", "M9", "M83", "M84", "M8", "M9"]
    assert [(d.code, d.lines) for d in result.diagnostics if d.code.startswith("coolant")] == [("coolant.mist", (13,))]


@pytest.mark.parametrize("base", CONTROLLERS)
def test_a_shops_codes_are_written_and_read_back(tmp_path: Path, base: str) -> None:
    mist = 'mist = "M7"\nthrough_off = ""\n' if base == "haas-ngc" else ""
    result = good(cut(shop_file(tmp_path, SHOP + mist, base), "COOLNT/THRU", AT[0], "COOLNT/AIR", AT[1], "COOLNT/MIST",
                      AT[2], "COOLNT/OFF", "GOTO/40,0,5"))
    assert switches(result.text)[:6] == ["M51", "M9", "M60", "M61", "M7", "M9"]
    assert not [c for c in codes(result.diagnostics) if c.startswith("coolant")]


@pytest.mark.parametrize("base", CONTROLLERS)
def test_another_kind_is_missed(tmp_path: Path, base: str) -> None:
    result = good(cut(shop_file(tmp_path, SHOP, base), "COOLNT/THRU", AT[0], "COOLNT/OFF", AT[1]))
    assert not verified(result, result.text)
    for other, flows in (("M8", "flood"), ("M60", "air"), ("M9", "off")):
        wrong = verified(result, result.text.replace("M51", other))
        assert wrong and f"coolant is {flows}, it should be through the tool" in wrong[0]
    more = result.text.replace("M51", "M8\nM51") if not base.startswith("heid") else result.text.replace("M51", "M8 M51")
    assert "coolant is flood and through the tool" in verified(result, more)[0]


def test_nothing_flows_over_a_tool_change_or_the_end() -> None:
    result = good(cut("haas-ngc", "COOLNT/THRU", AT[0], "LOADTL/2", "SPINDL/RPM,500,CLW", AT[1]))
    lines = [n for n in result.text.splitlines() if re.match(r"T\d M6|M8|M9|M30", n)]
    assert lines == ["T1 M6", "M88", "M89", "T2 M6", "M88", "M89", "M9", "M30"]


def test_on_alone_is_content_with_any_kind() -> None:
    result = good(cut("linuxcnc", "COOLNT/ON", *AT))
    assert not verified(result, result.text.replace("M8", "M7"))
    assert verified(result, result.text.replace("M8", "M9"))


@pytest.mark.parametrize("record", ["INSERT/M88", "AUXFUN/88"])
def test_a_code_put_in_counts_as_what_it_switches(record: str) -> None:
    result = good(cut("haas-ngc", record, AT[0], "INSERT/M89", AT[1]))
    assert switches(result.text)[:2] == ["M88", "M89"]
    assert not cut("fanuc-30i", record, AT[0]).ok


def test_a_shops_through_the_tool_on_m7(tmp_path: Path) -> None:
    result = good(cut(shop_file(tmp_path, '[codes]\nmist = ""\nthrough = "M7"\n', "siemens-840d"), "COOLNT/THRU,HIGH", *AT))
    assert switches(result.text) == ["M7", "M9"] and "coolant.word" in codes(result.diagnostics)


def test_a_code_that_cannot_be_read_back_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DiagnosticError, match=r"codes\.through"):
        cut(shop_file(tmp_path, '[codes]\nthrough = "H_COOL(1)"\n', "siemens-840d"), *AT)
