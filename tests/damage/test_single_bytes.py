"""One damaged byte of any record: the file is refused, means the same, or holds another number; never less than before."""

from __future__ import annotations

import os

import numpy as np
import pytest
from records import Record, damaged, outcome, read, records

from toolpaths.diagnostics import Severity, has_errors

RECORDS = list(records())
COMMON = b"0.,-$/ \nXE("
"""bytes that stand for all others: digits, what numbers and fields end with, blanks, line ends, letters, other signs"""
SAMPLES = 7
"""changes of each record in the quick run"""
UNKNOWABLE = frozenset({b"LOADTL/1,2\n", b"CUTTER/1,0.0,1.0\n", b"CUTTER/10,0,1.0\n", b"CUTTER/10.,0,1.0\n",
                        b"CUTTER/10.0,1,0\n", b"CUTTER/10.0,1.,0\n", b"CUTTER/10.0,1,.0\n"})
"""damaged records that are well formed: a comma in a whole number makes two"""


def losses(record: Record, substitutes: bytes, inserted: bytes, only: int = 0) -> list[str]:
    whole = read(record.data)
    changes = list(damaged(record, substitutes, inserted))
    if only:
        changes = [changes[i] for i in np.random.default_rng(len(record.data)).permutation(len(changes))[:only]]
    found, whole_record = [], record.data[record.start:record.stop].upper()
    for what, data in changes:
        result = outcome(read(data), whole)
        text = data[record.start:record.stop + len(data) - len(record.data)]
        turned = text.upper().replace(b"CCLW", b"CLW") == whole_record and b"CCLW" in text.upper()
        if result.startswith("lost") and text not in UNKNOWABLE and not turned:
            found.append(f"{what} {result}: {text!r}")
    return found


@pytest.mark.parametrize("record", RECORDS, ids=lambda r: r.name)
def test_no_damage_is_lost(record: Record) -> None:
    if not record.free:
        assert losses(record, COMMON, b"0, $/X", SAMPLES) == []


@pytest.mark.parametrize("name", ["apt: GOTO/10.0,0.0,-1.0", "apt: GODLTA/7.5"])
def test_every_byte_of_a_short_motion_by_every_common_one(name: str) -> None:
    record = next(r for r in RECORDS if r.name == name)
    assert losses(record, COMMON, b",$") == []


@pytest.mark.parametrize("text", [
    "FROM/ 1.0, 2.0, 9.0", "GOTO/ 1.0, 2.0, 3.0", "GOTO/ 1, 2, 3, 0, 0, 1", "GODLTA/ 1.0, 2.0, 3.0", "TLAXIS/ 0.0, 0.0, 1.0",
    "CIRCLE/ 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 5.0", "MSYS/ 0, 0, 5, 1, 0, 0, 0, 1, 0"])
def test_a_comma_that_became_a_digit_is_seen(text: str) -> None:
    """The blank behind it would still keep the numbers apart: -75.0, -40.0 and -75.03 -40.0 are two places."""
    head, tail = "UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nFEDRAT/MMPM,100\nGOTO/9,9,9\n", "\nGOTO/9,9,8\nFINI\n"
    commas = [k for k, sign in enumerate(text) if sign == ","]
    for k in commas:
        found = read(f"{head}{text[:k]}7{text[k + 1:]}{tail}".encode()).diagnostics
        assert "cl.number" in {d.code for d in found if d.severity is Severity.ERROR}, text[:k]
    whole = text.replace(", ", "  ") if text.startswith("GO") else text
    assert "cl.number" not in {d.code for d in read(f"{head}{whole}{tail}".encode()).diagnostics}


@pytest.mark.parametrize(("unit", "others"), [("MMPM", "MPM MMPS"), ("IPM", "FPM IPS")])
def test_a_feed_in_a_unit_one_letter_apart_from_the_others_is_seen(unit: str, others: str) -> None:
    """A thousand times as fast, or sixty. Feeds per revolution stand next to those per minute: taps."""
    text = "UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nFEDRAT/{},10\nGOTO/1,2,3\nFEDRAT/{},20\nGOTO/4,5,6\nFINI\n"
    for other in others.split():
        for both in ((unit, other), (other, unit)):
            [found] = [d for d in read(text.format(*both).encode()).diagnostics if d.severity is Severity.ERROR]
            assert found.code == "cl.feed" and found.lines == (6,) and "line 4" in found.message
    for both in ((other, other), (unit, unit), (unit, f"{unit[:-1]}R")):
        assert not has_errors(read(text.format(*both).encode()).diagnostics)


@pytest.mark.parametrize("record", ["FEDRAT/{},250", "FEDRAT/250.0,{}", "CYCLE/DRILL,DEPTH,5,{},250,CLEAR,3"])
def test_a_feed_that_lost_a_letter_is_seen_in_a_file_with_no_other(record: str) -> None:
    """250 mm/min as 250 m/min; 60 m/min is what is cut with at most."""
    text = "UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nGOTO/1,2,3\n" + record + "\nGOTO/4,5,6\nFINI\n"
    [found] = [d for d in read(text.format("MPM").encode()).diagnostics if d.severity is Severity.ERROR]
    assert found.code == "cl.feed" and found.lines == (5,) and "250000 mm/min" in found.message
    for good in (text.format("MMPM"), text.format("MPM").replace("250", "25")):
        assert "cl.feed" not in {d.code for d in read(good.encode()).diagnostics}


@pytest.mark.skipif("DAMAGE" not in os.environ,
                    reason="make damage: any of 256 bytes at any place, hours of processor")
@pytest.mark.parametrize("record", RECORDS, ids=lambda r: r.name)
def test_all_bytes(record: Record) -> None:
    """DAMAGE=all, or a number of seeded changes of each record."""
    only = os.environ["DAMAGE"]
    if not record.free:
        assert losses(record, bytes(range(256)), bytes(range(256)), 0 if only == "all" else int(only)) == []
