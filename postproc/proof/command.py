"""What `convert --proof` and `verify` do with the file of a proof."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from postproc.base.options import Options
from postproc.proof.hashes import Hashes, ProofInput, input_hashes, proof_place
from toolpaths.diagnostics import Diagnostic, DiagnosticError, error, warning
from toolpaths.input_files import is_regular, reason, shown

if TYPE_CHECKING:  # names are read before what works on results is imported
    from postproc.pipeline.result import PostResult, VerifyResult
    from postproc.proof.changes import Kept


def hashed(machine: str, controller: str, options: Options) -> dict[ProofInput, Hashes] | None:
    """Hashes of all input files but the CL file; None where one is not read, which its reader says."""
    try:
        return input_hashes(machine, controller, options)
    except (OSError, ValueError):
        return None


def kept(result: PostResult, machine: str, controller: str, wanted: bool, known: dict[ProofInput, Hashes] | None,
         output: Path) -> tuple[dict[Path, str], list[Diagnostic]]:
    """The proof file by its place, where one is `wanted` (`known`: the hashes before the files were read);
    else a warning where that of an older program stands there.

    Raises:
        DiagnosticError: where an input was changed while it was converted.
    """
    place = proof_place(output)
    if not wanted:
        return {}, [warning("proof.older", "the proof file there is of an older program",
                            file=str(place), hint="convert with --proof to write it again, or remove it")
                    ] if is_regular(place) else []
    from postproc.proof.file import proof_text

    try:
        now = input_hashes(machine, controller, result.options)
    except (OSError, ValueError) as fault:
        why = reason(fault) if isinstance(fault, OSError) else str(fault)
        why = f"a file of machine, controller, set-up or error model is not read a second time: {why}"
        raise DiagnosticError([_moved(why, output)]) from fault
    unlike = [one.file for name in now for one in set(now[name]) ^ set((known or {}).get(name, ()))]
    if unlike:
        raise DiagnosticError([_moved(f"{', '.join(sorted(set(unlike)))} changed while it was converted", output)])
    return {place: proof_text(result, now, str(output))}, []


def _moved(why: str, output: Path) -> Diagnostic:
    return error("proof.input_changed", why, file=shown(output), hint="convert again")


def compared_with(result: VerifyResult, machine: str, controller: str,
                  proof: str) -> tuple[Kept | None, list[Diagnostic]]:
    """See `changes.compared`."""
    from postproc.proof.changes import compared

    return compared(result, hashed(machine, controller, result.options) or {}, proof)
