"""Errors of the CL reader say what to do; that it helps is held by `tests/hints`."""

from __future__ import annotations

import ast
from pathlib import Path

import toolpaths
from toolpaths.diagnostics import Severity

ROOT = Path(__file__).parents[3]
IN_MESSAGE = {"arrays.value"}
"""what is said of arrays in Python: no command leads there, and the remedy ends the message (`test_given_arrays.py`)"""


def calls(path: Path) -> list[tuple[int, str]]:
    """(line, code) of errors of a file that give no hint."""
    result = []
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if not isinstance(node, ast.Call):
            continue
        of_log = isinstance(node.func, ast.Attribute) and node.func.attr == "error"
        alone = isinstance(node.func, ast.Name) and node.func.id == "error"
        hint = [k.value for k in node.keywords if k.arg == "hint"] + (node.args[3:4] if of_log else [])
        empty = not hint or (isinstance(hint[0], ast.Constant) and not hint[0].value)
        if (of_log or alone) and empty and node.args and isinstance(node.args[0], ast.Constant):
            result.append((node.lineno, str(node.args[0].value)))
    return result


def test_no_error_without_a_hint() -> None:
    bare = {f"{path.relative_to(ROOT)}:{line}": code for path in sorted((ROOT / "toolpaths").rglob("*.py"))
            for line, code in calls(path)}
    assert {place: code for place, code in bare.items() if code not in IN_MESSAGE} == {}


def test_an_error_without_a_hint_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text('b.log.error("cl.x", "wrong", 3)\nerror("y", "bad", file="f")\n'
                                   'b.log.error("z", "wrong", 3, "do this")\n')
    assert calls(tmp_path / "a.py") == [(1, "cl.x"), (2, "y")]


def test_other_advice_is_another_line_and_one_cause_is_one() -> None:
    """A cycle without plane and depth hid the second behind the first; units that are none were also said to be missing."""
    head = "UNITS/MM\nLOADTL/1\nFEDRAT/300,MMPM\n"
    for text, codes in ((head + "CYCLE/DRILL,MMPM,100\nGOTO/3,3,0\nGOTO/4,3,0\nCYCLE/OFF\n", ["cl.cycle-value"] * 2),
                        (head.replace("MM", "CM", 1) + "GOTO/1,2,3\n", ["cl.units"]),
                        (head + "GOTO/1;2;3\n" * 9, ["cl.number"])):
        found = toolpaths.read_bytes(text.encode())[1]
        assert [d.code for d in found if d.severity > Severity.INFO] == codes, [str(d) for d in found]
