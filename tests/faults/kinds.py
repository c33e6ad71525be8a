"""Faults that a command meets, each with the law that it keeps: files are old or new, all of one command together, no
temporaries stay, exit codes are 0, 1 or 2, and what is printed is no trace of Python."""

from __future__ import annotations

import os
import random
import resource
import shutil
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.faults.commands import Ended, ended, load, place, run, started, state

TEMPORARY = ".postproc-"
OLD = b"old\n"
NOBODY = 65534
"""user without rights (nobody), where the tests run as root"""


@dataclass(frozen=True)
class Bench:
    """A command with its place: the folder it writes into, what it prints, what it writes, seconds that it takes."""

    words: tuple[str, ...]
    folder: Path
    said: Path
    new: dict[str, bytes]
    seconds: float

    @property
    def old(self) -> dict[str, bytes]:
        """The files that stand there before."""
        return dict.fromkeys(self.new, OLD)


def bench(words: tuple[str, ...], folder: Path) -> Bench:
    """The command run once, undisturbed."""
    work, said = folder / "work", folder / "said.txt"
    work.mkdir(parents=True)
    warm = folder / "warm"
    warm.mkdir()
    load(words, warm)
    begun = time.perf_counter()
    got = run(words, work, said)
    if got.code != 0:
        raise RuntimeError(f"{' '.join(words)} ended with {got.code}: {got.text[-500:]}")
    return Bench(words, work, said, state(work), time.perf_counter() - begun)


def killed(one: Bench, count: int, chance: random.Random) -> Iterator[str]:
    """Killed at random moments, half of them in the last fifth, where files are written; then run again."""
    for _ in range(count):
        place(one.folder, one.old)
        late = chance.random() < 0.5
        moment = one.seconds * (chance.uniform(0.8, 1.1) if late else chance.uniform(0.0, 1.1))
        child = started(one.words, one.folder, one.said)
        time.sleep(moment)
        os.kill(child, signal.SIGKILL)
        ended(child, one.said)
        here = state(one.folder)
        files = {n: t for n, t in here.items() if TEMPORARY not in n}
        journal = any(n.endswith((".journal", ".pointer")) for n in here)
        if files not in (one.old, one.new) and not (journal and all(t in (OLD, one.new.get(n)) for n, t in files.items())):
            yield f"killed after {moment:.4f} s: {_differs(files, one)}"
        yield from _undisturbed(one, f"after a kill at {moment:.4f} s")


def _undisturbed(one: Bench, when: str) -> Iterator[str]:
    """The command runs and leaves its files, whole, and nothing else."""
    got = run(one.words, one.folder, one.said)
    if got.code != 0 or state(one.folder) != one.new:
        yield f"{when}: the next run ends with {got.code}: {_differs(state(one.folder), one)} {got.text[-300:]}"


def _differs(files: dict[str, bytes], one: Bench) -> str:
    return ", ".join(f"{n}: {'old' if files.get(n) == OLD else 'new' if files.get(n) == one.new.get(n) else 'neither'}"
                     for n in sorted({*files, *one.new}))


def _refused(one: Bench, got: Ended, when: str, *, may_pass: bool = False) -> Iterator[str]:
    """A command that cannot do its work: a message, exit code 1, everything as it was."""
    if may_pass and got.code == 0:
        if state(one.folder) != one.new:
            yield f"{when}: ended well, but {_differs(state(one.folder), one)}"
        return
    if not got.clean or got.code != 1 or not got.text.strip():
        yield f"{when}: exit code {got.code}, signal {got.signal}: {got.text[-400:]!r}"
    if state(one.folder) != one.old:
        yield f"{when}: {_differs(state(one.folder), one)}"


def full_disk(one: Bench, _count: int, _chance: random.Random) -> Iterator[str]:
    """No file may be longer than so many bytes (RLIMIT_FSIZE): what a full disk gives, at each place of each file."""
    longest = max(map(len, one.new.values()))
    for limit in sorted({0, 1, 100, longest // 2, longest - 1}):
        place(one.folder, one.old)

        def limited(limit: int = limit) -> None:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what is said on standard error stays
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))

        got = _said_through_a_pipe(one, limited)
        yield from _refused(one, got, f"files of at most {limit} bytes")


def _said_through_a_pipe(one: Bench, before: Callable[[], None]) -> Ended:
    """The command, its messages read from a pipe: no limit of files counts for it."""
    read, write = os.pipe()

    def piped() -> None:
        os.dup2(write, 2)
        os.close(read)
        before()

    child = started(one.words, one.folder, one.said, piped)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        text = pipe.read().decode(errors="replace")
    got = ended(child, one.said)
    return Ended(got.code, got.signal, text)


