"""A certificate's file, and the machine file that it is about, checked; what comes of it as figures and diagnostics."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from machines.loader import builtin
from machines.user_file import base_chain, values_of
from postproc.certificate_check.boxes import Rejected
from postproc.certificate_check.chains import chain_confirmed
from postproc.certificate_check.check import NO_CERTIFICATE, confirmed
from postproc.certificate_check.machine_file import about
from postproc.witness.machine import merged
from toolpaths.diagnostics import Diagnostic, DiagnosticError, error
from toolpaths.input_files import read_input


def checked(file: Path, machine: str = "") -> tuple[dict[str, Any], list[Diagnostic]]:
    """(figures, diagnostics) of the certificate `file` of a machine, by its name or file; "" as the certificate names it.

    Raises:
        DiagnosticError: where a file cannot be read.
    """
    try:
        found = json.loads(read_input(file).decode("utf-8"))
        if not isinstance(found, dict) or "certificate" not in found:
            raise ValueError("it has no key 'certificate'")
    except (OSError, ValueError, RecursionError) as fault:
        raise DiagnosticError([error("certificate.file", f"no certificate can be read: {fault}", file=str(file),
                                     hint="write one with postproc machine certify NAME -o CERT.json")]) from fault
    source = machine or str(found.get("machine", ""))
    try:
        table = merged([values_of(path) for path in base_chain(source, builtin())])
    except (OSError, ValueError) as fault:
        raise DiagnosticError([error("certificate.machine", f"the machine file {source!r} cannot be read: {fault}",
                                     file=str(file), hint="name it: postproc machine certify MACHINE.toml --check CERT.json")
                               ]) from fault
    try:
        about(found, table)
        figures = chain_confirmed(found) if "chain" in found else confirmed(found)
    except Rejected as fault:
        return {"machine": source, "confirmed": False}, [error(
            "certificate.rejected", str(fault), file=str(file),
            hint=f"certify again: postproc machine certify {source} -o {file.name}")]
    except NO_CERTIFICATE as fault:
        return {"machine": source, "confirmed": False}, [error(
            "certificate.rejected", f"it is no certificate of this form: {type(fault).__name__}: {fault}", file=str(file),
            hint=f"certify again: postproc machine certify {source} -o {file.name}")]
    return {"machine": source, "confirmed": True, "covers": found["covers"]} | figures, []
