"""Which assumed value `time` asks to be measured first: the one that, moved alone, moves the time most."""

from __future__ import annotations

from dataclasses import replace

import pytest

from postproc.cycle_time.estimate import Estimate, estimate, measure_first
from tests.postproc.time_kit import blocks, machine, model, random_program

CASES = [("mill-3axis", "", 300.0), ("mikron-ucp710", "AC", 150.0)]
LIMITS = ("velocity", "acceleration", "jerk")


def sds(e: Estimate) -> dict[str, float]:
    """Of assumed values, by name."""
    return {name.removeprefix("assumed "): s for name, s in e.uncertainties.items() if name.startswith("assumed ")}


@pytest.mark.parametrize(("name", "rotary", "top"), CASES)
def test_it_is_the_worst_of_all_moved_alone(name: str, rotary: str, top: float) -> None:
    m, lookahead = machine(name), model("lookahead")
    b = blocks(random_program(1, rotary, top), m)
    e = estimate(b, m, lookahead)
    first = measure_first(e, m)
    alone = {value: s for value, s in sds(e).items() if value not in LIMITS}
    for key in m.limits.assumed:
        if (limit := key.split(".")[1]) in LIMITS:
            only = replace(m, limits=replace(m.limits, assumed=frozenset({key})))
            alone[key] = sds(estimate(b, only, lookahead))[limit]
    assert first is not None and first.value == max(alone, key=lambda value: alone[value])
    assert first.seconds == pytest.approx(alone[first.value])


def test_a_value_that_is_known_is_not_named() -> None:
    m, lookahead = machine("mill-3axis"), model("lookahead")
    b, named = blocks(random_program(1, "", 300.0), m), set[str]()
    for _ in range(4):
        first = measure_first(estimate(b, m, lookahead), m)
        assert first is not None and first.value not in named
        named.add(first.value)
        m = replace(m, limits=replace(m.limits, assumed=m.limits.assumed - named),
                    timing=replace(m.timing, assumed=m.timing.assumed - named))
        lookahead = lookahead.model_copy(update={"assumed": tuple(n for n in lookahead.assumed if n not in named)})
    sure = replace(m, limits=replace(m.limits, assumed=frozenset()), timing=replace(m.timing, assumed=frozenset()))
    assert measure_first(estimate(b, sure, lookahead.model_copy(update={"assumed": ()})), sure) is None
