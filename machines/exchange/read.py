"""Which form a file has, and the machine that it describes."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from machines.exchange.choices import GivenForm, MachineForm
from machines.exchange.draft import Draft, finish
from machines.exchange.freecad import read_freecad
from machines.exchange.fusion import read_fusion
from machines.exchange.fusion_xml import read_fusion_xml
from machines.exchange.heidenhain import is_description_table, read_heidenhain
from machines.exchange.linuxcnc_ini import read_linuxcnc
from machines.exchange.siemens import read_siemens
from machines.machine import Machine
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.input_files import advice, read_input, reason

_READERS: dict[MachineForm, Callable[[Path, str, Sequence[str]], tuple[Draft, dict[str, bool]]]] = {
    "linuxcnc-ini": read_linuxcnc, "siemens": read_siemens, "freecad": read_freecad, "fusion": read_fusion,
    "fusion-xml": read_fusion_xml, "heidenhain": read_heidenhain}
_UNPUBLISHED = (
    (r"\bCfgKin\w*", "kinematics of a later TNC as configuration data ({found}): how the control writes them is not "
                     "published"),
    (r"\bMP\s?75\d\d\b", "kinematics of an older TNC as machine parameters ({found}): they are not read"),
    (r"(?i)\w*kinematic\w*", "kinematics in a form that is not known here ({found})"))
"""of HEIDENHAIN: what it is known by, and what it is"""
_BY_TRANS = ('postproc machine new with form = "heidenhain" takes the figures: the rows Trans before each MachAxis, as the '
             "printout of KinematicsDesign or the table of an iTNC 530 has them; ask the machine's builder for it")


def import_machine(path: Path, form: GivenForm, stated: Sequence[str]) -> tuple[str, Machine | None, list[Diagnostic]]:
    """Text of a machine file and the machine of it; "" and None where there are errors.

    Args:
        path: the file of another system
        form: what it is; "auto": by its text
        stated: KEY=VALUE of what the file does not say, by the user
    """
    try:
        text = read_input(path).decode("utf-8-sig", "replace")
    except OSError as fault:
        return "", None, [error("file.unreadable", reason(fault), file=str(path), hint=advice(fault))]
    known = _form_of(path, text) if form == "auto" else form
    if known is None:
        return "", None, [error("import.format", "this is none of the files that are read: "
                                f"{', '.join(_READERS)}", file=str(path), hint="name the form with --format")]
    if known == "heidenhain" and not is_description_table(text):
        return "", None, [error("import.format", _unpublished(text), file=str(path), hint=_BY_TRANS)]
    return finish(*_READERS[known](path, text, stated))


def _form_of(path: Path, text: str) -> MachineForm | None:
    if text.lstrip().startswith("<") and "<machine" in text[:2000]:
        return "fusion-xml"
    if path.suffix.lower() in (".mch", ".machine") or (text.lstrip().startswith("{") and '"kinematics"' in text):
        return "fusion"
    if text.lstrip().startswith("{") and '"axes"' in text:
        return "freecad"
    if any(word in text for word in ("[KINS]", "[TRAJ]", "[EMC]", "#INCLUDE")):
        return "linuxcnc-ini"
    if any(word in text.upper() for word in ("$MA_", "$MC_", "$TC_CARR", "$NK_")):
        return "siemens"
    if is_description_table(text) or re.search(_UNPUBLISHED[0][0], text) or re.search(_UNPUBLISHED[1][0], text):
        return "heidenhain"
    return "heidenhain" if "KINEMATIC" in text.upper()[:2000] else None


def _unpublished(text: str) -> str:
    """What a file of a TNC is that is no description table."""
    for pattern, says in _UNPUBLISHED:
        if found := re.search(pattern, text):
            return says.format(found=found[0])
    return "no description table of an iTNC 530: no line names the columns KEY, AXIS and COORD"
