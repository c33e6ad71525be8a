"""The table of planted faults: every function and text is found, every room has faults, and a few are planted for real."""

from __future__ import annotations

import time
from collections import Counter

import pytest

from tests.mutants.battery import CASES, SIX
from tests.mutants.judge import change, converted, made, short, verified
from tests.mutants.plant import Fault, NotPlanted, place_of, planted, spoilt
from tests.mutants.programs import picked
from tests.mutants.rooms import BATTERY, FAULTS, cases_of, files_asked
from tests.mutants.run import apart

NAMED = {f.name: f for f in FAULTS}
SEVEN = {"MSYS ignored": "flat linuxcnc", "arcs in the other sense": "milled", "cycle depth + 1 mm": "flat fanuc",
         "inch feeds as mm": "inch", "feed x 1.1": "flat linuxcnc", "safe margin 0": "faces linuxcnc",
         "gauge length x 1.001": "five linuxcnc"}
"""faults that a proof without a second witness lets pass, each where it acts"""
MORE = {"register of ADJUST dropped": "contact", "feed of the file + 2 %": "flat linuxcnc",
        "units of rotary words": "five linuxcnc", "work offset 0.5 mm off": "five linuxcnc",
        "retract plane 1 mm lower": "flat fanuc", "mist read as flood": "flat linuxcnc",
        "no link where the axis turns": "faces linuxcnc", "coolant of the set-up as mist": "set-up",
        "DELAY not read": "rests linuxcnc", "STOP read as OPSTOP": "rests fanuc", "register of CUTCOM not read": "side haas",
        "chips broken where they are to be cleared": "flat siemens", "dwell of cycles in revolutions x 60": "rests iso",
        "code of coolant through the tool not known": "cooled haas", "feed x 1.006": "milled",
        "travel of the machine file 20 mm wider": "far", "feed x 1.1 where tool axes were chosen": "chosen axes"}


def test_there_are_ninety_faults_with_names_of_their_own() -> None:
    assert len(FAULTS) >= 90
    assert [name for name, n in Counter((f.room, f.name) for f in FAULTS).items() if n > 1] == []


@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f"{f.room}: {f.name}")
def test_a_fault_can_be_planted(fault: Fault) -> None:
    place, text = spoilt(fault)
    assert text != place.path.read_text("utf-8")
    compile(text, str(place.path), "exec")
    assert set(cases_of(fault)) <= set(CASES) and cases_of(fault) and files_asked(fault.room)


def test_every_room_has_faults() -> None:
    rooms = Counter(f.room for f in FAULTS)
    wanted = {*BATTERY, *(f"writer of {c}" for c in SIX), *(f"reader of {c}" for c in SIX)}
    assert set(rooms) == wanted
    assert min(rooms.values()) >= 2, rooms


def test_a_fault_has_no_end_by_its_own_work_and_not_by_that_of_others() -> None:
    """A process may wait for a busy machine; one that works on, or never works, is ended."""
    def work() -> None:
        while True:
            pass
    assert apart(lambda: time.sleep(0.1), 0.05) is None
    assert apart(work, 0.05) == "no end within 0.05 s"
    assert apart(lambda: time.sleep(5.0), 0.01) == "no end within 0.01 s"


@pytest.mark.parametrize(("function", "old"), [
    ("set_system", "no such text"), ("no_such_function", "x"), ("unit", "return")])
def test_what_is_not_found_once_is_an_error(function: str, old: str) -> None:
    with pytest.raises(NotPlanted):
        place_of(function, old)


@pytest.mark.covering(count=12)
@pytest.mark.parametrize("name", [*SEVEN, *MORE])
def test_the_conversion_refuses_a_planted_fault(name: str) -> None:
    case = CASES[{**SEVEN, **MORE}[name]]
    with planted(NAMED[name]):
        got = made(case)
    assert not got.ok and any(code.startswith("witness.") for code in got.errors), (name, got.errors)


def test_a_fault_is_gone_behind_its_block() -> None:
    case = CASES["flat linuxcnc"]
    before = made(case)
    with planted(NAMED["MSYS ignored"]):
        assert not made(case).ok
    after = made(case)
    assert after.ok and after.text == before.text


def test_a_harmful_change_of_a_program_is_measured() -> None:
    """The judge itself: a program that rests longer or runs another feed is distinguished from the right one."""
    asked = converted(CASES["flat linuxcnc"])
    plain = short(asked)
    assert plain.effect is not None
    for old, new, said in (("F600", "F605", "another time"), ("P0.5", "P0.9", "rest")):
        assert old in plain.text
        got = verified(asked, plain.text.replace(old, new), {})
        assert not got.ok or said in change(plain.effect, got.effect)
    assert change(plain.effect, plain.effect) == ""


def test_changes_of_programs_are_the_same_every_time_and_of_every_kind() -> None:
    text = made(CASES["flat heidenhain"]).text
    one, two = (picked(text, ";", 54, "flat heidenhain") for _ in range(2))
    assert one == two
    assert {m.kind.strip() for m in one} >= {"delete word", "delete block", "block twice", "exchange", "sign", "digit",
                                             "zero", "other code"}
