"""Text is taken apart where files are read, and nowhere else: what the project says itself is made of values, not parsed."""

from __future__ import annotations

import ast
from collections.abc import Iterable

from tests.source import ROOT, nodes
from tests.test_imports import texts

READERS = {
    "toolpaths.cl": "CL files", "toolpaths.cl.text": "CL files", "toolpaths.cl.systems": "CL files",
    "machines.geometric_error.tables": "CSV tables",
    "machines.exchange": "machine files of others",
    "postproc.controllers": "controller files",
    "postproc.readback.text": "programs", "postproc.readback.dialects": "programs",
    "postproc.readback.macros": "programs",
    "postproc.witness": "CL files and machine files, by itself"}
"""rooms that read text files, and what they read"""
FILES = {
    "toolpaths.pattern": "compiles what the others look for",
    "toolpaths.interrupted_runs": "names of temporary files", "toolpaths.shapes": "tables of shapes",
    "machines.toml_lines": "lines of TOML files", "machines.value_words": "values in TOML files",
    "postproc.certificate_check.check": "boxes of certificates",
    "postproc.certificate_check.chains": "boxes of certificates",
    "postproc.time_fit.log_exports": "logs that others export",
    "machines.sheet.pivot_text": "pivot numbers as controls put them out",
    "machines.sheet.quantity": "figures of data sheets with their units",
    "machines.hooks": "blocks of the shop in machine files and set-ups",
    "machines.serial_models": "structures of machines (ISO 10791-6)",
    "machines.calibration.folded_names": "names of parameters",
    "machines.geometric_error.exchange.imports": "tables of others",
    "postproc.pipeline.native_splines": "words of splines in programs",
    "postproc.pipeline.hooks": "blocks of controller files",
    "postproc.batch.tasks": "names of files that are made up",
    "postproc.reference.records": "blocks of INSERT records",
    "postproc.base.header_words": "headers of programs: written and read in one place",
    "postproc.readback.comparison.hooks": "blocks of the shop in programs",
    "postproc.readback.comparison.slow_moves": "F words of programs",
    "postproc.readback.comparison.stock": "stock stated in programs",
    "postproc.readback.comparison.unstated_codes": "codes of programs",
    "postproc.verification.asked_output": "calls of subprograms, names of programs",
    "postproc.verification.stated_numbers": "numbers in the header of a program",
    "postproc.verification.tool_table_file": "tool tables of controls",
    "postproc.writing.linuxcnc": "comments that LinuxCNC obeys", "postproc.writing.state": "decimals of words",
    "postproc.writing.writer": "labels of blocks"}
"""single files besides"""
SENTENCES = {"message", "why", "refused", "touching", "hint", "text", "reason", "what", "where", "said", "meant"}
"""names under which sentences are held"""
TAKEN_APART = {"startswith", "endswith", "removeprefix", "removesuffix", "partition", "rpartition", "split"}
OF_OTHERS = {("machines.user_file", "partition"), ("machines.user_file", "removeprefix")}
"""messages of the libraries that read TOML and check models"""


def parsed(found: Iterable[ast.AST]) -> set[str]:
    """Methods by which a file takes sentences apart that it has from a value (`x.why.startswith(...)`)."""
    return {node.func.attr for node in found if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
            and node.func.attr in TAKEN_APART and isinstance(node.func.value, ast.Attribute | ast.Name)
            and (node.func.value.attr if isinstance(node.func.value, ast.Attribute) else node.func.value.id) in
            SENTENCES - {"text"}}


def test_regular_expressions_stand_where_files_are_read() -> None:
    users = {name for name, text in texts().items() if {"re", "toolpaths.pattern"} & set(text.imports)}
    outside = {name for name in users if name not in FILES and name.rpartition(".")[0] not in READERS}
    assert outside == set()
    assert set(FILES) - users == set()


def test_no_sentence_is_taken_apart() -> None:
    found = set[tuple[str, str]]()
    for name in texts():
        path = ROOT / (name.replace(".", "/") + ".py")
        if path.exists() and name.rpartition(".")[0] not in READERS:
            found |= {(name, method) for method in parsed(nodes(path))}
    assert found <= OF_OTHERS, found - OF_OTHERS


def test_a_sentence_taken_apart_is_noticed() -> None:
    code = 'a = own.refused.startswith("travel")\nb = why.removeprefix("x")\nc = name.split()'
    assert parsed(ast.walk(ast.parse(code))) == {
        "startswith", "removeprefix"}
