"""Random programs of O words, parameters and offsets: what we make of them moves as they themselves do, by LinuxCNC's
own interpreter."""

from __future__ import annotations

from pathlib import Path
from random import Random

import numpy as np
import pytest

from postproc.readback.macros.execution import executed
from postproc.readback.macros.held import Held
from tests.linuxcnc.interpreter import Canonical, Move, ToolEntry, interpret

HEAD = """o<step> sub
#3 = [#1 + #<_shared>]
o1 if [#3 gt 20]
o<step> return [#3 / 2]
o1 elseif [#2 lt 1]
g1 y[#3]
o1 else
g1 x[#3] y-#2
o1 endif
#<mine> = 4
o<step> endsub [#<mine> + #3]
g21 g17 g90 g94 g40 g49 g54 g64
#<_shared> = 1.5
#<here> = 2
f500
g0 x0 y0 z10
"""
TOOLS = {1: ToolEntry(75.5, 6.0), 2: ToolEntry(80.0, 10.0), 3: ToolEntry(60.0, 4.0)}
OPERATORS = ("+", "-", "*", "MOD", "EQ", "NE", "GT", "GE", "LT", "LE", "AND", "OR", "XOR")
FUNCTIONS = ("SIN", "COS", "ABS", "ROUND", "FIX", "FUP", "EXISTS", "ATAN", "SQRT")


def number(rng: Random) -> str:
    return rng.choice((f"{rng.uniform(-9, 9):.3f}", f"{rng.randint(-5, 9)}", f"#{rng.randint(31, 36)}", "#<here>",
                       "#<_shared>"))


def value(rng: Random, depth: int = 1) -> str:
    """A random expression, small."""
    if depth == 0:
        return number(rng)
    kind = rng.random()
    if kind < 0.2:
        name, inner = rng.choice(FUNCTIONS), value(rng, depth - 1)
        if name == "EXISTS":
            return f"EXISTS[#<{rng.choice(('here', 'absent', '_shared'))}>]"
        if name == "ATAN":
            return f"ATAN[{inner}]/[{value(rng, depth - 1)}]"
        return f"SQRT[ABS[{inner}]]" if name == "SQRT" else f"{name}[{inner}]"
    if kind < 0.3 and depth:
        return f"[[2 ** {rng.randint(0, 3)}] / 3]"
    parts = [value(rng, depth - 1)]
    for _ in range(rng.randint(1, 3)):
        sign = rng.choice(OPERATORS)
        parts.append(f"{sign} [{rng.randint(2, 7)}]" if sign == "MOD" else f"{sign} {value(rng, depth - 1)}")
    return "[" + " ".join(parts) + "]"


def small(rng: Random) -> str:
    return f"[{value(rng)} MOD 50]"


def rows(rng: Random, depth: int, label: list[int], counter: list[int], leaves: bool) -> list[str]:
    """Random blocks, loops and branches, with break and continue or with do: behind a break
    LinuxCNC 2.9 runs a do loop once."""
    made = list[str]()
    for _ in range(rng.randint(2, 4)):
        kind = rng.randint(0, 12 if depth else 7)
        label[0] += 1
        o = f"o{label[0]}"
        if kind <= 1:
            made.append(f"g1 x{small(rng)} y{small(rng)}")
        elif kind == 2:
            made.append(f"#{rng.randint(31, 36)}={small(rng)} #<here>={small(rng)}")
        elif kind == 3:
            made.append(f"g91 g{rng.randint(0, 1)} z[[{value(rng)} MOD 3] - 1]\ng90")
        elif kind == 4:
            made.append(f"o<step> call [{small(rng)}] [{small(rng)}]\n#31 = [#<_value> MOD 40]\ng1 x[#31]")
        elif kind == 5:
            made.append(rng.choice((f"g92 x{small(rng)}", "g92.1", f"g52 y{small(rng)}", f"g10 l2 p1 x{small(rng)} y[#5420]",
                                    f"g10 l20 p1 y{small(rng)}", f"g10 l20 p2 x{small(rng)}", "g55\ng0 x1 y2 z3",
                                    "g54\ng0 x1 y2 z3")))
        elif kind == 6:
            made.append(rng.choice((f"g28 z{small(rng)}\ng0 z5", "g91 g28 z0\ng90 z4", "t1 m6\ng43 h1\ng0 z50",
                                    "t2 m6\ng43\ng0 z20", "g49\ng0 z9",
                                    f"g10 l1 p3 z{small(rng)}\ng43 h3\ng0 z50", "g28\ng0 x0 y0 z5")))
        elif kind == 7:
            made.append("g2 x[#5420+2] y#5421 i1 j0\ng1 x[#5420 + #5211] y[#5421-#5212] z#5422")
        elif kind == 8:
            made += [f"{o} if [{value(rng)}]", *rows(rng, depth - 1, label, counter, leaves), f"{o} elseif [{value(rng)}]",
                     *rows(rng, depth - 1, label, counter, leaves), f"{o} else", *rows(rng, depth - 1, label, counter,
                                                                                       leaves), f"{o} endif"]
        elif kind == 9:
            made += [f"{o} repeat [{rng.randint(0, 3)}.4]", *rows(rng, depth - 1, label, counter, leaves), f"{o} endrepeat"]
        else:
            counter[0] += 1
            name = f"#<loop{counter[0]}>"
            out = label[0]
            leave = f"o{out}9 if [{value(rng)} gt 3]\n{o} {rng.choice(('break', 'continue'))}\no{out}9 endif"
            inner = rows(rng, depth - 1, label, counter, leaves)
            body = [f"{name} = [{name} + 1]", *inner, *([leave] if leaves else []), "g1 x[#<here> MOD 7]"]
            ends = f"[{name} lt {rng.randint(1, 3)}]"
            made += [f"{name} = 0", *([f"{o} while {ends}", *body, f"{o} endwhile"] if kind < 12 or leaves else
                                      [f"{o} do", *body, f"{o} while {ends}"])]
    return made


@pytest.mark.parametrize("seed", range(6))
def test_moves_as_the_program_itself(seed: int, tmp_path: Path) -> None:
    rng = Random(seed)
    label, counter = [100], [0]
    text = HEAD + "\n".join(row for _ in range(8) for row in rows(rng, 2, label, counter, seed % 2 == 0)) + "\nm2\n"
    held = Held(("X", "Y", "Z"), np.zeros(3), lambda register: np.zeros(3), {1: 75.5, 2: 80.0, 3: 60.0})
    made, found = executed(text.encode(), "", {}, "linuxcnc", held, lambda data, name: (data, []))
    (tmp_path / "program.ngc").write_text(text)
    theirs = interpret(tmp_path / "program.ngc", TOOLS)
    assert made is not None, (found, theirs.error, text)
    (tmp_path / "plain.ngc").write_bytes(made.text)
    ours = interpret(tmp_path / "plain.ngc", TOOLS)
    assert theirs.error == ours.error == ""
    assert len(theirs) > 8
    us, them = moving(ours), moving(theirs)
    assert ours.kind[us].tolist() == theirs.kind[them].tolist()
    assert np.abs(ours.machine[us] - theirs.machine[them]).max() < 1e-6
    assert ours.feed[us].tolist() == theirs.feed[them].tolist()
    assert made.line[ours.line[us]].tolist() == theirs.line[them].tolist()


def moving(run: Canonical) -> np.ndarray:
    """Indices of arcs, and of straight moves that are longer than nothing."""
    before = np.vstack([np.zeros(9), run.machine[:-1]])
    return np.flatnonzero((np.abs(run.machine - before).max(axis=1) > 1e-9) | (run.kind == Move.ARC))
