"""Every sample, and every file of a folder, on every machine and control: what comes out, by kind (`make hard`).

    python tests/hard/run.py [FOLDER] [--machine NAME ...] [--controller NAME ...] [--workers 2] [--law]
                             [--edits N | --edits all | --edits deleted [--alike N] [--first]]

Each conversion is written and proved, or refused with a code; the estimate of its time and all texts are made
too. With --edits each program is changed in N blocks (`edits.py`) and goes through `time` and `verify` again;
`--edits deleted` takes each block out in turn (with --alike N at most N of blocks that are alike in
themselves and their neighbours), with --first on the first machine of the list that the file can be written
for. With --law nothing is changed, and what is refused is converted in each output mode: that `auto` refuses
what another mode converts is a failure, as is an error of the read-back that does not say what to do.
Internal errors, and conversions without an end, are failures: exit code 1.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import islice
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

SAMPLES = ROOT / "samples"
ENDINGS = frozenset({".cls", ".cl", ".apt", ".aptsource", ".clt", ".ncl", ".as", ".ncd", ".tap", ".txt", ".cldata"})
SETUPS = (("h4a", "h4a.setup.toml"), ("delta", "delta.setup.toml"), ("uranesx", "delta.setup.toml"),
          ("", "tools.setup.toml"))
"""set-up by how the machine's name begins, unless `places/MACHINE.toml` stands here, FILE.setup.toml or FOLDER.setup.toml
with the file: a machine on legs reaches the place of `places` and hardly that of another machine"""
PARTS, PLACES = Path(__file__).parent / "parts", Path(__file__).parent / "places"
LONGEST = 900
"""s of processor that one conversion may take, edits included"""
PROVED, REFUSED, INTERNAL, ENDLESS, NUMBERS = "written and proved", "refused", "INTERNAL ERROR", "NO END", "number warning"
REFUSES_MORE, NO_HINT = "AUTO REFUSES MORE", "READ-BACK WITHOUT A HINT"
OUTPUT_MODES = ("axes", "tcp", "tilted")
FAILURES = (INTERNAL, ENDLESS, REFUSES_MORE, NO_HINT)


@dataclass(frozen=True)
class Task:
    """One file on one machine, for all controllers."""

    file: Path
    machine: str
    controllers: tuple[str, ...]
    edits: int | None
    """blocks that are changed in the program, None: all"""
    deleted: bool = False
    """blocks are taken out, each by itself, and nothing else is changed"""
    alike: int | None = None
    law: bool = False
    """what is refused is converted in each output mode, nothing is edited"""


def files_of(folder: Path | None) -> list[Path]:
    """The samples, the parts that machines on legs can tilt to, and all files of the folder, however they are called."""
    found = sorted(p for at in (SAMPLES, PARTS) for p in at.rglob("*")
                   if p.suffix.lower() in ENDINGS and "errors" not in p.parts)
    more = folder.rglob("*") if folder else ()
    return found + sorted(p for p in more if p.is_file() and not p.name.endswith(".setup.toml"))


def worked(task: Task) -> Counter[tuple[str, str, str]]:
    """(kind, detail, example) of each conversion of a task."""
    found: Counter[tuple[str, str, str]] = Counter()
    for controller in task.controllers:
        where = f"{task.file.name} on {task.machine}, {controller}"
        with warnings.catch_warnings(record=True) as noise:
            warnings.simplefilter("always")
            signal.signal(signal.SIGPROF, _endless)
            signal.setitimer(signal.ITIMER_PROF, LONGEST)
            for kind, detail, more in _outcomes(task, controller):
                found[kind, detail, where + more] += 1
            signal.setitimer(signal.ITIMER_PROF, 0)
        for w in noise:
            found[NUMBERS, f"{Path(w.filename).name}:{w.lineno} {w.message}", where] += 1
    return found


class Endless(BaseException):
    """Raised where a conversion takes too long; no `except Exception` holds it."""


def _endless(*_: object) -> None:
    raise Endless


def _outcomes(task: Task, controller: str) -> Iterator[tuple[str, str, str]]:
    """(kind, detail, what was done to the program) of one conversion and of its edits."""
    from postproc.cli.shared.guard import fingerprint

    step = ""
    try:
        result = _converted(task, controller)
        yield (PROVED, "", "") if result.ok else (REFUSED, _reason(result.diagnostics), "")
        if task.law and not result.ok:
            yield from _against_the_law(task, controller, result)
        if not result.ok or task.edits == 0 or task.law:
            return
        from tests.hard.edits import deletions, edits, timed, verified

        changed = deletions(result.text, task.alike) if task.deleted else edits(result.text, task.edits)
        for what, program in changed:
            step = f", {what}"
            timed(program, result, result.machine, result.controller, controller)
            yield (f"edited: {'proved' if verified(program, result) else 'refused'}", "", step)
    except Endless:
        yield ENDLESS, f"within {LONGEST} s of processor", step
    except Exception as fault:
        trace = fault.__traceback__
        while trace is not None and trace.tb_next is not None:
            trace = trace.tb_next
        place = f"{Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}" if trace else ""
        yield INTERNAL, f"[{fingerprint(fault)}] {type(fault).__name__}: {str(fault)[:80]} ({place})", step


def _against_the_law(task: Task, controller: str, refused: Any) -> Iterator[tuple[str, str, str]]:
    """Each output mode that converts what `auto` has refused; a read-back that refuses and does not say what to do."""
    from postproc.base.options import Options

    if refused.reached == "verify" and not all(d.hint for d in refused.diagnostics if d.severity == 2):
        yield NO_HINT, _reason(refused.diagnostics), ""
    for mode in OUTPUT_MODES:
        if _asked(task, controller, Options(output=mode)).ok:
            yield REFUSES_MORE, f"{_reason(refused.diagnostics)}, {mode} converts", f", {mode}"


def _asked(task: Task, controller: str, options: Any) -> Any:
    """The conversion."""
    import postproc

    path, found = _read(task.file)
    machine, setup = _machine(task.machine, str(_setup_of(task)))
    return postproc.convert(path, machine, controller, setup, options, list(found))


def _converted(task: Task, controller: str) -> Any:
    """The conversion, with all that is said of it."""
    from postproc.base.json_values import rounded
    from postproc.base.options import Options
    from postproc.cycle_time import report
    from postproc.cycle_time.conversion import estimate_of
    from postproc.cycle_time.estimate import estimate
    from postproc.cycle_time.model import load_model, model_name
    from postproc.cycle_time.source import from_conversion
    from postproc.report import summary

    result = _asked(task, controller, Options())
    if task.law:
        return result
    time = estimate_of(result)
    summary.as_text(result, "out.nc", time)
    json.dumps(rounded(summary.as_dict(result, "out.nc", time)), allow_nan=False, default=str)
    if result.ok:
        planner, _ = load_model(model_name(controller, result.controller.writer))
        assert planner is not None
        figures = estimate(from_conversion(result), result.machine, planner)
        json.dumps(rounded(report.as_dict(figures)), allow_nan=False, default=str)
        report.as_text(figures, "out.nc")
    return result


@lru_cache(maxsize=1)
def _read(file: Path) -> Any:
    import toolpaths

    return toolpaths.read(file)


@cache
def _machine(name: str, setup: str) -> Any:
    import machines
    from postproc.setup.model import load_setup

    return machines.load(name), load_setup(setup)[0]


def _setup_of(task: Task) -> Path:
    if (reached := PLACES / f"{task.machine}.toml").is_file():
        return reached
    for stem in (task.file.stem, task.file.parent.name):
        if (own := task.file.with_name(f"{stem}.setup.toml")).is_file():
            return own
    return SAMPLES / next(name for begin, name in SETUPS if task.machine.startswith(begin))


def _reason(diagnostics: Any) -> str:
    """The code of the first error."""
    return next((str(d.code) for d in diagnostics if d.severity == 2), "NO REASON")


def table(found: Counter[tuple[str, str, str]]) -> str:
    """Counts by kind and detail, the most frequent first, each with an example."""
    by: Counter[tuple[str, str]] = Counter()
    example: dict[tuple[str, str], str] = {}
    for (kind, detail, where), count in found.items():
        by[kind, detail] += count
        example.setdefault((kind, detail), where)
    totals = Counter({kind: sum(c for (k, _), c in by.items() if k == kind) for kind, _ in by})
    lines = []
    for kind, total in totals.most_common():
        lines.append(f"{total:7} {kind}")
        lines += [f"{count:14} {detail}  ({example[k, detail]})" for (k, detail), count in by.most_common()
                  if k == kind and detail]
    return "\n".join(lines)


def by_machine(found: Counter[tuple[str, str, str]]) -> str:
    """Written and refused of each machine: one for which nothing is written shows nothing."""
    made: dict[str, Counter[str]] = {}
    for (kind, _, where), count in found.items():
        if kind in (PROVED, REFUSED):
            made.setdefault(where.split(" on ")[-1].split(",")[0], Counter())[kind] += count
    return "\n".join(f"{name:26} {n[PROVED]:5} written {n[REFUSED]:5} refused{'' if n[PROVED] else ': shows nothing'}"
                     for name, n in sorted(made.items()))


def failures(found: Counter[tuple[str, str, str]]) -> int:
    """Internal errors, conversions without an end, refusals that name no reason, breaches of the law of `auto`."""
    return sum(count for (kind, detail, _), count in found.items() if kind in FAILURES or detail == "NO REASON")


def run(tasks: list[Task], workers: int) -> Counter[tuple[str, str, str]]:
    """All tasks, in processes of their own: one that ends without a word is an internal error too."""
    found: Counter[tuple[str, str, str]] = Counter()
    with ProcessPoolExecutor(workers) as pool:
        todo = iter(tasks)
        running = {pool.submit(worked, task): task for task in islice(todo, 2 * workers)}
        while running:
            try:
                done = next(as_completed(running))
            except KeyboardInterrupt:
                print(f"interrupted: {len(tasks) - len(running) - sum(1 for _ in todo)} of {len(tasks)} done")
                pool.shutdown(wait=False, cancel_futures=True)
                return found
            task = running.pop(done)
            try:
                made = done.result()
                found += made
                if failures(made):
                    print(table(made), file=sys.stderr, flush=True)
            except BrokenProcessPool:
                found[INTERNAL, "a process ended without a word (memory?)", f"near {task.file.name} on {task.machine}"] += 1
                return found
            running |= {pool.submit(worked, one): one for one in islice(todo, 1)}
            print(f"{task.file.name} on {task.machine}", file=sys.stderr, flush=True)
    return found


def _first(file: Path, names: list[str], controllers: list[str]) -> list[str]:
    """The first machine that the file can be written for with any of the controllers; none where there is none."""
    return next(([name] for name in names for controller in controllers
                 if _converted(Task(file, name, (controller,), 0), controller).ok), [])


def main() -> int:
    import machines
    from postproc.controllers.model import builtin_files

    wanted = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    wanted.add_argument("folder", nargs="?", type=Path)
    wanted.add_argument("--machine", nargs="*", default=list(machines.names()))
    wanted.add_argument("--controller", nargs="*", default=sorted(builtin_files()))
    wanted.add_argument("--edits", default="1")
    wanted.add_argument("--alike", type=int)
    wanted.add_argument("--first", action="store_true")
    wanted.add_argument("--law", action="store_true")
    wanted.add_argument("--workers", type=int, default=2)
    wanted.add_argument("--match", default="", help="part of the files' names")
    a = wanted.parse_args()
    if a.folder and not a.folder.is_dir():
        wanted.error(f"{a.folder} is no folder")
    deleted = a.edits == "deleted"
    edits = None if deleted or a.edits == "all" else int(a.edits)
    files = sorted((file for file in files_of(a.folder) if a.match in file.name), key=lambda file: file.stat().st_size)
    tasks = [Task(file, machine, tuple(a.controller), edits, deleted, a.alike, a.law) for file in files
             for machine in (_first(file, a.machine, a.controller) if a.first else a.machine)]
    found = run(tasks, a.workers)
    print(table(found))
    print(by_machine(found))
    print(f"{failures(found)} failures")
    return 1 if failures(found) else 0


if __name__ == "__main__":
    raise SystemExit(main())
