"""What is chosen from a closed list of words is a Literal, from the command line inwards; `str` is text, not compared."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from typing import get_args

import pytest

from postproc.base.options import FeedModeChoice, FeedSource, Orientation, OutputMode
from postproc.cli.app import app
from postproc.pipeline.result import StageName
from postproc.pipeline.stages import STAGES
from tests.source import ROOT, product, tree, walked
from toolpaths.choices import CycleKind, DialectName
from toolpaths.cl.cycle_words import KINDS
from toolpaths.cl.text.dialects import DIALECTS

TEXT = {"str", "str | None"}
FROM_FILES = {
    "toolpaths/cl/": "words of CL records", "postproc/readback/": "words of programs",
    "postproc/reference/": "words of CL records", "postproc/compile/": "words of CL records",
    "postproc/certificate_check/": "words of machine files and certificates",
    "postproc/witness/": "words of CL records and programs", "machines/toml_lines.py": "characters of TOML files",
    "machines/geometric_error/tables/": "characters of CSV tables, letters of names",
    "machines/geometric_error/files/": "letters of names of parameters",
    "machines/geometric_error/exchange/imports.py": "letters of axes", "machines/serial_models.py": "letters of axes",
    "machines/exchange/": "words of files of others",
    "machines/slider_models.py": "names of LinuxCNC's modules"}
"""texts that others wrote; what is made of them is a Literal"""
WORDS_OF_FILES = {"Event.word", "Statement.major", "Statement.body", "Record.major", "Record.body", "DialectStatement.name",
                  "Instance.name", "Word.letter", "KinematicsRow.axis"}
"""fields that hold them"""
OTHERS = {
    ("machines/value_words.py", "kind"): "pydantic's names of faults",
    ("machines/user_file.py", "_Fault.kind"): "pydantic's names of faults",
    ("postproc/cli/shared/console.py", "target"): "a file, or - for standard output"}


@cache
def trees() -> dict[str, ast.Module]:
    return {path.relative_to(ROOT).as_posix(): tree(path) for path in product()}


@cache
def texts_of_classes() -> dict[str, set[str]]:
    """Fields and properties that are `str`, by class."""
    found: dict[str, set[str]] = {}
    for file in trees().values():
        for node in walked(file):
            if isinstance(node, ast.ClassDef):
                found.setdefault(node.name, set()).update(texts_of(node))
    return found


def texts_of(cls: ast.ClassDef) -> set[str]:
    fields = {item.target.id for item in cls.body if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)
              and ast.unparse(item.annotation) in TEXT}
    return fields | {item.name for item in cls.body if isinstance(item, ast.FunctionDef) and item.returns is not None
                     and ast.unparse(item.returns) in TEXT and item.decorator_list}


def words_in(node: ast.expr) -> set[str]:
    """Words that are written there; nothing that is empty, a sign or a letter of an axis among them."""
    parts = node.elts if isinstance(node, ast.Tuple | ast.Set | ast.List) else [node]
    return {part.value for part in parts if isinstance(part, ast.Constant) and isinstance(part.value, str) and part.value}


def compared(module: ast.Module, classes: dict[str, set[str]]) -> Iterator[str]:
    """Parameters that are `str`, and fields that are (`Class.field`), where they are compared with words."""
    for outer in walked(module):
        if not isinstance(outer, ast.ClassDef | ast.Module):
            continue
        for function in [item for item in outer.body if isinstance(item, ast.FunctionDef)]:
            given = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
            comparisons = [node for node in walked(function) if isinstance(node, ast.Compare)]
            if not comparisons:
                continue
            kinds = {arg.arg: ast.unparse(arg.annotation) for arg in given if arg.annotation is not None}
            if isinstance(outer, ast.ClassDef) and given:
                kinds[given[0].arg] = outer.name
            for node in comparisons:
                yield from of_comparison(node, kinds, classes)


def of_comparison(node: ast.Compare, kinds: dict[str, str], classes: dict[str, set[str]]) -> Iterator[str]:
    sides = [node.left, *node.comparators]
    contained = isinstance(node.ops[0], ast.In | ast.NotIn) and not isinstance(sides[-1], ast.Tuple | ast.Set | ast.List)
    if contained or not any(words_in(side) for side in sides):
        return
    for side in sides:
        if isinstance(side, ast.Name) and kinds.get(side.id) in TEXT:
            yield side.id
        if isinstance(side, ast.Attribute) and isinstance(side.value, ast.Name) and side.attr in classes.get(
                kinds.get(side.value.id, "").removesuffix(" | None"), ()):
            yield f"{kinds[side.value.id].removesuffix(' | None')}.{side.attr}"


def test_no_text_is_compared_with_words() -> None:
    found = {(file, name) for file, module in trees().items() if not file.startswith(tuple(FROM_FILES))
             for name in compared(module, texts_of_classes()) if name not in WORDS_OF_FILES}
    assert found - set(OTHERS) == set()
    assert set(OTHERS) - found == set(), "no longer there"


def test_in_rooms_of_texts_only_texts_are_compared() -> None:
    """Where words of files are read, what is made of them is closed all the same: fields are Literals."""
    found = {name for file, module in trees().items() if file.startswith(tuple(FROM_FILES)) and "/witness/" not in file
             for name in compared(module, texts_of_classes()) if "." in name}
    assert found - WORDS_OF_FILES == set()


@pytest.mark.parametrize("text", [
    'def f(mode: str):\n    return mode == "axes"', 'def f(*, mode: str | None):\n    return mode not in ("axes", "tcp")',
    'class A:\n    kind: str\n    def f(self):\n        return "a" != self.kind',
    'def f(cycle: A):\n    return cycle.kind == "x"'])
def test_a_comparison_is_noticed(text: str) -> None:
    assert list(compared(ast.parse(text), {"A": {"kind"}}))


@pytest.mark.parametrize("text", [
    'def f(mode: Mode):\n    return mode == "axes"', 'def f(name: str):\n    return name == ""',
    'def f(name: str):\n    return "/" in name', 'def f(name: str, other: str):\n    return name == other'])
def test_others_are_none(text: str) -> None:
    assert not list(compared(ast.parse(text), {}))


def test_lists_of_words_are_those_of_what_they_name() -> None:
    assert get_args(StageName) == tuple(stage.name for stage in STAGES)
    assert get_args(DialectName) == tuple(DIALECTS)
    assert set(get_args(CycleKind)) == set(KINDS.values())


@pytest.mark.parametrize(("command", "option", "words"), [
    ("convert", "--orient", Orientation), ("convert", "--feed", FeedSource), ("convert", "--feed-mode", FeedModeChoice),
    ("convert", "--output-mode", OutputMode), ("orient", "--orient", Orientation), ("place", "--orient", Orientation),
    ("verify", "--orient", Orientation), ("trace", "--orient", Orientation), ("time", "--dialect", DialectName)])
def test_help_shows_the_words_that_an_option_takes(command: str, option: str, words: object) -> None:
    import typer

    root = typer.main.get_command(app)
    taken = {name: p for p in root.commands[command].params for name in p.opts}
    shown = taken[option].metavar if taken[option].metavar.startswith("{") else taken[option].help
    assert f"{{{','.join(get_args(words))}}}" == shown or shown.endswith(f": {', '.join(get_args(words))}")
