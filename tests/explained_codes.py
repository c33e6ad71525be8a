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
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import get_args

sys.path.insert(0, str(Path(__file__).parents[1]))

from postproc.witness.evidence import FindingCode
from tests import said
from tests.hints.case import example
from tests.hints.cases import CASES
from tests.source import tree, walked
from toolpaths.diagnostics import REPORT

ROOT = Path(__file__).parents[1]
DATA = ROOT / "postproc" / "explain"
CODE = re.compile(r"^[a-z_-]+\.[a-z][a-z0-9_-]*$")
NONE = frozenset({"postproc.controllers", "postproc.cycle_time", "postproc.toml", "bodies.part",
                  "postproc.kinematics", "postproc.cl_dialects", "postproc.cl_readers", "postproc.orientation_criteria",
                  "postproc.report_tabs", "bodies.table", "machine.js", "output.coolant", "output.feed"})
"""texts of that form that are no codes: modules, files, keys of the set-up"""
MADE = {"verify.tip", "verify.axis", "setup.work_offset", "coolant.mist", "coolant.through",
        "coolant.air", "proof.program", "proof.cl_file", "proof.setup", "proof.machine", "proof.controller",
        "proof.error_model", "proof.options", *(f"witness.{found}" for found in get_args(FindingCode))}
"""codes that are put together from an area and what is found"""


FOUND = {found: found for found in get_args(FindingCode)} | {"speed": "spindle"}
"""words of findings in the code, and the codes that they are"""
LEAST = 20
"""characters of a message; shorter texts are names"""
Signature = tuple[str, ...]
"""names of the parameters of a function, self left out"""


