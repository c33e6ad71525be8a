"""LinuxCNC's motion control as an independent machine: programs run headless, faster than real time."""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np

from machines.machine import Machine
from tests.linuxcnc import config
from tests.linuxcnc.interpreter import HERE, SYSTEM_PYTHON, ToolEntry
from toolpaths.arrays import Array, Floats

NOBODY = 65534
DELAY = 2
"""Servo cycles by which LinuxCNC's joint commands (interpolated) trail the pose that they belong to."""
ATTEMPTS = 3
"""On a busy host LinuxCNC may take a pause for one before the motion ahead of it has begun."""
RECORDINGS = 6
"""Most recordings of one program whose time counts."""
AGREE = 0.002
"""Share of the time that a busy host may have cost, or by which the two shortest recordings differ."""
HUNGRY = 0.01
"""Share of looks at a nearly empty motion queue from which short blocks may have been run slower than they could be."""
STILL = 1e-10
"""mm or degrees per servo cycle that count as no motion: LinuxCNC may compute a joint again while it rests"""
REST = 8
"""Servo cycles without motion that count as standing still."""
_APART = ("unshare", "--ipc", "--net", "--pid", "--fork", "--kill-child", "--mount-proc")
_AS_NOBODY = ("setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups")
_HAL_KEYS = (0x48414C32, 0x90280A48, 0x48484C34, 0x48534130, 0x64)
"""System V keys that LinuxCNC's realtime layer always uses: HAL, RTAPI, its mutex, the sampler, motion."""


@dataclass(frozen=True)
class Run:
    """One row per servo cycle of 1 ms, from the start of the program to its end.

    Attributes:
        t (N,): s, time of the machine, whatever the speed of the host
        joints (N, J): commanded, mm and degrees, the order of `Machine.axis_names`
        pose (N, A): the pose that they serve, with work offset and tool length, mm and degrees, letters of `axes`
        line (N,): line of the program being executed, 0 where none is
        axes: letters of the program
        errors: what the control had to say; a run with errors has usually stopped early
        starved: share of looks at which the motion queue was nearly empty; above a few percent in a program
            of many short blocks the host was too slow, and a smaller warp is called for
    """

    t: Floats
    joints: Floats
    pose: Floats
    line: Array
    axes: str
    errors: tuple[str, ...]
    starved: float
    waited: float

    @property
    def seconds(self) -> float:
        """Machine time from the first to the last motion."""
        moved = np.flatnonzero(np.any(np.diff(self.joints, axis=0) != 0, axis=1))
        return float(self.t[moved[-1] + 1] - self.t[moved[0]]) if len(moved) else 0.0

    @property
    def uncertain(self) -> bool:
        """Whether a busy host may have made the machine time longer: motion stood, or its queue was nearly
        empty, and the processes that feed it waited for a processor."""
        moves = np.any(np.diff(self.joints, axis=0) != 0, axis=1)
        still = (self.seconds - moves.sum() * config.PERIOD) if moves.any() else 0.0
        return self.waited > AGREE * self.seconds and (still > AGREE * self.seconds or self.starved > HUNGRY)


def missing() -> str:
    """Why the simulator cannot be used here, "" where it can."""
    for program in ("rtapi_app", "milltask", "linuxcncsvr", "halcmd", "io"):
        if shutil.which(program) is None:
            return f"LinuxCNC's simulator is not installed: no {program} (Debian: apt-get install linuxcnc-uspace)"
    if shutil.which("gcc") is None:
        return "the simulator's clock needs gcc"
    if os.getuid() == 0 and shutil.which("setpriv") is None:
        return "LinuxCNC does not run as root, and there is no setpriv to leave it"
    return ""


