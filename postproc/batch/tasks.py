"""Jobs become tasks: one call of a command each, with a name of its own for what it writes."""

from __future__ import annotations

import glob
import re
from collections.abc import Iterable, Sequence
from itertools import product
from pathlib import Path

from machines.user_file import UserFile
from machines.value_words import nearest
from postproc.batch.forms import INPUTS, CommandForm, CommandForms
from postproc.batch.model import BatchFile, JobModel, OptionValue
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.input_files import is_regular, place, there_is

StatedOptions = tuple[tuple[str, str], ...]
"""options with their values, "" for one that takes none, in the order of their names"""
_UNNAMED = re.compile(r"[^\w.+-]+")
_LONGEST = 120
"""characters of a name that is made up"""


@dataclass(frozen=True)
class Task:
    """One call of a command.

    Attributes:
        job: name of the job
        file: the input, absolute
        machine, controller: "" where none is stated
        options: of the job, files absolute
        varied: those of them that differ between tasks of the job
        output: what the command writes, absolute; None where it writes figures alone
        figures: its JSON, absolute
    """

    job: str
    command: str
    file: Path
    machine: str
    controller: str
    options: StatedOptions
    varied: StatedOptions
    output: Path | None
    figures: Path

    def arguments(self) -> tuple[str, ...]:
        """The command line behind `postproc`."""
        words = [self.command, str(self.file)]
        for name, value in (("machine", self.machine), ("controller", self.controller)):
            words += [f"--{name}={value}"] if value else []
        words += [f"--{name}={value}" if value else f"--{name}" for name, value in self.options]
        words += [f"--output={self.output}"] if self.output else []
        return (*words, f"--json={self.figures}")

    def name(self) -> str:
        """For people: file, machine, controller, what varies."""
        parts = [self.file.name, *(Path(x).name for x in (self.machine, self.controller) if x)]
        return " ".join([*parts, *(f"{name} {Path(value).name}".rstrip() for name, value in self.varied)])


def tasks_of(batch: BatchFile, source: UserFile, forms: CommandForms,
             endings: dict[str, str]) -> tuple[list[Task], list[Diagnostic]]:
    """All tasks in the order of the jobs; none where the file asks for what no command can do.

    Args:
        batch: checked
        source: its values, for the lines of faults
        forms: what each command takes
        endings: of program files, by controller
    """
    found: list[Diagnostic] = []
    tasks: list[Task] = []
    for number, job in enumerate(batch.jobs):
        made, wrong = _tasks_of(number, job, batch, source, forms, endings)
        tasks += made
        found += wrong
    found += [] if found else _clashes(tasks, source)
    return ([] if found else tasks), found


def _tasks_of(number: int, job: JobModel, batch: BatchFile, source: UserFile, forms: CommandForms,
              endings: dict[str, str]) -> tuple[list[Task], list[Diagnostic]]:
    command = job.command or batch.command
    form, folder = forms[command], place(Path(source.file).parent)
    shared = {_dashed(name): value for name, value in batch.options.items() if _dashed(name) in form.settable()}
    own = {_dashed(name): value for name, value in job.options.items()}
    wrong = [_unknown(number, name, form, command, source) for name in job.options if _dashed(name) not in form.settable()]
    every = [_dashed(name) for one in forms.values() for name in one.settable()]
    wrong += [_unknown_everywhere(name, every, source) for name in batch.options if _dashed(name) not in every] \
        if number == 0 else []
    files, missing = _files(number, job, folder, source)
    wrong += missing
    machines, controllers = job.machines or batch.machines, job.controllers or batch.controllers
    for what, names in (("machine", machines), ("controller", controllers)):
        if what in form.required and not names:
            wrong.append(source.problem("batch.nothing_stated", ("jobs", number), f"job {number + 1} has no {what}s, and "
                                        f"{command} needs one",
                                        f'add {what}s = ["..."] to the job, or at the top of the file for all jobs'))
    if wrong:
        return [], wrong
    name = job.name or str(number + 1)
    given = sorted((shared | own).items())
    several = {option for option, value in given
               if isinstance(value, list) and form.options[option] != "many" and len(value) > 1}
    sides = (files, named(machines, folder) if "machine" in form.options else [""],
             named(controllers, folder) if "controller" in form.options else [""],
             list(product(*(_choices(option, value, form, folder) for option, value in given))))
    tasks = []
    for file, machine, controller, options in product(*sides):
        stated = tuple(one for group in options for one in group)
        varied = tuple(one for one in stated if one[0] in several)
        base = _base(place(folder / batch.output), name if len(batch.jobs) > 1 else "", file,
                     (machine if len(machines) > 1 else "", controller if len(controllers) > 1 else ""), varied)
        ending = job.ending or _ending(command, endings.get(controller, ".nc"))
        tasks.append(Task(name, command, file, machine, controller, stated, varied,
                          base.with_name(base.name + ending) if form.writes else None,
                          base.with_name(base.name + ".json")))
    return tasks, []


