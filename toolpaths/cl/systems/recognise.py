"""Which of the forms of `systems` a file is, by its first bytes or as asked for, and its statements."""

from __future__ import annotations

import re

from toolpaths.choices import DialectName
from toolpaths.cl.systems.as_statements import EXPORTED, AsStatements
from toolpaths.cl.systems.shop_forms import ShopText
from toolpaths.cl.text.log import DiagnosticLog
from toolpaths.cl.text.scan import Points
from toolpaths.cl.text.source import text_of
from toolpaths.cl.text.statements import StatementList
from toolpaths.dataclass import dataclass

FORMS: tuple[DialectName, ...] = ("nci", "freecad", "step-nc")
"""dialects that are no APT text"""
_HEAD = 20_000
"""bytes that are looked at"""
_NUMBER = rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_NCI = re.compile(rb"\s*\d{1,5}[ \t]*\r?\n[ \t]*" + _NUMBER + rb"(?:[ \t]+[^\s/]+)*[ \t]*\r?\n\s*\d{1,5}[ \t]*\r?\n")
"""a code alone in its line, its values (no /, as records have) in the next, again a code"""


@dataclass(frozen=True)
class Form:
    """A file of another form: which it is, by what that was seen, its statements, points and count of lines."""

    name: DialectName
    evidence: str
    program: StatementList
    points: Points
    lines: int


def recognised(data: bytes) -> tuple[DialectName, str] | None:
    """(form, evidence) by the first bytes; None for APT text and all else."""
    head = data[:_HEAD]
    if EXPORTED.encode() in head[:400] and b"GOTO" not in head:
        return "freecad", EXPORTED
    if head.lstrip().startswith(b"ISO-10303-21") and b"MACHINING_WORKINGSTEP" in data and b"MACHINING_WORKPLAN" not in data:
        return "step-nc", "MACHINING_WORKINGSTEP of ISO 14649"
    if _NCI.match(head):
        return "nci", "codes and parameters in turns"
    return None


def read_form(plain: bytes, given: DialectName | None, log: DiagnosticLog) -> Form | None:
    """A file of one of the forms as statements; None where it is APT text.

    Args:
        plain: with LF line ends
        given: the dialect that was asked for
    """
    found = recognised(plain) if given is None else (given, "given")
    if found is None or found[0] not in FORMS:
        return None
    text = text_of(plain)
    said = _said(found[0], text, log)
    return Form(*found, said.program, said.points(), plain.count(b"\n") + (not plain.endswith(b"\n")))


def _said(form: DialectName, text: str, log: DiagnosticLog) -> AsStatements:
    """A text of one of the forms, by its reader; all are imported where a file needs one."""
    from toolpaths.cl.systems.freecad import FreeCadReader
    from toolpaths.cl.systems.nci import NciReader
    from toolpaths.cl.systems.step_nc import StepNcReader

    if form == "nci":
        return NciReader(log).read(text)
    return (FreeCadReader if form == "freecad" else StepNcReader)(text, log).read()


def shop_form(shop: ShopText, data: bytes) -> Form:
    """A file of whose records an installed package has made statements; `data`: its bytes, for the count of its lines."""
    said = shop.statements()
    ends = max(data.count(b"\n"), data.count(b"\r"))
    return Form(shop.like, shop.evidence, said.program, said.points(), ends + (not data.endswith((b"\n", b"\r"))))
