"""Codes of all diagnostics in the source, with message and remedy as they are written there: `codes.toml` of `explain`.

    python tests/explained_codes.py        writes postproc/explain/codes.toml
"""

from __future__ import annotations

import ast
import itertools
import json
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

from postproc.witness.evidence import FindingCode

ROOT = Path(__file__).parents[1]
DATA = ROOT / "postproc" / "explain"
CODE = re.compile(r"^[a-z_]+\.[a-z][a-z0-9_-]*$")
NONE = frozenset({"postproc.controllers", "postproc.cycle_time", "postproc.kinematics", "postproc.toml", "bodies.part",
                  "bodies.table", "output.coolant", "output.feed"})
"""texts of that form that are no codes: modules, files, keys of the set-up"""
MADE = {"verify.tip", "verify.axis", "setup.work_offset", "coolant.off", "coolant.flood", "coolant.mist", "coolant.through",
        "coolant.air", "proof.program", "proof.cl_file", "proof.setup", "proof.machine", "proof.controller",
        "proof.error_model", "proof.options", "proof.postproc", *(f"witness.{found}" for found in get_args(FindingCode))}
"""codes that are put together from an area and what is found"""


FOUND = {found: found for found in get_args(FindingCode)} | {"speed": "spindle"}
"""words of findings in the code, and the codes that they are"""
LEAST = 20
"""characters of a message; shorter texts are names"""


def _words(node: ast.AST | None) -> str:
    """A text with ... for what is filled in."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        return "".join(v.value if isinstance(v, ast.Constant) and isinstance(v.value, str) else "..." for v in node.values)
    if isinstance(node, ast.BinOp):
        return _words(node.left) + _words(node.right)
    return "..."


def _said(path: Path, areas: frozenset[str]) -> Iterator[tuple[str, str, str]]:
    """(code, message, hint) of a file; texts "" where a code stands by itself."""
    tree = ast.parse(path.read_text("utf-8"))
    for node in ast.walk(tree):
        for k, one in enumerate(node.args[:3]) if isinstance(node, ast.Call) else ():
            if isinstance(one, ast.Constant) and isinstance(one.value, str) and CODE.match(one.value):
                assert isinstance(node, ast.Call)
                hint = next((_words(w.value) for w in node.keywords if w.arg == "hint"), "")
                yield one.value, _words(node.args[k + 1]) if k + 1 < len(node.args) else "", hint
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and CODE.match(node.value):
            yield node.value, "", ""
        if path.parent.name == "witness":
            yield from _found(node)


def _found(node: ast.AST) -> Iterator[tuple[str, str, str]]:
    """What the second witness finds, where it says so: a code without its area, and a message behind it."""
    given = node.args if isinstance(node, ast.Call) else node.elts if isinstance(node, ast.Tuple) else []
    for one, then in itertools.pairwise(given):
        said = re.sub("{[0-9]}", "...", _words(then))
        if isinstance(one, ast.Constant) and one.value in FOUND and len(said) > LEAST:
            yield f"witness.{FOUND[one.value]}", f"second witness: {said}", "do not run this program"


def codes() -> dict[str, dict[str, list[str]]]:
    """Messages and remedies by code, in order."""
    areas = frozenset(tomllib.loads((DATA / "areas.toml").read_text("utf-8")))
    found: dict[str, dict[str, list[str]]] = {code: {"messages": [], "remedies": []} for code in MADE}
    for top in ("toolpaths", "machines", "postproc"):
        for path in sorted((ROOT / top).rglob("*.py")):
            for code, message, hint in _said(path, areas):
                if code in NONE or code.split(".")[0] not in areas:
                    continue
                one = found.setdefault(code, {"messages": [], "remedies": []})
                for text, kept in ((message, one["messages"]), (hint, one["remedies"])):
                    text = " ".join(text.split())
                    if text.strip(". ") and text not in kept:
                        kept.append(text)
    for file in sorted((ROOT / "tests" / "bad").glob("*.*")):
        first, _, rest = file.read_bytes().decode("latin-1").partition("\n")
        said = re.search(r"expect: \w+ (\S+)", first)
        if said and said[1] in found and len(rest) < 400 and rest.isascii() and all(
                c.isprintable() or c == "\n" for c in rest):
            found[said[1]].setdefault("example", [rest.strip()])
    return dict(sorted(found.items()))


def text() -> str:
    """The file."""
    lines = ["# Written by tests/explained_codes.py from the source: messages and remedies of each code, an example."]
    for code, one in codes().items():
        lines.append(f'\n["{code}"]')
        lines += [f"{key} = {json.dumps(values if key != 'example' else values[0], ensure_ascii=False)}"
                  for key, values in one.items()]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    (DATA / "codes.toml").write_text(text(), "utf-8")
    sys.stdout.write(f"{len(codes())} codes\n")
