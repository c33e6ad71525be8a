"""Everything that is known of one machine, as one object with the unit in each key."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from machines.analysis.levers import levers
from machines.analysis.report import analyse
from machines.certificate.lookup import comes_with_package
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.exchange.survey import survey
from machines.machine import Machine
from postproc.base.version import VERSION
from postproc.controllers.model import ControllerFile
from postproc.dossier.words import machine_dict
from postproc.job.pivot_words import pivot_words
from postproc.proof.hashes import Hashes
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic

SCHEMA_VERSION = 1
"""of the dossier; it rises where a key changes its meaning or goes"""


@dataclass(frozen=True)
class ErrorsOf:
    """An error model of the machine, the name of its file, and the tool at whose tip errors are given (mm)."""

    model: ErrorModel
    file: str
    tool_length: float


def dossier(machine: Machine, controllers: Mapping[str, ControllerFile], errors: ErrorsOf | None, hashes: Hashes,
            found: Sequence[Diagnostic]) -> dict[str, Any]:
    """The dossier of a machine.

    Args:
        controllers: by name; each names the machine's pivots as it holds them
        errors: None without a model
        hashes: of the files of machine and model
        found: what was said of the machine file
    """
    shown = machine_dict(machine)
    assumed = [f"{axis['letter']}.{key}" for axis in shown["axes"] for key in axis["assumed"]]
    return {"dossier_version": SCHEMA_VERSION, "postproc": VERSION, "machine": shown | {"file": Path(machine.file).name},
            "files": [{"file": one.file, "sha256": one.sha256} for one in hashes],
            "assumed": [*assumed, *(f"timing.{key}" for key in shown["timing_assumed"])],
            "analysis": analyse(machine), "levers": levers(machine),
            "pivots": {name: pivot_words(machine, control) for name, control in controllers.items()},
            "certificate": certificate(machine),
            "errors": None if errors is None else survey(errors.model, machine, errors.tool_length) | {"file": errors.file},
            "diagnostics": [d.as_dict() for d in found]}


def certificate(machine: Machine) -> dict[str, Any] | None:
    """What the certificate of the workspace says, None where there is none."""
    if not machine.certificate:
        return None
    content = json.loads(Path(machine.certificate).read_text("utf-8"))
    return {"file": Path(machine.certificate).name, "boxes": len(content["boxes"]), "region": content["region"],
            "margin": content["margin"], "proved": content["proved"], "travel_proved": "chain" in content
            or content["travel_proved"],
            "checked_with_this_version": comes_with_package(machine.certificate)}