def _dashed(name: str) -> str:
    return name.replace("_", "-")


def _unknown(number: int, name: str, form: CommandForm, command: str, source: UserFile) -> Diagnostic:
    return source.problem("batch.option", ("jobs", number, "options", name),
                          f"{command} has no option {name!r} that a job can state", nearest(_dashed(name), form.settable()))


def _unknown_everywhere(name: str, known: Sequence[str], source: UserFile) -> Diagnostic:
    return source.problem("batch.option", ("options", name), f"no command has an option {name!r} that a job can state",
                          nearest(_dashed(name), sorted(set(known))))


def _files(number: int, job: JobModel, folder: Path, source: UserFile) -> tuple[list[Path], list[Diagnostic]]:
    """Files that the patterns of a job name, each once, and patterns that name none."""
    files: dict[Path, None] = {}
    missing = []
    for pattern in job.files:
        exact = folder / pattern  # a name may hold what is a pattern
        every = glob.glob(_pattern(folder, pattern), recursive=True)  # noqa: PTH207  # absolute
        named = [exact] if is_regular(exact) else sorted(Path(one) for one in every if is_regular(one))
        files |= dict.fromkeys(map(place, named))
        if not named:
            missing.append(source.problem("batch.no_file", ("jobs", number, "files"), f"no file {pattern!r} in {folder}",
                                          "name files from the folder of the batch file; * stands for any part of a name"))
    return list(files), missing


def _pattern(folder: Path, pattern: str) -> str:
    """A pattern from a folder; brackets and stars in names of folders that stand there are letters."""
    whole = (folder / pattern).parts
    text, here = "", Path(whole[0])
    for part in whole[1:]:
        here = here / part
        text += f"/{glob.escape(part) if there_is(here) and part != '**' else part}"
    return str(Path(whole[0])).rstrip("/\\") + text


def named(names: Iterable[str], folder: Path) -> list[str]:
    """Built-in names as they are, TOML files absolute; "" where there are none."""
    return [str(place(folder / name)) if name.lower().endswith(".toml") else name for name in names] or [""]


def _choices(name: str, value: OptionValue, form: CommandForm, folder: Path) -> list[StatedOptions]:
    """What an option is in the tasks: a value of each, all values of one that may be repeated."""
    taking = form.options[name]
    values = value if isinstance(value, list) else [value]
    if taking == "nothing":
        return [((name, ""),) if one else () for one in values]
    texts = [str(place(folder / str(one))) if name in INPUTS else _text(one) for one in values]
    return [tuple((name, text) for text in texts)] if taking == "many" else [((name, text),) for text in texts]


def _text(value: bool | int | float | str) -> str:
    return str(value).lower() if isinstance(value, bool) else repr(value) if isinstance(value, float) else str(value)


def _ending(command: str, of_programs: str) -> str:
    """Of what a command writes."""
    return {"convert": of_programs, "report": ".html"}.get(command, ".toml")


def _base(output: Path, job: str, file: Path, machine_and_controller: tuple[str, str], varied: StatedOptions) -> Path:
    """Name without ending of what a task writes: of its file and of what differs between the tasks of its job."""
    parts = [file.stem, *(Path(x).stem if x.lower().endswith(".toml") else x for x in machine_and_controller if x)]
    parts += [f"{name}-{Path(value).stem if name in INPUTS else value}".rstrip("-") for name, value in varied]
    return output.joinpath(*([_plain(job)] if job else []), _plain(".".join(parts))[:_LONGEST])


def _plain(text: str) -> str:
    """A text as a name of a file on every system."""
    return _UNNAMED.sub("_", text).strip(".") or "_"


def _clashes(tasks: list[Task], source: UserFile) -> list[Diagnostic]:
    """An error where two tasks would write one file, by names without capitals as some systems have them."""
    by_name: dict[str, Task] = {}
    found = []
    for task in tasks:
        other = by_name.setdefault(str(task.figures).lower(), task)
        if other is not task:
            found.append(error("batch.same_output", f"two runs would write {task.figures.with_suffix('').name}: "
                               f"{other.file} and {task.file}", file=source.file,
                               hint="put them into jobs with names of their own: each job writes into its own folder"))
    return found[:1]
