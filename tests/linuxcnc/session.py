"""Run one program through a whole headless LinuxCNC and record every servo cycle.

A script for Debian's own Python, which has the `linuxcnc` and `hal` modules: session.py JOB_FOLDER. The
folder holds what simulator.py wrote there (job.json, sim.ini, sim.nml, sim.hal, program.ngc ...) and receives
samples.f64 (one row
per servo cycle: its number, then the pins of the sampler) and result.json. Only processes started here are ended.
"""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from array import array
from pathlib import Path

PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36
POLL = 0.005
IDLE_POLLS = 6
PAUSE = 20
"""Servo cycles that M0 and M1 last."""
START_LIMIT = 60.0
WAITED_FOR = ("milltask", "io", "linuxcncsvr")
"""Processes for which a motion that has stopped waits; the servo cycles themselves stand still with their own."""


class Session:
    """The processes of one LinuxCNC; leaving the context ends them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.job = json.loads((folder / "job.json").read_text())
        self.env = {**os.environ, "HOME": str(folder), "INI_FILE_NAME": str(folder / "sim.ini"), "LANG": "C",
                    "NMLFILE": str(folder / "sim.nml"), "RTAPI_FIFO_PATH": str(folder / "fifo"),
                    "HAL_RTMOD_DIR": self.job["modules"], "LINUXCNC_FORCE_REALTIME": "0"}
        self.env.pop("DISPLAY", None)
        self.warped = {**self.env, "LD_PRELOAD": str(folder / "clock.so"), "WARP": self.job["warp"]}
        self.log = (folder / "log").open("w")

    def __enter__(self) -> Session:
        """End with the caller, and adopt the daemons of LinuxCNC's programs, so that they can be ended too."""
        prctl = ctypes.CDLL(None).prctl
        prctl(PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
        prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        os.environ.update(self.env)
        return self

    def __exit__(self, *_: object) -> None:
        for sign, patience in ((signal.SIGTERM, 0.3), (signal.SIGKILL, 2.0)):
            deadline = time.monotonic() + patience
            for pid in descendants(os.getpid()):
                os.kill(pid, sign)
            while time.monotonic() < deadline and any_child():
                time.sleep(0.02)
        self.log.close()

    def start(self, *command: str, warped: bool = True) -> subprocess.Popen[bytes]:
        """A process of the session, left running."""
        return subprocess.Popen(command, cwd=self.folder, env=self.warped if warped else self.env,
                                stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log)

    def call(self, *command: str, warped: bool = False) -> None:
        """A process of the session that must end well."""
        code = self.start(*command, warped=warped).wait(60)
        if code:
            raise RuntimeError(f"{' '.join(command)} ended with code {code}")

    def load_realtime(self) -> None:
        """The modules, in a copy of rtapi_app that is not setuid: that one takes the preload and needs no root.

        The first call becomes the realtime process itself and stays; the later ones talk to it.
        """
        copy = self.folder / "rtapi_app"
        shutil.copyfile("/usr/bin/rtapi_app", copy)
        copy.chmod(0o755)
        first, *rest = self.job["realtime"]
        master = self.start(str(copy), "load", *first)
        wait(lambda: (self.folder / "fifo").exists() or master.poll() is not None, "the realtime process")
        time.sleep(0.2)
        for module in rest:
            self.call(str(copy), "load", *module)

    def bring_up(self) -> None:
        """Everything up to a controller that listens."""
        ini = str(self.folder / "sim.ini")
        self.call("linuxcncsvr", "-ini", ini, warped=True)
        self.load_realtime()
        self.call("halcmd", "loadusr", "-Wn", "iocontrol", "io", "-ini", ini, warped=True)
        self.call("halcmd", "-f", str(self.folder / "sim.hal"))
        self.call("halcmd", "start")
        self.start("milltask", "-ini", ini)


def descendants(root: int) -> list[int]:
    """Processes below `root`, itself left out, that still run."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = stat.read_text().rsplit(")", 1)[1].split()[:2]
        except OSError:
            continue
        if state != "Z":
            parents[int(stat.parent.name)] = int(parent)
    found, front = [], [root]
    while front:
        front = [pid for pid, parent in parents.items() if parent in front]
        found += front
    return found


def any_child() -> bool:
    """Bury the children that have ended; True while others live."""
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        return False
    return True


def waited(names: tuple[str, ...]) -> float:
    """s that the session's processes of these names have been ready to run and waited for a processor."""
    total = 0
    for pid in descendants(os.getpid()):
        try:
            if Path(f"/proc/{pid}/comm").read_text().strip() in names:
                total += sum(int(task.read_text().split()[1]) for task in Path(f"/proc/{pid}/task").glob("*/schedstat"))
        except (OSError, IndexError):
            continue
    return total / 1e9


def wait(condition, what: str, limit: float = START_LIMIT) -> None:
    deadline = time.monotonic() + limit
    while not condition():
        if time.monotonic() > deadline:
            raise RuntimeError(f"{what} did not come up in {limit:g} s")
        time.sleep(0.02)


class Controller:
    """LinuxCNC as a user sees it: switched on, homed, running one program."""

    def __init__(self, session: Session) -> None:
        import linuxcnc

        self.api, self.joints = linuxcnc, session.job["joints"]
        linuxcnc.nmlfile = str(session.folder / "sim.nml")
        self.errors: list[str] = []
        self.stat = None
        wait(self._connect, "the controller")
        self.command, self.channel = linuxcnc.command(), linuxcnc.error_channel()

    def _connect(self) -> bool:
        try:
            self.stat = self.api.stat()
            self.stat.poll()
        except (self.api.error, SystemError):  # of a status that is not there yet
            return False
        return self.stat.joints == self.joints

    def poll(self) -> None:
        """Newest status, and the errors since the last call."""
        self.stat.poll()
        while message := self.channel.poll():
            if message[0] in (self.api.NML_ERROR, self.api.OPERATOR_ERROR):
                self.errors.append(message[1])

    def until(self, condition, what: str) -> None:
        def polled() -> bool:
            self.poll()
            return condition(self.stat)

        try:
            wait(polled, what)
        except RuntimeError as fault:
            raise RuntimeError(f"{fault}; {'; '.join(self.errors)}") from None

    def make_ready(self, program: Path) -> None:
        """Estop off, power on, all joints homed where they stand, automatic mode, program open."""
        api, command = self.api, self.command
        command.state(api.STATE_ESTOP_RESET)
        self.until(lambda s: s.task_state != api.STATE_ESTOP, "estop reset")
        command.state(api.STATE_ON)
        self.until(lambda s: s.task_state == api.STATE_ON, "power")
        command.mode(api.MODE_MANUAL)
        command.wait_complete()
        command.home(-1)
        self.until(lambda s: all(s.homed[:self.joints]), "homing")
        command.mode(api.MODE_AUTO)
        self.until(lambda s: s.task_mode == api.MODE_AUTO, "automatic mode")
        command.program_open(str(program))
        command.wait_complete()
        self.poll()

    @property
    def heard(self) -> bool:
        """True once the last command has been taken up."""
        return self.stat.echo_serial_number == self.command.serial

    @property
    def busy(self) -> bool:
        return self.stat.interp_state != self.api.INTERP_IDLE or not self.stat.inpos or self.stat.queue > 0


class Recorder:
    """The sampler's stream of servo cycles."""

    def __init__(self, pins: str) -> None:
        import hal

        self.component = hal.component(f"recorder{os.getpid()}")
        self.component.ready()
        self.stream = hal.stream(self.component, hal.sampler_base, pins)
        self.rows = array("d")
        self.drain()
        self.rows = array("d")
        self.lost = self.stream.num_overruns

    @property
    def newest(self) -> int:
        """Number of the last servo cycle seen."""
        return self.stream.sampleno

    def drain(self) -> None:
        """Take what has come in."""
        while self.stream.readable:
            row = self.stream.read()
            if row is None:
                return
            self.rows.append(self.stream.sampleno)
            self.rows.extend(row)

    def close(self) -> int:
        """Samples lost since the start."""
        self.drain()
        lost = self.stream.num_overruns - self.lost
        del self.stream
        self.component.exit()
        return lost


def run_program(controller: Controller, recorder: Recorder, limit: float) -> dict[str, float]:
    """Run to the end, recording. Returns how often the motion queue was found nearly empty, and s waited for a processor."""
    before = waited(WAITED_FOR)
    api, deadline = controller.api, time.monotonic() + limit
    controller.command.auto(api.AUTO_RUN, 0)
    idle, polls, low, paused_at = 0, 0, 0, 0
    while idle < IDLE_POLLS:
        recorder.drain()
        controller.poll()
        idle = idle + 1 if controller.heard and not controller.busy else 0
        if controller.stat.interp_state in (api.INTERP_READING, api.INTERP_WAITING):
            polls, low = polls + 1, low + (controller.stat.queue < 5)
        if controller.heard and controller.stat.interp_state == api.INTERP_PAUSED:
            paused_at = paused_at or recorder.newest
            if recorder.newest >= paused_at + PAUSE:
                controller.command.auto(api.AUTO_RESUME)
                paused_at = 0
        if time.monotonic() > deadline:
            controller.command.abort()
            raise RuntimeError(f"the program did not end in {limit:g} s")
        time.sleep(POLL)
    return {"starved": low / max(polls, 1), "waited": waited(WAITED_FOR) - before}


def main() -> None:
    folder = Path(sys.argv[1])
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    with Session(folder) as session:
        session.bring_up()
        controller = Controller(session)
        controller.make_ready(folder / "program.ngc")
        recorder = Recorder(session.job["pins"])
        result = run_program(controller, recorder, session.job["time_limit"])
        controller.poll()
        result["lost"] = recorder.close()
        result["errors"] = controller.errors
        (folder / "samples.f64").write_bytes(recorder.rows.tobytes())
    (folder / "result.json").write_text(json.dumps(result))


if __name__ == "__main__":
    main()
