"""One damaged byte of any record: the file is refused, means the same, or holds another number; never less than before."""

from __future__ import annotations

import os

import numpy as np
import pytest
from records import Record, damaged, outcome, read, records

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


@pytest.mark.skipif("DAMAGE" not in os.environ,
                    reason="make damage: any of 256 bytes at any place, hours of processor")
@pytest.mark.parametrize("record", RECORDS, ids=lambda r: r.name)
def test_all_bytes(record: Record) -> None:
    """DAMAGE=all, or a number of seeded changes of each record."""
    only = os.environ["DAMAGE"]
    if not record.free:
        assert losses(record, bytes(range(256)), bytes(range(256)), 0 if only == "all" else int(only)) == []