def simulate(machine: Machine, program: str | Path, tools: Mapping[int, ToolEntry | tuple[float, float]] | None = None,
             warp: int | Fraction = 10, time_limit: float = 300.0) -> Run:
    """Run a G-code file on LinuxCNC configured as `machine`, from its home; M0 and M1 go on by themselves.

    The machine's own kinematics module runs where `control_kinematics` names one, else joints are the program's axes.

    Args:
        machine: travel, velocity, acceleration and home come from it. LinuxCNC knows no jerk.
        program: the file.
        tools: tool table, number to (length offset z, diameter) in mm.
        warp: how much faster than real time, slower below 1; 1000 blocks per s of machine time need 4 or less.
        time_limit: s of the host.

    Raises:
        RuntimeError: where LinuxCNC did not come up or lost samples; what it refuses in the program is in `Run.errors`.
    """
    folder = Path(tempfile.mkdtemp(prefix="postproc-sim-"))
    try:
        shutil.copyfile(program, folder / "program.ngc")
        shutil.copyfile(HERE / "session.py", folder / "session.py")
        config.write(folder, machine, tools or {}, warp, time_limit)
        (folder / "clock.so").write_bytes(_clock())
        _launch(folder, time_limit)
        return _result(folder, machine, warp)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def recorded(machine: Machine, program: str | Path, tools: Mapping[int, ToolEntry | tuple[float, float]] | None = None,
             warp: int = 10) -> Run:
    """`simulate` for its time: a recording that a busy host may have made longer is made again, each time at half the warp.

    What the host costs only adds, so that the shortest counts; two that agree are enough.
    """
    runs: list[Run] = []
    for attempt in range(RECORDINGS):
        runs.append(simulate(machine, program, tools, Fraction(warp, 2**attempt)))
        if runs[-1].errors or not runs[-1].uncertain:
            return runs[-1]
        runs.sort(key=lambda run: run.seconds)
        if len(runs) > 1 and runs[1].seconds - runs[0].seconds <= AGREE * runs[0].seconds:
            break
    return runs[0]


def standstill(machine: Machine, poses: Floats, tool_length: float = 0.0, warp: int = 10) -> Floats:
    """Joints (N, J), mm and degrees, at which LinuxCNC comes to rest for each program position.

    Args:
        machine: its velocities do not matter here.
        poses: (N, A) in the order of `config.letters(machine)`, mm and degrees.
        tool_length: mm, as tool length offset.

    Raises:
        RuntimeError: where the control complains or does not rest at every pose.
    """
    fast = np.full(len(machine.axis_names), 1e4)
    quick = replace(machine, limits=replace(machine.limits, velocity=fast, acceleration=fast * 100))
    shift = np.where(np.array(list(config.letters(machine))) == "Z", tool_length, 0.0)
    joints = np.full((len(poses), len(machine.axis_names)), np.nan)
    for _ in range(ATTEMPTS):
        wanted = np.flatnonzero(np.isnan(joints[:, 0]))
        run = _stop_at(quick, poses[wanted], tool_length, warp)
        rests = _rests(run)
        there = np.abs(run.pose[rests] - (poses[wanted] + shift)[:, None]).max(axis=2) < 1e-7
        found = there.any(axis=1)
        joints[wanted[found]] = run.joints[rests[there.argmax(axis=1)[found]]]
        if np.all(found):
            return joints
    raise RuntimeError(f"no rest at {np.sum(~found)} of {len(poses)} poses; {'; '.join(run.errors)}")


def _stop_at(machine: Machine, poses: Floats, tool_length: float, warp: int) -> Run:
    """Run a program that goes to each pose and pauses there, twice: see ATTEMPTS."""
    axes = config.letters(machine)
    moves = ("G0 " + " ".join(f"{a}{v:.9f}" for a, v in zip(axes, row, strict=True)) + "\nM0\nM0" for row in poses)
    with tempfile.TemporaryDirectory(prefix="postproc-rest-") as name:
        program = Path(name) / "rest.ngc"
        program.write_text("\n".join(["G21 G90 G61", "T1 M6", "G43 H1", *moves, "M2", ""]))
        return simulate(machine, program, {1: ToolEntry(z=tool_length)}, warp)


def _rests(run: Run) -> Array:
    """Rows (M,) of the end of each standstill of at least REST cycles."""
    still = np.concatenate([[False], np.all(np.abs(np.diff(run.joints, axis=0)) < STILL, axis=1), [False]])
    edges = np.flatnonzero(np.diff(still.astype(np.int8)))
    starts, ends = edges[::2], edges[1::2]
    return ends[ends - starts >= REST] - 1


