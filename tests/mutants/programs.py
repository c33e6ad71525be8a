"""Faults in written programs: which of them `verify` refuses, which do no harm, which pass (`make mutants`).

2,000 and more, picked with a fixed seed from all changes of one kind each: words and blocks left out, blocks
doubled and exchanged, signs, digits, codes, numbers of tools and registers, feeds and speeds, over every
control, with the part off the rotary axes and tools of different lengths.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from tests.mutants.battery import CASES, SIX
from tests.mutants.judge import Made, change, converted, short, verified
from tests.mutants.run import apart
from tests.postproc.mutation_kit import Effect, Mutant, mutants

SEED = 19
PROGRAMS = (*(f"{kind} {c}" for c in SIX for kind in (
    "flat", "laws", "axes", "helix", "five", "faces", "rests", "side", "spline", "inches", "again", "homing")),
            *(f"{kind} {c}" for c in ("fanuc", "siemens", "heidenhain", "haas") for kind in ("cycles", "tip")),
            "curves siemens", "curves heidenhain", "points siemens")
EACH = 26
"""changes of each program"""
SAME = {"same": "the same motion, states and times", "near": "ends within the tolerance, the rest the same",
        "placed": "only rapids between operations end elsewhere, clear of the part and inside travel"}
WARNED = "a warning says so: more rests or stops than the CL file has, axes that end away from home"


@dataclass
class Found:
    """What became of the changes of one program."""

    name: str
    count: int = 0
    caught: Counter[str] = field(default_factory=Counter)
    kinds: Counter[str] = field(default_factory=Counter)
    harmless: Counter[str] = field(default_factory=Counter)
    survivors: list[str] = field(default_factory=list)


def every_change(text: str, comment: str) -> Iterator[Mutant]:
    """All changes of a program: those of the kit, neighbouring blocks exchanged, last digits."""
    yield from mutants(text, comment)
    lines = text.splitlines()
    plain = [i for i, line in enumerate(lines) if line.strip() not in ("", "%") and not line.strip().startswith(comment)]
    for i in plain[:-1]:
        if i + 1 in plain and lines[i] != lines[i + 1] and "PGM" not in lines[i] + lines[i + 1]:
            new = [*lines[:i], lines[i + 1], lines[i], *lines[i + 2:]]
            yield Mutant("exchange", i + 1, lines[i], f"{lines[i + 1]} | {lines[i]}", "\n".join(new) + "\n")


def picked(text: str, comment: str, count: int, seed: str) -> list[Mutant]:
    """`count` changes, of every kind as many as can be."""
    kinds: dict[str, list[Mutant]] = {}
    for one in every_change(text, comment):
        kinds.setdefault(one.kind, []).append(one)
    chance = random.Random(f"{SEED} {seed}")
    for found in kinds.values():
        chance.shuffle(found)
    result: list[Mutant] = []
    while len(result) < count and any(kinds.values()):
        for found in kinds.values():
            if found and len(result) < count:
                result.append(found.pop())
    return result


def judged(name: str, count: int = EACH) -> Found:
    """The changes of one program."""
    asked = converted(CASES[name])
    assert asked.ok, [str(d) for d in asked.diagnostics]
    base, plain = short(asked), Effect.of(asked.job, asked.comparison)
    found = Found(name)
    for one in picked(base.text, asked.controller.comment.open.strip(), count, name):
        found.count += 1
        found.kinds[one.kind] += 1
        said = _said(asked, base, plain, one)
        kind, _, what = said.partition(": ")
        if kind == "caught":
            found.caught[what.partition(".")[0]] += 1
        elif kind == "harmless":
            found.harmless[what] += 1
        else:
            found.survivors.append(f"{one}: {what}")
    return found


def _said(asked: Any, base: Made, plain: Effect, one: Mutant) -> str:
    """"caught: CODE", "harmless: why" or "survivor: what it changes"."""
    from postproc.verification.read_back import read_back

    try:
        got = verified(asked, one.text, base.files)
    except Exception as fault:
        return f"survivor: {type(fault).__name__}: {fault}"
    if not got.ok:
        return f"caught: {got.errors[0] if got.errors else 'refused'}"
    assert base.effect is not None and got.effect is not None
    differs = change(base.effect, got.effect)
    if differs:
        warned = [text for text in got.said if "[verify" in text]
        return f"harmless: {WARNED}" if warned else f"survivor: {differs}"
    comparison, _ = read_back(one.text, asked.job, "part.cls",
                              others={n: t.encode() for n, t in base.files.items()})
    apart_ = plain.against(Effect.of(asked.job, comparison)).split()[0]
    return f"harmless: {SAME.get(apart_, 'cuts inside the tolerance, their times, rests and states the same')}"


def all_programs(only: str = "", count: int = EACH) -> list[Found]:
    """Every program, one process for each."""
    result = []
    for name in PROGRAMS:
        if only in name:
            found = apart(lambda name=name: judged(name, count), 1800)
            assert not isinstance(found, str), f"{name}: {found}"
            result.append(found)
            print(f"{name}: {found.count} changes, {len(found.survivors)} survivors", file=sys.stderr, flush=True)
    return result
