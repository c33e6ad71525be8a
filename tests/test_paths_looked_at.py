"""Whether a user's file is there is asked where a folder that may not be looked into is no exception."""

from __future__ import annotations

import ast

from tests.source import ROOT, product

ASKS = {"exists", "is_file", "is_dir", "stat", "resolve"}
OWN = {"toolpaths/input_files.py", "toolpaths/interrupted_runs.py", "toolpaths/transaction.py"}
"""the rooms' own: those that never raise, and what looks after the outputs, whose faults are worded there"""
BESIDE_PACKAGE = {"__file__"}
"""paths of the package itself"""


def bare(text: str) -> list[int]:
    """Lines that ask a path outside a `try` that takes OSError."""
    if not any(f".{name}(" in text for name in ASKS):
        return []
    tree = ast.parse(text)
    held = {id(inner) for node in ast.walk(tree) if isinstance(node, ast.Try) and any(
        "OSError" in ast.unparse(h.type) for h in node.handlers if h.type) for part in node.body for inner in ast.walk(part)}
    return [node.lineno for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
            and node.func.attr in ASKS and not node.args and id(node) not in held
            and not any(name in ast.unparse(node.func) for name in BESIDE_PACKAGE)]


def test_no_path_of_a_user_is_asked_without_care() -> None:
    found = {str(path.relative_to(ROOT)): lines for path in product() if (lines := bare(path.read_text("utf-8")))}
    assert {name: lines for name, lines in found.items() if name not in OWN} == {}


def test_a_bare_question_is_noticed() -> None:
    assert bare("def f(p):\n    return p.exists()\n") == [2]
    assert bare("def f(p):\n    try:\n        return p.exists()\n    except OSError:\n        return False\n") == []
