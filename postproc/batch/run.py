"""Tasks run one after another here, on processes of this computer, or on a cluster."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from typing import Any, cast

from postproc.base.version import VERSION
from postproc.batch.receipts import BY_CODE, Receipt, kept, written
from postproc.batch.tasks import Task
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import DiagnosticError, error
from toolpaths.extras import need

MOST_MESSAGES = 5
"""lines of what a command says that are kept"""
_USAGE = ("Usage: ", "Try 'postproc")
"""lines that stand before what is wrong with a command line"""
TRIES = 2
"""how often a task is given to another worker where its worker ended"""
FIRST_WORKER = 30.0
"""seconds in which the first worker of a cluster that has just been started may come"""


@dataclass(frozen=True)
class Ran:
    """What a call of a command came to: exit code, and the lines that it wrote to standard error."""

    code: int
    said: tuple[str, ...]


Runner = Callable[[Sequence[str]], Ran]
"""calls the command line in this process"""


@dataclass(frozen=True)
class Where:
    """Where tasks run: `workers` processes of this computer (1: this process), or the cluster of a scheduler."""

    workers: int = 1
    scheduler: str = ""


def run_task(task: Task, key: str, runner: Runner, worker: str = "") -> Receipt:
    """Run one task, and keep its receipt.

    Raises:
        DiagnosticError: where the receipt cannot be written.
    """
    began, processor = time.monotonic(), time.process_time()
    with suppress(OSError):  # figures of other inputs would stand next to a fault; the command says what hinders it
        task.figures.unlink(missing_ok=True)
    ran = runner(task.arguments())
    outcome = BY_CODE.get(ran.code, "fault")
    said = [line for line in ran.said if not line.startswith(_USAGE) and (outcome == "done" or " info [" not in line)]
    receipt = Receipt(key, outcome, round(time.monotonic() - began, 3), round(time.process_time() - processor, 3), worker,
                      tuple(said[:MOST_MESSAGES]))
    return written(task, receipt)


def runs(tasks: Sequence[tuple[Task, str]], runner: Runner, where: Where) -> Iterator[tuple[int, Receipt]]:
    """Run tasks with their keys; number and receipt of each as it ends. One that fails stops none.

    Raises:
        DiagnosticError: where there are no workers, or they are of another version.
    """
    if where.scheduler or where.workers > 1:
        yield from _on_dask(tasks, runner, where)
        return
    for number, (task, key) in enumerate(tasks):
        try:
            yield number, run_task(task, key, runner, "here")
        except DiagnosticError as fault:
            yield number, _lost(key, str(fault))


def _lost(key: str, why: str) -> Receipt:
    return Receipt(key, "lost", messages=tuple(why.splitlines()[:MOST_MESSAGES]))


def _remote(task: Task, key: str, runner: Runner) -> Receipt:
    """A task on a worker: where it is done already, by a worker whose answer was lost, it is not done again."""
    from distributed import get_worker

    return kept(task, key) or run_task(task, key, runner, str(get_worker().address))


def _on_dask(tasks: Sequence[tuple[Task, str]], runner: Runner, where: Where) -> Iterator[tuple[int, Receipt]]:
    need("distributed", "several workers need")
    from distributed import as_completed

    ended: Any = as_completed
    with ExitStack() as stack:
        client = client_of(replace(where, workers=min(where.workers, len(tasks))), stack)
        futures = {client.submit(_remote, task, key, runner, key=key, pure=False, retries=0): number
                   for number, (task, key) in enumerate(tasks)}
        stack.callback(client.cancel, list(futures))
        for future in ended(futures):
            number = futures[future]
            if future.status == "finished":
                yield number, cast(Receipt, future.result())
            else:
                yield number, _lost(tasks[number][1], _why(future))
            future.release()


def _why(future: Any) -> str:
    """Why a worker has no answer."""
    from distributed import KilledWorker

    fault = future.exception()
    if isinstance(fault, KilledWorker):
        return f"{TRIES + 1} workers ended while they ran it: by want of memory, or killed from outside"
    return f"{type(fault).__name__}: {fault}"


def client_of(where: Where, stack: ExitStack) -> Any:
    """The workers, closed at the end.

    Raises:
        DiagnosticError: where the scheduler cannot be reached, or a worker has another version.
    """
    import logging

    import dask
    import distributed

    library: Any = distributed  # its calls have no types

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # a killed worker is an outcome, said in our own words
    stack.enter_context(dask.config.set({"distributed.scheduler.allowed-failures": TRIES,
                                         "distributed.admin.tick.limit": "1h"}))
    if where.scheduler:
        try:
            client = stack.enter_context(library.Client(where.scheduler, timeout="5s"))
            with suppress(TimeoutError):
                client.wait_for_workers(1, timeout=FIRST_WORKER)
        except (OSError, ValueError, TimeoutError) as fault:
            raise DiagnosticError([error("batch.scheduler", f"no scheduler answers at {where.scheduler}: "
                                         f"{str(fault).splitlines()[0] if str(fault) else type(fault).__name__}",
                                         hint="start one with: dask scheduler; its address is tcp://HOST:8786; without "
                                         "--scheduler the runs are made on this computer")]) from fault
    else:
        with _interrupts_ignored():
            cluster = stack.enter_context(library.LocalCluster(
                n_workers=where.workers, threads_per_worker=1, processes=True, host="127.0.0.1",
                dashboard_address="127.0.0.1:0", scheduler_kwargs={"dashboard": False}, silence_logs=logging.CRITICAL))
        client = stack.enter_context(library.Client(cluster))
        client.register_plugin(_ignoring_interrupts())
    _same_version(client)
    return client


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Processes that begin here are not ended by Ctrl-C: this one ends them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _ignoring_interrupts() -> Any:
    """A plugin for workers that begin later, in the place of one that ended."""
    from distributed import WorkerPlugin

    class IgnoreInterrupts(WorkerPlugin):
        """Ctrl-C is the business of the process that has begun the batch."""

        def setup(self, worker: object) -> None:
            """In the worker's main thread."""
            signal.signal(signal.SIGINT, signal.SIG_IGN)

    return IgnoreInterrupts()


def _same_version(client: Any) -> None:
    found = client.run(_version)
    other = {address: version for address, version in found.items() if version != VERSION}
    if not found:
        raise DiagnosticError([error("batch.no_worker", "the scheduler has no workers; start some with: dask worker "
                                     "tcp://HOST:8786 --nworkers auto --nthreads 1")])
    if other:
        address, version = next(iter(other.items()))
        raise DiagnosticError([error("batch.version", f"the worker at {address} has postproc {version}, here it is "
                                     f"{VERSION}; all need the same")])


def _version() -> str:
    return VERSION

