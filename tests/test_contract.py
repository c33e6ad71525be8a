"""One contract for machines: no code outside a kind's own files asks which concrete kind a machine has."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import get_args

import pytest

import machines
from machines.kinds import BUILT_IN
from postproc.controllers.model import WriterName
from tests.source import ROOT, nodes, product

OWN_FILES = "machines/kinematics/"
"""where the kinds are; their models in machine files are chosen by `machines/kinds.py`"""
WITNESS = "postproc/witness/"
"""shares no code: it reads the kinds of machine files itself, and has no kinematics of the project"""


@cache
def concrete_kinds() -> set[str]:
    """Names of all classes that derive from Kinematics, however far."""
    bases = {node.name: {ast.unparse(base).rpartition(".")[2] for base in node.bases}
             for path in product() for node in nodes(path) if isinstance(node, ast.ClassDef)}
    kinds, before = {"Kinematics"}, 0
    while len(kinds) > before:
        before = len(kinds)
        kinds |= {name for name, above in bases.items() if above & kinds}
    return kinds - {"Kinematics"}


DIALECTS = ("controller.writer", "spec.writer", "dialect.name")
"""what a controller file and a CL file are written in"""


def asks_for_a_dialect(found: Iterable[ast.AST]) -> Iterator[str]:
    """Places that compare a dialect with words; where it is looked up in a table is a registry."""
    for node in found:
        sides = (node.left, *node.comparators) if isinstance(node, ast.Compare) else ()
        if any(ast.unparse(side).endswith(DIALECTS) for side in sides):
            yield ast.unparse(node)


def test_each_dialect_has_its_line_in_every_table_of_dialects() -> None:
    """Writer, reader, form of tool tables: a table without a dialect would end in a KeyError where it is asked."""
    tables = {path.relative_to(ROOT).as_posix(): {ast.literal_eval(key) for key in node.value.keys if key is not None}
              for path in product() for node in nodes(path) if isinstance(node, ast.AnnAssign)
              and isinstance(node.value, ast.Dict) and ast.unparse(node.annotation).startswith("dict[WriterName, ")}
    assert len(tables) == 3 and all(names == set(get_args(WriterName)) for names in tables.values()), tables


def test_what_dialects_differ_in_is_data() -> None:
    """Of controls: keys of their files; of CL files: fields of `Dialect`. The second witness shares neither."""
    files = {path.relative_to(ROOT).as_posix(): path for path in product()}
    assert [f"{file}: {text}" for file, path in files.items() if not file.startswith(WITNESS)
            for text in asks_for_a_dialect(nodes(path))] == []


@pytest.mark.parametrize("text", ["controller.writer == 'linuxcnc'", "self.controller.writer in ('iso', 'haas')",
                                  "b.dialect.name != 'catia'"])
def test_asking_for_a_dialect_is_noticed(text: str) -> None:
    assert list(asks_for_a_dialect(ast.walk(ast.parse(text))))


def names_in(nodes: list[ast.expr]) -> set[str]:
    return {leaf.id if isinstance(leaf, ast.Name) else leaf.attr for node in nodes for leaf in ast.walk(node)
            if isinstance(leaf, ast.Name | ast.Attribute)}


def of_kinematics(call: ast.Call) -> bool:
    """True where the first argument of a call is called after a kinematics."""
    return any("kin" in name.lower() for name in names_in(call.args[:1]))


def asks(found: Iterable[ast.AST]) -> Iterator[str]:
    """Places that ask for a concrete kind: by its class, by what attributes it has, by the word of its machine file."""
    for node in found:
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id in ("isinstance", "issubclass") and names_in(node.args[1:]) & concrete_kinds():
                yield ast.unparse(node)
            if node.func.id in ("hasattr", "getattr") and of_kinematics(node):
                yield ast.unparse(node)
        elif isinstance(node, ast.MatchClass) and names_in([node.cls]) & concrete_kinds():
            yield ast.unparse(node)
        elif isinstance(node, ast.Compare):
            sides = (node.left, *node.comparators)
            words = {side.value for side in sides if isinstance(side, ast.Constant)}
            types = [side for side in sides if isinstance(side, ast.Call) and names_in([side.func]) == {"type"}]
            if words & set(BUILT_IN) or any(of_kinematics(side) for side in types):
                yield ast.unparse(node)
        elif isinstance(node, ast.Attribute) and node.attr == "slides_affine":
            yield ast.unparse(node)


def test_nothing_asks_for_a_concrete_kind() -> None:
    files = {path.relative_to(ROOT).as_posix(): path for path in product()}
    assert [f"{file}: {text}" for file, path in files.items() if not file.startswith((OWN_FILES, WITNESS))
            for text in asks(nodes(path))] == []


def test_the_kinds_are_known() -> None:
    """Those that machine files build are among what is looked for, with what stands between them and the contract."""
    built = {type(machines.load(name).kinematics).__name__ for name in machines.names()}
    assert built <= concrete_kinds() and {"PosesOfLegs", "ActualKinematics"} <= concrete_kinds()


@pytest.mark.parametrize("text", [
    "isinstance(kin, Serial)", "isinstance(machine.kinematics, OnLegs | on.LegsWithAxis)", "hasattr(kinematics, 'rig')",
    "type(machine.kinematics) is Serial", "getattr(kin, 'sense', 1.0)", "model.kind == 'serial'", "kin.slides_affine"])
def test_an_asking_is_noticed(text: str) -> None:
    assert list(asks(ast.walk(ast.parse(text))))


def test_the_sample_has_no_more_lines_than_it_is_said_to_have() -> None:
    assert len(Path(ROOT / "samples/my_machine.py").read_text().splitlines()) <= 40