def _words(node: ast.AST | None, known: dict[str, str]) -> str:
    """A text with ... for what is filled in; `known` are texts of the module by name."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        return "".join(v.value if isinstance(v, ast.Constant) and isinstance(v.value, str) else _words(
            v.value, known) if isinstance(v, ast.FormattedValue) else "..." for v in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _words(node.left, known) + _words(node.right, known)
    return known.get(node.id, "...") if isinstance(node, ast.Name) else "..."


def _choices(node: ast.AST | None) -> list[ast.AST | None]:
    """Both texts of `a if b else c`."""
    return [*_choices(node.body), *_choices(node.orelse)] if isinstance(node, ast.IfExp) else [node]


def _texts_of(tree: ast.Module) -> dict[str, str]:
    """Texts of a module by name."""
    return {target.id: node.value.value for node in tree.body if isinstance(node, ast.Assign) for target in node.targets
            if isinstance(target, ast.Name) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)}


def _parameters(node: ast.FunctionDef) -> list[str]:
    return [a.arg for a in (*node.args.posonlyargs, *node.args.args) if a.arg != "self"]


def _signatures(trees: Iterable[ast.Module]) -> dict[str, set[Signature]]:
    """Parameters of all functions with a hint, and fields or parameters of classes with one, by name."""
    found: dict[str, set[Signature]] = {}
    for node in (n for one in trees for n in walked(one)):
        names: list[str] = []
        if isinstance(node, ast.FunctionDef):
            names = _parameters(node)
        elif isinstance(node, ast.ClassDef):
            made = next((n for n in node.body if isinstance(n, ast.FunctionDef) and n.name == "__init__"), None)
            names = _parameters(made) if made else [
                n.target.id for n in node.body if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)]
        if "hint" in names:
            found.setdefault(node.name, set()).add(tuple(names))
    return found


def _usual(trees: Iterable[ast.Module]) -> dict[str, ast.Constant]:
    """The hint that a class says where it is given none, by its name."""
    made = ((node.name, n.args, _texts_of(one)) for one in trees for node in one.body if isinstance(node, ast.ClassDef)
            for n in node.body if isinstance(n, ast.FunctionDef) and n.name == "__init__" and n.args.defaults)
    return {name: ast.Constant(text) for name, given, known in made if given.args[-1].arg == "hint"
            and (text := _words(given.defaults[-1], known)).strip(".")}


def _hints(trees: Iterable[ast.Module]) -> Values:
    """What classes say under a name that ends in `hint`."""
    found: Values = {}
    for node in (n for one in trees for n in one.body if isinstance(n, ast.ClassDef)):
        for name, values in _assigned(node.body).items():
            found.setdefault(name, []).extend(values if name.endswith("hint") else [])
    return found


def _functions(trees: Iterable[ast.Module]) -> dict[str, list[ast.FunctionDef]]:
    """Functions that other files may call, by name."""
    found: dict[str, list[ast.FunctionDef]] = {}
    for node in (n for one in trees for n in one.body if isinstance(n, ast.FunctionDef) and not n.name.startswith("_")):
        found.setdefault(node.name, []).append(node)
    return found


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, (ast.JoinedStr, ast.BinOp, ast.IfExp)) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str))


def _given(node: ast.Call, name: str, at: int, signatures: set[Signature]) -> ast.AST | None:
    """The argument of a call that is its message or hint: by keyword, else where a signature with the code at `at` is."""
    keyword = next((w.value for w in node.keywords if w.arg == name), None)
    if keyword is not None:
        return keyword
    for one in sorted(signatures):
        if len(one) > at and one[at] == "code" and name in one and one.index(name) < len(node.args):
            text = one.index("message") if "message" in one else at
            if text >= len(node.args) or text == at or _is_text(node.args[text]):
                return node.args[one.index(name)]
    return None


def _inside(function: ast.AST) -> list[ast.AST]:
    """The nodes that stand in a function, or a file, and in no function inside it."""
    inside, todo = list[ast.AST](), list(ast.iter_child_nodes(function))
    while todo:
        node = todo.pop()
        inside.append(node)
        todo += [] if isinstance(node, ast.FunctionDef) else list(ast.iter_child_nodes(node))
    return inside


Values = dict[str, list[ast.AST]]
"""expressions that statements give to names"""


def _assigned(nodes: Iterable[ast.AST]) -> Values:
    """Names and the values that statements give them, pairs of tuples too."""
    found: Values = {}
    for node in nodes:
        if isinstance(node, (ast.Assign, ast.AnnAssign)) and node.value is not None:
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                if isinstance(target, ast.Name):
                    found.setdefault(target.id, []).append(node.value)
                elif isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                    for one, value in zip(target.elts, node.value.elts, strict=False):
                        found.setdefault(getattr(one, "id", ""), []).append(value)
    return found


class Texts:
    """Where the text of a hint comes from that a call is given by a name, of one file: its functions and names, and
    functions and hints of other files where only one is called so."""

    def __init__(self, one: ast.Module, all_functions: dict[str, list[ast.FunctionDef]], hints: Values) -> None:
        self._own = {n.name: [n] for n in walked(one) if isinstance(n, ast.FunctionDef)}
        self._all, self._hints, self._names = all_functions, hints, _assigned(one.body)

    def of(self, node: ast.AST | None, own: Values, depth: int = 4) -> list[ast.AST]:
        """The texts that an expression may be."""
        if node is None or not depth:
            return []
        if isinstance(node, ast.IfExp):
            return [*self.of(node.body, own, depth), *self.of(node.orelse, own, depth)]
        if isinstance(node, ast.BoolOp):
            return [text for one in node.values for text in self.of(one, own, depth)]
        if isinstance(node, ast.Dict):
            return [text for one in node.values for text in self.of(one, own, depth)]
        if isinstance(node, ast.Name):
            found = own.get(node.id) or self._names.get(node.id, [])
            return [text for one in found for text in self.of(one, {**own, node.id: []}, depth - 1)]
        if isinstance(node, ast.Subscript):
            return self.of(node.value, own, depth)
        if isinstance(node, ast.Attribute):
            return [text for one in self._hints.get(node.attr, []) for text in self.of(one, {}, depth - 1)]
        if isinstance(node, ast.Call):
            return self._returned(node, own, depth)
        return [node] if _is_text(node) else []

    def _returned(self, node: ast.Call, own: Values, depth: int) -> list[ast.AST]:
        if isinstance(node.func, ast.Attribute) and node.func.attr == "get":
            return [text for one in (node.func.value, *node.args[1:]) for text in self.of(one, own, depth)]
        functions = self._own.get(_called(node)) or self._all.get(_called(node), [])
        if len(functions) != 1:
            return []
        inside = _inside(functions[0])
        return [text for n in inside if isinstance(n, ast.Return) for text in self.of(n.value, _assigned(inside), depth - 1)]


def _said(tree: ast.Module, signatures: dict[str, set[Signature]], usual: dict[str, ast.Constant],
          texts: Texts) -> Iterator[tuple[str, str, str]]:
    """(code, message, hint) of a file; texts "" where a code stands by itself."""
    known = {"REPORT": REPORT, **_texts_of(tree)}
    for function in [tree, *(n for n in walked(tree) if isinstance(n, ast.FunctionDef))]:
        inside, own = _inside(function), None
        for node in inside:
            for k, one in enumerate(node.args[:3]) if isinstance(node, ast.Call) else ():
                assert isinstance(node, ast.Call)
                for code in _codes_of(one):
                    own = own or _assigned(inside)
                    signed = signatures.get(_called(node), set())
                    message = _given(node, "message", k, signed) or next(iter(node.args[k + 1:]), None)
                    hint = _given(node, "hint", k, signed) or _behind(node, k) or usual.get(_called(node))
                    for text in texts.of(hint, own) or [hint]:
                        yield code, _words(message, known), _words(text, known)
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and CODE.match(node.value):
                yield node.value, "", ""


def _codes_of(node: ast.AST) -> list[str]:
    """The code that an argument is, or the codes of which it may be one: put together from an area and what is found."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str) and CODE.match(node.value):
        return [node.value]
    if isinstance(node, ast.IfExp):
        return [*_codes_of(node.body), *_codes_of(node.orelse)]
    if isinstance(node, ast.JoinedStr) and len(node.values) == 2 and isinstance(node.values[0], ast.Constant):
        area = str(node.values[0].value)
        return sorted(code for code in MADE if "." in area and code.startswith(area))
    return []