def read_only(one: Bench, _count: int, _chance: random.Random) -> Iterator[str]:
    """A folder that this user may not write, and caches that cannot be written."""
    place(one.folder, one.old)
    folders = [one.folder, *(p for p in one.folder.rglob("*") if p.is_dir())]

    def powerless() -> None:
        os.environ.update(HOME="/nonexistent", NUMBA_CACHE_DIR="/nonexistent/numba", XDG_CACHE_HOME="/nonexistent")
        if os.geteuid() == 0:
            os.setgid(NOBODY)
            os.setuid(NOBODY)

    for folder in folders:
        folder.chmod(0o555)
    try:
        yield from _refused(one, run(one.words, one.folder, one.said, powerless), "read-only folder")
    finally:
        for folder in folders:
            folder.chmod(0o755)


def vanished(one: Bench, count: int, chance: random.Random) -> Iterator[str]:
    """The folder goes away at a random moment: a message, never a trace of Python, and no folder half-made."""
    for _ in range(count):
        place(one.folder, {})
        moment = one.seconds * chance.uniform(0.0, 1.05)
        child = started(one.words, one.folder, one.said)
        time.sleep(moment)
        shutil.rmtree(one.folder, ignore_errors=True)
        got = ended(child, one.said)
        left = [p for p in one.folder.rglob("*") if TEMPORARY in p.name] if one.folder.exists() else []
        one.folder.mkdir(exist_ok=True)
        if not got.clean or left:
            yield f"folder gone after {moment:.4f} s: exit code {got.code}, {left} {got.text[-400:]!r}"


def two_writers(one: Bench, count: int, _chance: random.Random) -> Iterator[str]:
    """Two and three runs at once: files of one of them, and nothing else."""
    for number in range(count):
        place(one.folder, one.old)
        said = [one.said.with_name(f"said{k}.txt") for k in range(2 + number % 2)]
        children = [started(one.words, one.folder, text) for text in said]
        got = [ended(child, text) for child, text in zip(children, said, strict=True)]
        if any(g.code != 0 for g in got) or state(one.folder) != one.new:
            yield f"{len(said)} writers: {[g.code for g in got]} {_differs(state(one.folder), one)} {got[0].text[-300:]}"


def nobody_reads(one: Bench, _count: int, _chance: random.Random) -> Iterator[str]:
    """Standard output or error leads to a closed pipe, to a full device, nowhere: files are whole, old or new."""

    def broken(*numbers: int) -> None:
        read, write = os.pipe()
        os.close(read)
        for number in numbers:
            os.dup2(write, number)

    def full(*numbers: int) -> None:
        for number in numbers:
            os.dup2(os.open("/dev/full", os.O_WRONLY), number)

    def closed(*numbers: int) -> None:
        for number in numbers:
            os.close(number)

    for how in (broken, full, closed):
        for numbers in ((1,), (2,), (1, 2), (0, 1, 2)):
            place(one.folder, one.old)
            got = run(one.words, one.folder, one.said, lambda how=how, numbers=numbers: how(*numbers))
            here = state(one.folder)
            if not got.clean or here not in (one.old, one.new) or (got.code == 0 and here != one.new):
                yield f"{how.__name__} {numbers}: exit code {got.code} {_differs(here, one)} {got.text[-300:]}"


def clock_jumps(one: Bench, count: int, chance: random.Random) -> Iterator[str]:
    """A clock that goes back and forth by years: the same bytes."""
    for _ in range(max(1, count // 10)):
        place(one.folder, one.old)

        def jumping(seed: int = chance.randrange(10**9)) -> None:
            clock = random.Random(seed)
            time.time = lambda: clock.uniform(0.0, 4e9)
            time.time_ns = lambda: int(clock.uniform(0.0, 4e18))

        got = run(one.words, one.folder, one.said, jumping)
        if got.code != 0 or state(one.folder) != one.new:
            yield f"clock: exit code {got.code} {_differs(state(one.folder), one)} {got.text[-300:]}"


def memory(one: Bench, count: int, chance: random.Random) -> Iterator[str]:
    """So many MB more than what is loaded (RLIMIT_AS): it is done, or a message says that memory is used up."""
    for _ in range(count):
        place(one.folder, one.old)
        more = chance.choice((0, 1, 2, 4, 8, 16, 32, 64, 128)) * 2**20 + chance.randrange(2**20)

        def limited(more: int = more) -> None:
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            limit = pages * resource.getpagesize() + more
            resource.setrlimit(resource.RLIMIT_AS, (limit, limit))

        got = run(one.words, one.folder, one.said, limited)
        yield from _refused(one, got, f"{more >> 10} kB more memory", may_pass=True)


KINDS: dict[str, Callable[[Bench, int, random.Random], Iterator[str]]] = {
    "killed": killed, "full disk": full_disk, "read-only": read_only, "vanished": vanished, "two writers": two_writers,
    "nobody reads": nobody_reads, "clock": clock_jumps, "memory": memory}
