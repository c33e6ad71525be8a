"""The command `postproc batch`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from postproc.cli.shared.console import Json, progress_bar, refuse_overwriting, report, shown_errors
from postproc.cli.shared.says import SAYS

if TYPE_CHECKING:
    from postproc.base.progress import Progress
    from postproc.batch.forms import CommandForm, Taking
    from postproc.batch.receipts import Receipt
    from postproc.batch.run import Runner, Where
    from postproc.batch.tasks import Task
    from toolpaths.diagnostics import Diagnostic

EXAMPLE = "Example: postproc batch jobs.toml -j 4"
_MOST = 1024
_WRONG: Any = typer.BadParameter.__bases__[0]
"""UsageError of the click that typer brings with it"""


def batch(context: typer.Context,
          jobs: Annotated[Path, typer.Argument(metavar="JOBS.toml", help="file of [[jobs]]: files, machines, controllers, "
                                               "options")],
          workers: Annotated[int, typer.Option("-j", "--workers", metavar="N", min=1, max=_MOST, help="processes of this "
                                               "computer")] = 1,
          scheduler: Annotated[str, typer.Option("--scheduler", metavar="ADDRESS", help="run on the cluster of this Dask "
                                                 "scheduler (tcp://HOST:8786); all must see the same files")] = "",
          again: Annotated[bool, typer.Option("--again", help="run everything, also what is done already")] = False,
          json: Json = "") -> None:
    """Run commands over files x machines x controllers x options; run again, it goes on where it was."""
    if scheduler and workers > 1:
        raise typer.BadParameter("the scheduler has workers of its own", param_hint="-j")
    refuse_overwriting({"--json": json}, {"the batch file": str(jobs)})
    with shown_errors(json):
        from postproc.batch.index import as_csv, as_page, as_text, rows_of
        from postproc.batch.receipts import kept
        from postproc.batch.run import Where

        tasks, keys, folder = _planned(jobs, context.find_root().command)
        before = [None if again else kept(task, key) for task, key in zip(tasks, keys, strict=True)]
        began = time.monotonic()
        with progress_bar() as progress:
            receipts, broken = _run(tasks, keys, before, context.find_root().obj, Where(workers, scheduler), progress)
    seconds = time.monotonic() - began
    rows = rows_of(tasks, receipts, [one is not None for one in before], folder)
    left = _swept(tasks)
    values = {"output": str(folder), "seconds": round(seconds, 3), "runs": rows, "diagnostics": [d.as_dict() for d in left]}
    index = folder / "index.html"
    failed = any(row["outcome"] != "done" for row in rows)
    text = as_text(rows, tasks, index, seconds)
    report(tuple(left), json, values | {"ok": not failed}, text,
           {folder / "index.csv": as_csv(rows), folder / "index.json": _text_of(values | {"ok": not failed}),
            index: as_page(rows, f"postproc batch: {jobs.name}")})
    if broken:
        SAYS.interrupted = "interrupted; what is done is kept: the same command goes on where it was"
        raise KeyboardInterrupt
    if failed:
        raise typer.Exit(1)


def _planned(jobs: Path, root: Any) -> tuple[list[Task], list[str], Path]:
    """Tasks with their keys, and the folder of what they write.

    Raises:
        DiagnosticError: where the file has faults, or a command does not take what it says.
    """
    from postproc.batch.fingerprint import keys_of
    from postproc.batch.model import load_batch
    from postproc.batch.tasks import named, tasks_of
    from toolpaths.diagnostics import DiagnosticError, has_errors
    from toolpaths.input_files import place

    spec, source, found = load_batch(jobs)
    if spec is None or source is None:
        raise DiagnosticError(found)
    names = [name for controllers in (spec.controllers, *(job.controllers for job in spec.jobs)) for name in controllers]
    folder = place(jobs.parent)
    endings = _endings(named(names, folder))
    tasks, wrong = tasks_of(spec, source, forms(root), endings)
    wrong = [*found, *wrong, *(_wrong_use(root, tasks, jobs) if not wrong else [])]
    if has_errors(wrong):
        raise DiagnosticError(wrong)
    return tasks, keys_of(tasks), place(folder / spec.output)


def _endings(controllers: list[str]) -> dict[str, str]:
    """The usual ending of a program's file, by controller; none of one that cannot be read: its command says why."""
    from postproc.controllers.model import load_controller

    specs = {name: load_controller(name)[0] for name in controllers}
    return {name: spec.program.suffix for name, spec in specs.items() if spec is not None}