def _behind(node: ast.Call, at: int) -> ast.AST | None:
    """The text behind code, message and lines, where the call goes to a function that is itself given."""
    return next((arg for arg in node.args[at + 2:] if _is_text(arg)), None)


def _found(node: ast.AST) -> Iterator[tuple[str, str, str]]:
    """What the second witness finds, where it says so: a code without its area, and a message behind it."""
    given = node.args if isinstance(node, ast.Call) else node.elts if isinstance(node, ast.Tuple) else []
    for one, then in itertools.pairwise(given):
        said = re.sub("{[0-9]}", "...", _words(then, {}))
        if isinstance(one, ast.Constant) and one.value in FOUND and len(said) > LEAST:
            yield f"witness.{FOUND[one.value]}", f"second witness: {said}", "do not run this program"


SAYS = frozenset({"error", "warning", "info", "fault", "problem", "KeyProblem", "Diagnostic", "note", "warn", "many", "add",
                  "MacroFault"})
"""names of calls that make a diagnostic"""


@cache
def _trees(*rooms: str) -> list[ast.Module]:
    return [tree(path) for top in rooms or ("toolpaths", "machines", "postproc")
            for path in sorted((ROOT / top).rglob("*.py"))]


def _called(node: ast.Call) -> str:
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


def said_codes() -> set[str]:
    """Codes that stand in the calls that make diagnostics, whatever their area."""
    calls = [n for one in _trees() for n in walked(one) if isinstance(n, ast.Call)]
    return {one.value for n in calls if _called(n) in SAYS
            for one in n.args[:3] if isinstance(one, ast.Constant) and isinstance(one.value, str) and CODE.match(one.value)}


@cache
def codes(*, with_said: bool = True) -> dict[str, dict[str, list[str]]]:
    """Messages and remedies by code, in order; examples of cases of hints and of bad files, then those of `said.toml`."""
    areas = frozenset(tomllib.loads((DATA / "areas.toml").read_text("utf-8")))
    found: dict[str, dict[str, list[str]]] = {code: {"messages": [], "remedies": []} for code in MADE}
    trees = _trees()
    signatures, usual, hints = _signatures(trees), _usual(trees), _hints(trees)
    functions = _functions(trees)
    found_by_witness = (said for one in _trees("postproc/witness") for node in walked(one) for said in _found(node))
    for code, message, hint in itertools.chain((each for one in trees for each in _said(
        one, signatures, usual, Texts(one, functions, hints))),
                                               found_by_witness):
        if code in NONE or code.split(".")[0] not in areas:
            continue
        one = found.setdefault(code, {"messages": [], "remedies": []})
        for text, kept in ((message, one["messages"]), (hint, one["remedies"])):
            text = " ".join(text.split())
            if text.strip(". ") and text not in kept:
                kept.append(text)
    for case in CASES:
        text = example(case)
        if text and case.code in found:
            found[case.code].setdefault("example", [text])
    for file in sorted((ROOT / "tests" / "bad").glob("*.*")):
        first, _, rest = file.read_bytes().decode("latin-1").partition("\n")
        expected = re.search(r"expect: \w+ (\S+)", first)
        if expected and expected[1] in found and len(rest) < 400 and rest.isascii() and all(
                c.isprintable() or c == "\n" for c in rest):
            found[expected[1]].setdefault("example", [rest.strip()])
    for code, kept in said.said().items() if with_said else ():
        if code in found:
            found[code].setdefault("example", [said.shown(kept)])
            found[code]["remedies"] += [" ".join(hint.split()) for hint in (kept.get("hint", ""),)
                                        if hint and not found[code]["remedies"]]
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
