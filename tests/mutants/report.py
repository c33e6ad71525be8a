"""What `make mutants` has found, as a table by room, as a page and as JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

from tests.mutants.programs import WARNED, Found
from tests.mutants.rooms import BESIDE
from tests.mutants.run import Outcome

COLUMNS = ("conversion", "verify", "tests", "nothing", "no harm")
HEAD = """\
# Planted faults

`make mutants` plants {count} faults, each in one function of the project, found by its name, in a process of its own, and
says what catches it; and it changes written programs in {changes} places. `make mutants ROOM=arcs ONLY=sense JOBS=2` takes
some.

| file | what it holds |
|---|---|
| `plant.py` | the text of a function is changed and compiled again; no file is touched, a moved function keeps its faults |
| `faults_*.py`, `rooms.py` | the faults by room, the conversions in which each acts, the tests that are asked |
| `battery.py` | small conversions: six controls, every output mode, 3 to 5 axes, heads, tables, rods, inch, cycles, errors |
| `judge.py` | a program with a fault is read without it: is it refused, does it do what the right one does |
| `programs.py` | changes of written programs, picked with a fixed seed |

In all of them the part stands off the rotary axes, and tools have different lengths.

- **conversion**: refused by the conversion itself wherever it acts; nothing is written.
- **verify**: some conversion lets it pass, `verify` of the project without the fault refuses the program.
- **tests**: neither, and a test of the room fails.
- **no harm**: measured by the reader without the fault: every cut inside the tolerance, its time within 0.5 %, rests and
  states the same; or the program is the same, and all wrong programs that were tried stay refused. A fault that acts
  nowhere and has no reason beside it counts as caught by nothing.

Readers and proof change no program but what is made of it: they count by wrong programs that pass with the fault. Such a
program needs a second fault to be written. The last three rooms work beside the conversion: their tests are asked.

"""


def column(outcome: Outcome) -> str:
    """The column of the table that a fault counts in."""
    if outcome.caught_by == "conversion":
        return "conversion"
    if outcome.caught_by == "verify":
        return "verify"
    if outcome.caught_by in ("survives", "blind") or outcome.fault.room in BESIDE:
        return "tests" if outcome.test else "nothing"
    return "nothing" if outcome.caught_by == "not acting" and not outcome.fault.why else "no harm"


def by_room(found: list[Outcome]) -> dict[str, Counter[str]]:
    """How many of each room are caught by what."""
    result: dict[str, Counter[str]] = {}
    for one in found:
        result.setdefault(one.fault.room, Counter())[column(one)] += 1
    return result


def _table(found: list[Outcome]) -> Iterator[str]:
    rooms = by_room(found)
    yield "| room | planted | " + " | ".join(COLUMNS) + " |"
    yield "|---|" + "---|" * (len(COLUMNS) + 1)
    for room, counts in (*rooms.items(), ("**all**", sum(rooms.values(), Counter()))):
        yield f"| {room} | {counts.total()} | " + " | ".join(str(counts[c]) for c in COLUMNS) + " |"


def _witness(found: list[Outcome]) -> int:
    return sum(column(o) == "conversion" and any("witness." in said for said in o.cases.values()) and not any(
        said.startswith("conversion") and "witness." not in said for said in o.cases.values()) for o in found)


def page(found: list[Outcome], programs: list[Found]) -> str:
    """The published page."""
    changes = sum(p.count for p in programs)
    text = HEAD.format(count=len(found), changes=f"{changes:,}") + "\n".join(_table(found))
    text += f"\n\n{_witness(found)} of those that the conversion refuses are seen by the second witness alone.\n"
    text += "\n## What is not caught by the conversion itself\n\n| room | fault | outcome | why |\n|---|---|---|---|\n"
    for one in found:
        kind = column(one)
        if kind != "conversion":
            test = f"`{one.test}`" if one.test else ""
            said = {"verify": f"`verify` {test}", "tests": test, "nothing": "**nothing**"}.get(kind, kind)
            text += f"| {one.fault.room} | {one.fault.name} | {said} | {one.fault.why or _beside(one) or one.detail} |\n"
    return text + "\n" + programs_page(programs)


def _beside(one: Outcome) -> str:
    return "works beside the conversion, whose program it does not change" if one.fault.room in BESIDE else ""


def programs_page(programs: list[Found]) -> str:
    """What became of changes of written programs, by control."""
    if not programs:
        return ""
    total, harmless = sum(p.count for p in programs), Counter[str]()
    kinds, caught = Counter[str](), Counter[str]()
    for p in programs:
        harmless += p.harmless
        kinds += p.kinds
        caught += p.caught
    lines = [f"## Faults in {total:,} programs", "", "`make programs` prints this part alone.", "",
             "| control | programs | changed | refused by verify | warned of | no harm | silent and harmful |",
             "|---|---|---|---|---|---|---|"]
    for control in dict.fromkeys(p.name.split()[-1] for p in programs):
        own = [p for p in programs if p.name.split()[-1] == control]
        warned = sum(p.harmless[WARNED] for p in own)
        lines.append(f"| {control} | {len(own)} | {sum(p.count for p in own)} | {sum(p.caught.total() for p in own)} | "
                     f"{warned} | "
                     f"{sum(p.harmless.total() for p in own) - warned} | {sum(len(p.survivors) for p in own)} |")
    lines += ["", "Kinds of change: " + ", ".join(f"{kind.strip()} {n}" for kind, n in kinds.most_common()) + ".",
              "Refused by: " + ", ".join(f"{code}.* {n}" for code, n in caught.most_common()) + ".",
              "No harm: " + "; ".join(f"{why} ({n})" for why, n in harmless.most_common()) + ".", ""]
    left = [f"- {p.name}: `{text.strip()}`" for p in programs for text in p.survivors]
    return "\n".join([*lines, *(["Pass and do harm:", "", *left, ""] if left else [])])


def as_dict(found: list[Outcome], programs: list[Found]) -> dict[str, Any]:
    """Everything, for other programs."""
    return {"faults": [{"room": o.fault.room, "name": o.fault.name, "function": o.fault.function, "outcome": column(o),
                        "detail": o.detail, "test": o.test, "cases": o.cases, "why": o.fault.why} for o in found],
            "rooms": {room: dict(counts) for room, counts in by_room(found).items()},
            "programs": [{"name": p.name, "changed": p.count, "refused": dict(p.caught), "harmless": dict(p.harmless),
                          "survivors": p.survivors} for p in programs]}


def summary(found: list[Outcome], programs: list[Found]) -> str:
    """For the console."""
    lines = list(_table(found))
    lines += [f"{column(o)}: {o.fault.room}: {o.fault.name}: {o.detail}" for o in found
              if column(o) in ("verify", "tests", "nothing")]
    lines += [f"passes: {p.name}: {text}" for p in programs for text in p.survivors]
    return "\n".join(lines)