@cache
def _clock() -> bytes:
    """The compiled clock.c."""
    with tempfile.TemporaryDirectory(prefix="postproc-clock-") as name:
        library = Path(name) / "clock.so"
        subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-o", library, HERE / "clock.c", "-ldl"], check=True)
        return library.read_bytes()


@cache
def _isolation() -> tuple[str, ...]:
    """Command prefix that gives a session its own shared memory, processes and no network; () where not allowed."""
    prefix = _APART if os.getuid() == 0 else (_APART[0], "--user", "--map-current-user", *_APART[1:])
    works = subprocess.run([*prefix, "true"], capture_output=True, check=False).returncode == 0
    return prefix if works else ()


def _identity() -> tuple[str, ...]:
    """Command prefix that leaves root, as which LinuxCNC refuses to run."""
    return _AS_NOBODY if os.getuid() == 0 else ()


def _launch(folder: Path, time_limit: float) -> None:
    if os.getuid() == 0:
        for path in (folder, *folder.iterdir()):
            os.chown(path, NOBODY, NOBODY)
    command = [*_isolation(), *_identity(), SYSTEM_PYTHON, "-B", folder / "session.py", folder]
    with nullcontext() if _isolation() else _alone(), (folder / "stderr").open("w") as stderr:
        process = subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=stderr,
                                   stderr=stderr)
        try:
            code = process.wait(time_limit + 60.0)
        except BaseException:
            if _isolation():
                process.kill()
            else:
                process.terminate()
            process.wait(10.0)
            raise
    if code or not (folder / "result.json").exists():
        log = [line for name in ("log", "stderr") if (folder / name).exists()
               for line in (folder / name).read_text(errors="replace").splitlines()[-15:]]
        raise RuntimeError("LinuxCNC did not run:\n" + "\n".join(log))


@contextmanager
def _alone() -> Iterator[None]:
    """Without isolation one session at a time, none next to a LinuxCNC of somebody else, and nothing left behind."""
    lock = os.open(tempfile.gettempdir(), os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        before = _shared_objects()
        if any(key in _HAL_KEYS for _, key, _ in before):
            raise RuntimeError("another LinuxCNC is running on this computer")
        try:
            yield
        finally:
            for kind, key, number in _shared_objects() - before:
                if key in (*_HAL_KEYS, *config.NML_KEYS):
                    remove = [*_identity(), "ipcrm", "-m" if kind == "shm" else "-s", str(number)]
                    subprocess.run(remove, capture_output=True, check=False)
    finally:
        os.close(lock)


def _shared_objects() -> set[tuple[str, int, int]]:
    """(kind, key, id) of the System V shared memory and semaphores of this computer."""
    return {(kind, int(key) & 0xFFFFFFFF, int(number)) for kind in ("shm", "sem")
            for key, number, *_ in map(str.split, Path(f"/proc/sysvipc/{kind}").read_text().splitlines()[1:])}


def _result(folder: Path, machine: Machine, warp: int | Fraction) -> Run:
    result, axes = json.loads((folder / "result.json").read_text()), config.letters(machine)
    joints = len(machine.axis_names)
    rows = np.fromfile(folder / "samples.f64").reshape(-1, 1 + joints + len(axes) + 2)
    if result["lost"] or np.any(np.diff(rows[:, 0]) != 1):
        raise RuntimeError(f"{result['lost']} samples lost; use a smaller warp")
    if len(rows) <= DELAY and not result["errors"]:
        raise RuntimeError("no samples")
    late, early = rows[DELAY:], rows[:len(rows) - DELAY] if len(rows) > DELAY else rows[:0]
    return Run(t=(late[:, 0] - late[:1, 0]) * config.PERIOD, joints=late[:, 1:1 + joints],
               pose=early[:, 1 + joints:1 + joints + len(axes)], line=early[:, -2].astype(np.int64), axes=axes,
               errors=tuple(result["errors"]), starved=result["starved"], waited=result["waited"] * float(warp))