def _wrong_use(root: Any, tasks: list[Task], jobs: Path) -> list[Diagnostic]:
    """What commands do not take, before any runs: one message for each."""
    from toolpaths.diagnostics import error

    said = dict.fromkeys((task.job, task.command, wrong) for task in tasks if (wrong := wrong_use(root, task.arguments())))
    return [error("batch.wrong_use", f"job {job}: {command} does not take that: {wrong}", file=str(jobs),
                  hint=f"postproc {command} --help lists options and their values") for job, command, wrong in said]


def _run(tasks: list[Task], keys: list[str], before: list[Receipt | None], runner: Runner, where: Where,
         progress: Progress) -> tuple[list[Receipt], bool]:
    """A receipt of each task, and whether it was interrupted."""
    from postproc.batch.receipts import Receipt, kept
    from postproc.batch.run import runs

    receipts = [one or Receipt(key, "not run") for one, key in zip(before, keys, strict=True)]
    todo = [number for number, one in enumerate(before) if one is None]
    progress("batch", 0, max(len(todo), 1))
    if not todo:
        return receipts, False
    try:
        for done, (number, receipt) in enumerate(runs([(tasks[k], keys[k]) for k in todo], runner, where), 1):
            receipts[todo[number]] = receipt
            progress(f"batch: {tasks[todo[number]].name()} {receipt.outcome}", done, len(todo))
    except KeyboardInterrupt:
        ended = [kept(task, key) for task, key in zip(tasks, keys, strict=True)]
        return [new or old for new, old in zip(ended, receipts, strict=True)], True
    return receipts, False


def _swept(tasks: list[Task]) -> list[Diagnostic]:
    """Put back and remove what workers that were killed have left in the folders."""
    from toolpaths.interrupted_runs import clean

    return [d for folder in dict.fromkeys(task.figures.parent for task in tasks) for d in clean(folder)]


def _text_of(values: dict[str, object]) -> str:
    """The JSON of the index as a file."""
    import json

    from postproc.base.json_values import plain, rounded
    from postproc.cli.shared.console import SCHEMA_VERSION

    return json.dumps(rounded({"schema_version": SCHEMA_VERSION} | values), indent=2, allow_nan=False, default=plain) + "\n"


def forms(root: Any) -> Mapping[str, CommandForm]:
    """What each command that a batch runs takes; `root` is the group of all commands."""
    from postproc.batch.model import COMMANDS

    return {name: _form(name, root.commands[name]) for name in COMMANDS}


def wrong_use(root: Any, arguments: Sequence[str]) -> str:
    """What is wrong with the options of a command line, "" where nothing is; the command is not run."""
    try:
        with root.commands[arguments[0]].make_context(arguments[0], list(arguments[1:])):
            return ""
    except _WRONG as fault:
        return str(fault.format_message())


def _form(name: str, command: Any) -> CommandForm:
    from postproc.batch.forms import WRITING, CommandForm

    own = [one for one in command.params if one.param_type_name == "option"]
    return CommandForm({name: _taking(one) for one in own for name in _names(one)},
                       tuple(_names(one)[0] for one in own if one.required),
                       name in WRITING)


def _names(option: Any) -> list[str]:
    return [name.removeprefix("--") for name in option.opts if name.startswith("--")]


def _taking(option: Any) -> Taking:
    return "nothing" if option.is_flag else "many" if option.multiple else "one"
