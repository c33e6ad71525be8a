"""Which form a file has, and the machine that it describes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from machines.exchange.choices import GivenForm, MachineForm
from machines.exchange.draft import Draft, finish
from machines.exchange.freecad import read_freecad
from machines.exchange.fusion import read_fusion
from machines.exchange.fusion_xml import read_fusion_xml
from machines.exchange.linuxcnc_ini import read_linuxcnc
from machines.exchange.siemens import read_siemens
from machines.machine import Machine
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.input_files import advice, read_input, reason

_READERS: dict[MachineForm, Callable[[Path, str, Sequence[str]], tuple[Draft, dict[str, bool]]]] = {
    "linuxcnc-ini": read_linuxcnc, "siemens": read_siemens, "freecad": read_freecad, "fusion": read_fusion,
    "fusion-xml": read_fusion_xml}
UNDOCUMENTED: dict[MachineForm, str] = {
    "heidenhain": "the form of Heidenhain's kinematics (KinematicsDesign, CfgKin..., backups of cycle 450) is not published"}
"""form: why it is not read"""


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
    if known in UNDOCUMENTED:
        return "", None, [error("import.format", UNDOCUMENTED[known], file=str(path),
                                hint="postproc machine new asks for the pivots that the control shows")]
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
    if any(word in text for word in ("$MA_", "$MC_", "$TC_CARR")):
        return "siemens"
    return "heidenhain" if "CfgKin" in text or "KINEMATIC" in text.upper()[:2000] else None
