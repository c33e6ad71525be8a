"""Loops that are interpreted or compiled: one text, one helper, the same bits; what still has a second form, and why."""

from __future__ import annotations

import ast
import math
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.source import ROOT, nodes, product
from toolpaths import compiled as module
from toolpaths.compiled import chosen, compiled, loop, wanted

FILES = {path.relative_to(ROOT).as_posix(): path for path in product()}
JIT = "toolpaths/compiled.py"
WITNESS = "postproc/witness/loops.py"
"""shares no code with the rest, not even this"""
AT_ONCE = {
    "machines/geometric_error/actual/actual_chain_loop.py", "machines/geometric_error/actual/rods.py",
    "machines/geometric_error/tables/curve_banks.py",
    "machines/kinematics/chain_loop.py", "postproc/collision/search.py",
    "postproc/feedrate/interior_packed.py", "postproc/feedrate/paths.py", "postproc/feedrate/profile.py",
    "postproc/feedrate/slowdown.py", "postproc/feedrate/tightening.py",
    "postproc/path/coarse_bound.py", "postproc/readback/execution/frames_loop.py", "postproc/readback/text/word_loop.py",
    "postproc/writing/block_text.py", "toolpaths/cl/text/goto_loop.py", "toolpaths/smoothing/sweep.py",
}
"""Small inputs are done by numpy or scipy, all points at once, and nobody is to wait for a compiler over a
small file. The loops interpreted take, of the same small inputs (`python tests/benchmarks/bench_interpreted.py`): rods.py
51 times as long (300 poses: 93 ms for 1.8), chain_loop.py 78 times (300 poses: 4 ms for 0.05; 300 tips: 33 times),
actual_chain_loop.py 39 times (25 ms for 0.65), curve_banks.py 41 times (300 positions), frames_loop.py 46 times (300 points:
0.9 ms for 0.02), search.py 15 times
(5 moves: 2.7 s for 0.18), interior_packed.py 45 to 68 times (256 knots: 0.6 s for 0.013), paths.py 118 to 130 times,
tightening.py 23 to 31 times, sweep.py 35 times; goto_loop.py, word_loop.py and block_text.py go
through characters one by one, some hundred times; coarse_bound.py is asked of long curves alone, profile.py of many
times at once, slowdown.py where the planner's other loops are compiled already. `numeric` tests compare
both forms."""
BY_ARGUMENT = {"postproc/feedrate/second_order.py", "postproc/orientation/candidates/ranking.py"}
"""The caller says whether to compile, for several loops together."""


@loop
def half(x: Any) -> Any:
    return 0.5 * x


@loop
def halves(values: Any, out: Any) -> Any:
    for i in range(len(values)):
        out[i] = half(values[i]) + math.sqrt(values[i])
    return out


@loop(alone=True, takes=(("float64", 2), ("float64", 0)))
def above(rows: Any, limit: Any) -> Any:
    found = 0
    for i in range(rows.shape[0]):
        found += rows[i, 0] > limit
    return found


def imported(found: Iterable[ast.AST]) -> set[str]:
    names = set[str]()
    for node in found:
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module.split(".")[0])
    return names


def calls(path: Path, name: str) -> bool:
    return any(isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == name
               for node in nodes(path))


def test_one_file_imports_the_compiler() -> None:
    assert {file for file, path in FILES.items() if "numba" in imported(nodes(path))} == {JIT, WITNESS}
    assert "numba" in imported(ast.walk(ast.parse("def f():\n    from numba.core import types")))


def test_loops_are_interpreted_or_compiled_but_for_a_list() -> None:
    users = {file for file, path in FILES.items() if "toolpaths.compiled" in path.read_text("utf-8")}
    one_form = {file for file in users if calls(FILES[file], "chosen")}
    two_forms = {file for file in users if calls(FILES[file], "compiled")}
    assert len(one_form) >= 6 and one_form & two_forms == set()
    assert two_forms == AT_ONCE | BY_ARGUMENT


@pytest.mark.numeric
def test_a_loop_compiled_gives_the_bits_of_the_loop_as_it_stands() -> None:
    values = np.random.default_rng(1).uniform(0.0, 9.0, 500)
    np.testing.assert_array_equal(compiled(halves)(values, np.empty(500)), halves(values, np.empty(500)))
    assert type(compiled(half)).__name__ == "CPUDispatcher" and type(half).__name__ == type(halves).__name__ == "function"


@pytest.mark.numeric
def test_one_compiled_form_takes_arrays_of_any_layout() -> None:
    rows = np.arange(12.0).reshape(4, 3)
    fast: Any = compiled(above)
    assert [int(fast(each, 2.5)) for each in (rows, rows[:, ::-1], np.broadcast_to(rows[0], (5, 3)))] == [3, 3, 0]
    assert len(fast.signatures) == 1


def test_compiling_waits_until_it_pays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_made", {})
    monkeypatch.setattr(module, "_shared", [])
    monkeypatch.setattr(module, "_by_numba", lambda function, how: lambda *given: ("fast", function(*given)))
    assert chosen(half, 9, 10)(3.0) == 1.5 and not wanted(9, 10)
    assert chosen(above, 10, 10)(np.ones((2, 1)), 0.0) == ("fast", 2)
    assert not wanted(1, 10) and wanted(1, 10, above) and not wanted(1, 10, half)
    assert chosen(half, 10, 10)(3.0) == ("fast", 1.5) and chosen(half, 1, 10)(3.0) == ("fast", 1.5)
    assert wanted(1, 10)
    monkeypatch.setattr(module, "available", lambda: False)
    assert not wanted(99, 10) and chosen(half, 99, 10) is half


def test_marking_loops_does_not_load_the_compiler() -> None:
    code = ("import sys, postproc.collision.kernel, postproc.feedrate.kernels.interior\n"
            "import postproc.correction.backlash_steps_loop\n"
            "import toolpaths.compiled as c; assert 'numba' not in sys.modules")
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)
