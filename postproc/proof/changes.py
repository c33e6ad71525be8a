"""What has changed since a program was proved: `verify` names the input."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from postproc.base.version import VERSION
from postproc.pipeline.result import VerifyResult
from postproc.proof.file import AGAIN, HashedFile, ProofFile, options_of, read_proof
from postproc.proof.hashes import FileHash, Hashes, ProofInput, cl_hashes, proof_place, sha256
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, Severity, error, info, warning
from toolpaths.input_files import STANDARD_INPUT, is_regular, read_input

ChangedKey = Literal[ProofInput, "options"]
_NAMES: dict[str, str] = {"program": "program", "cl_file": "CL file", "setup": "set-up", "machine": "machine file",
          "controller": "controller file", "error_model": "error model"}
_SHOWN = 8
"""digits of a hash in messages"""


@dataclass(frozen=True)
class Kept:
    """The proof file of a program and what has changed since: inputs by their keys, "options", "postproc"."""

    file: str
    changed: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Of `verify --json`."""
        return {"file": self.file, "unchanged": not self.changed, "changed": list(self.changed)}

    def line(self) -> str:
        """Of the summary."""
        if not self.changed:
            return (f"{Path(self.file).name}: CL file, set-up, machine, controller, error model and program are those of "
                    "the proof")
        return f"{Path(self.file).name}: not as in the proof: {', '.join(_NAMES.get(key, key) for key in self.changed)}"


def compared(result: VerifyResult, inputs: dict[ProofInput, Hashes],
             proof: str) -> tuple[Kept | None, list[Diagnostic]]:
    """What has changed since the proof of a program was written, warned where the program is right all the same.

    Args:
        proof: the file that was named; "": the one next to the program, where there is one. A damaged one is
            an error, or a warning where it was not named.
    """
    file = Path(proof) if proof else proof_place(Path(result.gcode))
    if not proof and (result.gcode in STANDARD_INPUT or not is_regular(file)):
        return None, []
    kept, found = read_proof(file)
    if kept is None:
        return None, found if proof else [replace(d, severity=Severity.WARNING) for d in found]
    given: dict[ProofInput, Hashes] = {"cl_file": _cl(result), **inputs}
    changed: dict[ChangedKey, str] = {"program": _program(result, kept, file.parent)}
    changed |= {key: _differs(getattr(kept.inputs, key), now) for key, now in given.items()}
    changed["options"] = _options(kept, result)
    named = {key: what for key, what in changed.items() if what}
    judge = warning if result.ok else error
    found = [judge(f"proof.{key}", _message(key, what), file=str(file), hint=_hint(key)) for key, what in named.items()]
    keys: list[str] = list(named)
    if kept.postproc != VERSION:
        keys.append("postproc")
        found.append(info("proof.version", f"the proof is of postproc {kept.postproc}, this is {VERSION}", file=str(file)))
    return Kept(str(file), tuple(keys)), found


def _cl(result: VerifyResult) -> Hashes:
    return () if result.source is None else cl_hashes(result.cl_file, result.source)


def _program(result: VerifyResult, kept: ProofFile, folder: Path) -> str:
    """The program, and the files of its subprograms, which stand next to it."""
    adjacent = Path(result.gcode).parent if result.gcode not in STANDARD_INPUT else folder
    now = [FileHash(Path(result.gcode).name, result.sha256)]
    for one in kept.program[1:]:
        try:
            now.append(FileHash(one.file, sha256(read_input(adjacent / one.file))))
        except OSError:
            now.append(FileHash(one.file, ""))
    return _differs(kept.program, tuple(now))


def _differs(then: list[HashedFile], now: Hashes) -> str:
    """What is other than then, "" where all is the same; files may have other names."""
    if [one.sha256 for one in then] == [one.sha256 for one in now]:
        return ""
    if not then or not now:
        return f"{then[0].file} was given then, none now" if then else f"none was given then, {now[0].file} now"
    pairs = [(a.file, a.sha256, b.sha256) for a, b in zip(then, now, strict=False) if a.sha256 != b.sha256]
    parts = [f"{name} was {a[:_SHOWN]}, is {b[:_SHOWN] or 'not there'}" for name, a, b in pairs]
    more = [f"{one.file} is no longer read" for one in then[len(now):]] + [f"{one.file} is new" for one in now[len(then):]]
    return ", ".join(parts + more)


def _options(kept: ProofFile, result: VerifyResult) -> str:
    then, now = kept.options.model_dump(), options_of(result)
    return ", ".join(f"{key} was {then[key]}, is {now[key]}" for key in then if then[key] != now[key])


def _message(key: ChangedKey, what: str) -> str:
    if key == "program":
        return f"the program is not the one that was proved ({what}): it was edited since, or written again without --proof"
    if key == "options":
        return f"the options are not those of the proof: {what}"
    return f"the {_NAMES[key]} is not the one of the proof: {what}"


def _hint(key: ChangedKey) -> str:
    if key == "program":
        return f"what verify says now is of the program as it is; {AGAIN} for the one that was proved"
    if key == "options":
        return "what verify says now is by the options given; verify with those of the proof to repeat it"
    return f"what verify says now is of the {_NAMES[key]} as it is; give the one of the proof, or {AGAIN}"
