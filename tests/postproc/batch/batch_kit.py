"""Small batches, and runners of commands that workers can find."""

from __future__ import annotations

import os
import signal
from collections.abc import Sequence
from pathlib import Path

from typer.main import get_command

from postproc.batch.fingerprint import keys_of
from postproc.batch.model import load_batch
from postproc.batch.run import Ran
from postproc.batch.tasks import Task, tasks_of
from postproc.cli.app import app, run_command
from postproc.cli.batch import forms
from toolpaths.diagnostics import Diagnostic

PART = ("UNITS/MM\nLOADTL/{tool}\nSPINDL/RPM,1000,CLW\nFEDRAT/MMPM,600\nRAPID\nGOTO/0,0,50,0,0,1\nRAPID\nGOTO/0,0,5\n"
        "GOTO/0,0,0\nGOTO/{far},0,0\nRAPID\nGOTO/9,0,50\nFINI\n")
LENGTHS = "".join(f"[tools.{tool}]\ngauge_length = 100.0\n" for tool in (1, 2, 3, 4))
JOBS = """output = "out"
machines = ["mill-3axis"]
controllers = ["linuxcnc"]
[options]
setup = "s.toml"
[[jobs]]
files = ["*.cls"]
"""


def batch_folder(folder: Path, jobs: str = JOBS, parts: int = 3) -> Path:
    """The file of a batch, next to parts and their set-up."""
    for number in range(1, parts + 1):
        (folder / f"part{number}.cls").write_text(PART.format(tool=number, far=10 + number), encoding="utf-8")
    (folder / "s.toml").write_text(LENGTHS, encoding="utf-8")
    (folder / "jobs.toml").write_text(jobs, encoding="utf-8")
    return folder / "jobs.toml"


def planned(jobs: Path) -> tuple[list[Task], list[Diagnostic]]:
    """Tasks of a file, and what is wrong with it."""
    spec, source, found = load_batch(jobs)
    if spec is None or source is None:
        return [], found
    tasks, wrong = tasks_of(spec, source, forms(get_command(app)), {"linuxcnc": ".ngc", "siemens-840d": ".mpf"})
    return tasks, [*found, *wrong]


def with_keys(jobs: Path) -> list[tuple[Task, str]]:
    """Tasks of a good file with their keys."""
    tasks, wrong = planned(jobs)
    assert wrong == []
    return list(zip(tasks, keys_of(tasks), strict=True))


def counted_run(arguments: Sequence[str]) -> Ran:
    """Runs a command, and notes which in a file next to its figures."""
    figures = _figures(arguments)
    figures.parent.mkdir(parents=True, exist_ok=True)
    with (figures.parent / "begun.txt").open("a", encoding="utf-8") as log:
        log.write(f"{figures.stem}\n")
    return run_command(arguments)


def killed_once(arguments: Sequence[str]) -> Ran:
    """The same, but the first process that gets part2 is killed while its outputs stand next to their places."""
    import toolpaths.transaction as transaction

    figures = _figures(arguments)
    mark = figures.parent / "killed.txt"
    if "part2" in figures.name and not mark.exists():
        counted_mark(figures, mark)
        vars(transaction)["_put"] = _end
    return counted_run(arguments)


def counted_mark(figures: Path, mark: Path) -> None:
    """Leave a mark that the kill took place."""
    figures.parent.mkdir(parents=True, exist_ok=True)
    mark.write_text("", encoding="utf-8")


def killed_always(arguments: Sequence[str]) -> Ran:
    """Every process that gets part2 ends."""
    if "part2" in _figures(arguments).name:
        os.kill(os.getpid(), signal.SIGKILL)
    return counted_run(arguments)


def _end(*given: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def _figures(arguments: Sequence[str]) -> Path:
    return Path(next(word.removeprefix("--json=") for word in arguments if word.startswith("--json=")))
