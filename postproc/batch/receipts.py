"""What a task came to, kept next to its output, so that a batch that is run again goes on where it was."""

from __future__ import annotations

import json
from dataclasses import asdict, field, replace
from pathlib import Path
from typing import Literal

from postproc.batch.tasks import Task
from postproc.proof.hashes import sha256
from toolpaths.dataclass import dataclass
from toolpaths.input_files import is_regular
from toolpaths.transaction import write_together

Outcome = Literal["done", "refused", "wrong use", "fault", "lost", "not run"]
"""done: written; refused: the input has errors; wrong use: the command line has; fault: an internal error; lost: its
worker ended again and again, by want of memory perhaps; not run: the batch was interrupted"""
BY_CODE: dict[int, Outcome] = {0: "done", 1: "refused", 2: "wrong use"}
FINAL: tuple[Outcome, ...] = ("done", "refused")
"""outcomes that the same inputs lead to again: such a task is not run twice"""


@dataclass(frozen=True)
class Receipt:
    """What one task came to.

    Attributes:
        key: of the task as it was run
        outcome: what it came to
        seconds: wall time
        processor_seconds: processor time
        worker: where it was run
        messages: errors and warnings, as people read them
        cycle_time: s, None where its JSON has none
        worst_tip: mm, likewise
        blocks: written, likewise
        outputs: SHA-256 of each file that it wrote, by its name in the folder of its figures
    """

    key: str
    outcome: Outcome
    seconds: float = 0.0
    processor_seconds: float = 0.0
    worker: str = ""
    messages: tuple[str, ...] = ()
    cycle_time: float | None = None
    worst_tip: float | None = None
    blocks: int | None = None
    outputs: dict[str, str] = field(default_factory=dict)


def place_of(task: Task, key: str) -> Path:
    """The file of a receipt: hidden, next to the figures of its task."""
    return task.figures.parent / ".batch" / f"{key}.json"


def kept(task: Task, key: str) -> Receipt | None:
    """What the same task came to before, where all that it wrote still stands as it was written."""
    try:
        values = json.loads(place_of(task, key).read_text(encoding="utf-8"))
        receipt = Receipt(**{**values, "messages": tuple(values["messages"])})
        whole = receipt.key == key and receipt.outcome in FINAL and all(
            sha256((task.figures.parent / name).read_bytes()) == known for name, known in receipt.outputs.items())
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return None
    return receipt if whole else None


def written(task: Task, receipt: Receipt) -> Receipt:
    """Keep a receipt; the same, with the hashes of what the task wrote.

    Raises:
        DiagnosticError: where it cannot be written.
    """
    folder, own = task.figures.parent, _own_files(task) if receipt.outcome in FINAL else []
    whole = replace(_with_figures(receipt, task),
                    outputs={str(file.relative_to(folder)): sha256(file.read_bytes()) for file in own})
    write_together({place_of(task, receipt.key): json.dumps(asdict(whole), indent=1) + "\n"})
    return whole


def _own_files(task: Task) -> list[Path]:
    return [file for file in (task.output, task.figures) if file is not None and is_regular(file)]


def _with_figures(receipt: Receipt, task: Task) -> Receipt:
    """The receipt with what the index shows of the task's JSON."""
    if receipt.outcome not in FINAL:
        return receipt
    try:
        values = json.loads(task.figures.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return receipt
    return replace(receipt, cycle_time=values.get("cycle_time_s"), worst_tip=values.get("worst_tip_deviation_mm"),
                   blocks=values.get("blocks_out"))
