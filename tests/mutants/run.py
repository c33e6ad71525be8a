"""Plants every fault in a process of its own and says what catches it (`make mutants`)."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from tests.mutants.battery import CASES
from tests.mutants.judge import Made, blind, body, change, converted, edits_of, made, passed_on, short, verified
from tests.mutants.plant import Fault, NotPlanted, functions, planted
from tests.mutants.rooms import BESIDE, cases_of, files_asked, proves

SECONDS = 60
"""s of processor that a process may take: a busy machine does not make a fault one that has no end"""
IDLE = 20
"""times as long by the clock, for what waits and never works"""
EDITS = 24
"""changed programs that a reader with a fault is asked about"""


@dataclass
class Outcome:
    """What became of a fault: in each conversion, and in all."""

    fault: Fault
    cases: dict[str, str] = field(default_factory=dict)
    caught_by: str = ""
    detail: str = ""
    test: str = ""
    seconds: float = 0.0

    @property
    def survives(self) -> bool:
        """True where the conversion's own proof lets harm pass that nobody has explained, a fault acts nowhere, or wrong
        programs pass and no test fails."""
        unexplained = self.caught_by in ("verify", "not acting") and not (
            self.fault.why or (self.fault.room in BESIDE and self.test))
        return self.caught_by == "survives" or unexplained or (self.caught_by == "blind" and not self.test)


def limit(seconds: float) -> None:
    """Ends this process after so many seconds of processor, or `IDLE` times as many by the clock; 0: no limit."""
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.setitimer(signal.ITIMER_REAL, IDLE * seconds)


def apart(work: Callable[[], Any], seconds: float = SECONDS) -> Any:
    """What `work` gives in a process of its own; an exception, or no end, as a text."""
    sys.stdout.flush()
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        limit(seconds)
        try:
            found = pickle.dumps(work())
        except BaseException as fault:
            found = pickle.dumps(f"{type(fault).__name__}: {fault}")
        with os.fdopen(write, "wb") as pipe:
            pipe.write(found)
        os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        data = pipe.read()
    os.waitpid(child, 0)
    return pickle.loads(data) if data else f"no end within {seconds} s"


class Bench:
    """The conversions without a fault, made when they are first needed.

    What a process with a fault inherits is warm, but for the caches of the project (`plant.forget`)."""

    def __init__(self) -> None:
        functions()
        self.results: dict[str, Any] = {}
        self.made: dict[str, Made] = {}
        self.edits: dict[str, list[str]] = {}

    def base(self, names: tuple[str, ...]) -> dict[str, Made]:
        """Of all names."""
        for name in names:
            if name not in self.made:
                self.results[name] = converted(CASES[name])
                self.made[name] = short(self.results[name])
        return {n: self.made[n] for n in names}

    def wrong(self, name: str) -> list[str]:
        """Changed programs of a case that the project refuses."""
        if name not in self.edits:
            every = edits_of(self.made[name], EDITS)
            passed = apart(lambda: blind(self.results[name], every))
            self.edits[name] = [text for text, ok in zip(every, passed, strict=True) if not ok]
        return self.edits[name]


def outcomes(faults: list[Fault], bench: Bench, tests: bool = True, jobs: int = 1) -> list[Outcome]:
    """Of all faults in their order, `jobs` at a time."""
    for fault in faults:
        bench.base(cases_of(fault))
    if jobs > 1:
        parts = [pool.submit(apart, partial(_some, faults[k::jobs], bench, tests)) for pool in [ThreadPoolExecutor(jobs)]
                 for k in range(jobs)]
        found = {o.fault: o for part in parts for o in part.result()}
        return [found[f] for f in faults]
    return _some(faults, bench, tests)


def _some(faults: list[Fault], bench: Bench, tests: bool) -> list[Outcome]:
    limit(0)
    result = []
    for fault in faults:
        result.append(outcome(fault, bench, tests))
        print(f"{fault.room}: {fault.name}: {result[-1].caught_by} {result[-1].test}",
              file=sys.stderr, flush=True)
    return result


def outcome(fault: Fault, bench: Bench, tests: bool = True) -> Outcome:
    """What becomes of one fault."""
    began, names = time.time(), cases_of(fault)
    base = bench.base(names)

    def with_fault() -> dict[str, Made]:
        with planted(fault):
            return {n: made(CASES[n]) for n in names}
    got = apart(with_fault)
    result = Outcome(fault)
    if isinstance(got, str) and got.startswith(NotPlanted.__name__):
        raise NotPlanted(got)
    if isinstance(got, str):
        result.cases = dict.fromkeys(names, f"conversion: {got}")
    else:
        passed = {n: m for n, m in got.items() if m.ok and (body(m.text) != body(base[n].text) or not base[n].ok)}
        checked = {} if not passed else apart(
            lambda: {n: verified(bench.results[n], m.text, m.files) for n, m in passed.items()})
        assert not isinstance(checked, str), checked
        result.cases = {n: _of_case(base[n], got[n], checked.get(n)) for n in names}
        if proves(fault.room):
            _weaker(fault, result, bench)
    _sum_up(result, tests)
    result.seconds = time.time() - began
    return result


def _of_case(base: Made, got: Made, checked: Made | None) -> str:
    """What becomes of a fault in one conversion."""
    if not got.ok and base.ok:
        return f"conversion: {got.errors[0] if got.errors else 'refused'}"
    if not got.ok:
        return "not acting" if got.errors == base.errors else f"conversion: {got.errors[0]}"
    if checked is not None:
        if not checked.ok:
            return f"verify: {checked.errors[0] if checked.errors else 'refused'}"
        if base.effect is None or checked.effect is None:
            return "survives: a program where none should be"
        other = passed_on(base, got)
        differs = change(base.effect, checked.effect, other)
        if other and not differs:
            return "conversion: its mode refused, the next one taken, which is right"
        return f"survives: {differs}" if differs else "harmless: inside the tolerance, times and states the same"
    if got.proof != base.proof:
        return "another proof: the program is the same"
    return "not acting" if got.said == base.said else "harmless: the same program, other messages"


def _weaker(fault: Fault, result: Outcome, bench: Bench) -> None:
    """Which of a few wrong programs a reader with the fault lets pass."""
    open_ = [n for n, said in result.cases.items() if not said.startswith("conversion")][:3]
    for name in open_:
        wrong = bench.wrong(name)

        def asked(name: str = name, wrong: list[str] = wrong) -> list[bool]:
            with planted(fault):
                return blind(converted(CASES[name]), wrong)
        passed = apart(asked)
        count = sum(passed) if isinstance(passed, list) else 0
        if count:
            result.cases[name] = f"blind: {count} of {len(wrong)} wrong programs pass"


_ORDER = ("survives", "blind", "verify", "conversion", "another proof", "harmless", "not acting")


def _sum_up(result: Outcome, tests: bool) -> None:
    worst = min(result.cases.values(), key=lambda said: _ORDER.index(said.partition(":")[0]))
    kind, _, detail = worst.partition(": ")
    where = next(n for n, said in result.cases.items() if said == worst)
    result.caught_by, result.detail = kind, f"{detail} ({where})"
    if (kind in ("survives", "blind", "verify") or result.fault.room in BESIDE) and tests:
        result.test = apart(lambda: _tests(result.fault))


def _tests(fault: Fault) -> str:
    """The first test of the room that fails with the fault, "" where none does."""
    import pytest

    class First:
        name = ""

        def pytest_runtest_logreport(self, report: Any) -> None:
            if report.failed and not self.name:
                self.name = report.nodeid

    first = First()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    limit(3 * SECONDS)
    with planted(fault):
        pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist",
                     *(f"tests/{name}" for name in files_asked(fault.room))], plugins=[first])
    return first.name
