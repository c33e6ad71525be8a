"""The proof of a program as a file next to it (`part.ngc.proof.json`): what is proved, how near, by what, of which bytes."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from postproc.base.version import VERSION
from postproc.pipeline.result import PostResult
from postproc.proof.hashes import Hashes, ProofInput, cl_hashes, sha256
from postproc.readback.comparison.compare import Comparison
from postproc.verification.proof_text import statement
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.input_files import read_input, unreadable
from toolpaths.units import DEG

OWN = "of_this_file"
"""key of the SHA-256 of all else that the file says"""
AGAIN = "convert again with --proof"
Digest = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
NotNegativeFigure = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, use_attribute_docstrings=True)


class HashedFile(_Model):
    """A file without its folder."""

    file: str
    sha256: Digest


class Inputs(_Model):
    """What the program was made from: a file, then its bases, then what it names; empty where none was given."""

    cl_file: list[HashedFile]
    setup: list[HashedFile]
    machine: list[HashedFile]
    controller: list[HashedFile]
    error_model: list[HashedFile]


class ProofOptions(_Model):
    """Options that the proof depends on."""

    tolerance_mm: NotNegativeFigure
    axis_tolerance_deg: NotNegativeFigure
    units: str
    dialect: str
    allow_unknown: list[str]
    orient: str
    max_tilt_deg: NotNegativeFigure
    error_model_beyond: bool


class Deviation(_Model):
    """Of tip (mm) and axis (degrees)."""

    tip_mm: NotNegativeFigure
    axis_deg: NotNegativeFigure


class ReadBack(_Model):
    """The program read back and moved on the machine, against the CL file."""

    blocks: int
    blocks_without_bound: int
    cuts: int
    cuts_bounded: int
    bound: Deviation | None
    """None where some block has none"""
    sampled: Deviation


class SecondReading(_Model):
    """The second witness."""

    compared: list[str]
    not_compared: list[str]
    positions: int
    worst: Deviation


class ReadRecords(_Model):
    """Records of the CL file."""

    total: int
    executed: int
    neutral: int
    dropped: int


class ProofFile(_Model):
    """The whole file."""

    schema_version: Literal[1]
    kind: Literal["proof of a program"]
    postproc: str
    proved: bool
    statement: str
    inputs: Inputs
    program: list[HashedFile]
    """the program, then the files of its subprograms"""
    options: ProofOptions
    records: ReadRecords
    read_back: ReadBack
    second_reading: SecondReading
    of_this_file: Digest


def proof_text(result: PostResult, inputs: dict[ProofInput, Hashes], output: str) -> str:
    """The file of a conversion that is written to `output`; `inputs` as `input_hashes` gives them."""
    found, source = result.comparison, result.source
    if found is None or source is None:
        raise ValueError("a path that was not read from a file, or not compared, has no proof")
    cl = cl_hashes(result.toolpath.file, source)
    texts = {Path(output).name: result.text, **(result.files or {})}
    values: dict[str, Any] = {
        "schema_version": 1, "kind": "proof of a program", "postproc": VERSION,
        "proved": not found.unbounded, "statement": statement(found, result.witness),
        "inputs": {name: [vars(one) for one in found] for name, found in {"cl_file": cl, **inputs}.items()},
        "program": [{"file": name, "sha256": sha256(text.encode())} for name, text in texts.items()],
        "options": options_of(result), "records": asdict(result.toolpath.records),
        "read_back": _read_back(found), "second_reading": _second(result)}
    values[OWN] = digest(values)
    return json.dumps(values, indent=2, allow_nan=False) + "\n"


def options_of(result: Any) -> dict[str, Any]:
    """The options of a conversion or a `VerifyResult` that its proof depends on."""
    o = result.options
    return {"tolerance_mm": o.tolerance, "axis_tolerance_deg": o.axis_tolerance, "units": o.units, "dialect": o.dialect,
            "allow_unknown": list(o.allow_unknown), "orient": o.orient, "max_tilt_deg": o.max_tilt,
            "error_model_beyond": o.error_beyond}


def _read_back(c: Comparison) -> dict[str, Any]:
    bound = None if c.unbounded else {"tip_mm": c.tip_bound, "axis_deg": c.axis_bound / DEG}
    return {"blocks": len(c.owner), "blocks_without_bound": c.unbounded, "cuts": c.cuts, "cuts_bounded": c.bounded_cuts,
            "bound": bound, "sampled": {"tip_mm": c.worst_tip, "axis_deg": c.worst_axis / DEG}}


def _second(result: PostResult) -> dict[str, Any]:
    said = result.witness
    if said is None:
        return {"compared": [], "not_compared": ["all"], "positions": 0, "worst": {"tip_mm": 0.0, "axis_deg": 0.0}}
    worst = [value if math.isfinite(value) else 0.0 for value in (said.worst_tip, said.worst_axis / DEG)]
    return {"compared": [str(one) for one in said.compared], "positions": said.points,
            "not_compared": [str(one) for one in said.not_compared],
            "worst": {"tip_mm": worst[0], "axis_deg": worst[1]}}


def digest(values: dict[str, Any]) -> str:
    """SHA-256 of what a proof file says but for its own, whatever its spaces and its order."""
    said = {key: value for key, value in values.items() if key != OWN}
    return sha256(json.dumps(said, sort_keys=True, separators=(",", ":")).encode())


def read_proof(file: str | Path) -> tuple[ProofFile | None, list[Diagnostic]]:
    """The proof of a file, or None and why it is none."""
    try:
        data = read_input(file)
    except OSError as fault:
        return None, [unreadable(fault, "proof.open", file, "name the file that convert --proof has written")]
    try:
        values = json.loads(data, object_pairs_hook=_once)
    except (ValueError, RecursionError) as fault:
        return None, [_damaged(file, f"it is not JSON ({str(fault).splitlines()[0]})", getattr(fault, "lineno", 0))]
    try:
        proof = ProofFile.model_validate(values)
    except ValidationError as fault:
        first = fault.errors()[0]
        return None, [_damaged(file, f"{'.'.join(str(step) for step in first['loc']) or 'the file'}: {first['msg']}")]
    if digest(values) != proof.of_this_file:
        return None, [_damaged(file, f"it does not say what it was written with: {OWN} is {proof.of_this_file[:8]}, counted "
                               f"again {digest(values)[:8]}")]
    return proof, []


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a key stands in it twice")
    return found


def _damaged(file: str | Path, why: str, line: int = 0) -> Diagnostic:
    return error("proof.damaged", f"the proof file is damaged: {why}", file=str(file), lines=[line] if line else [],
                 hint=f"{AGAIN}, or verify without this file")
