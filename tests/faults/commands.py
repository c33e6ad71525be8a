"""Commands that write files, each called as a shop calls it, into one folder.

The command runs in a forked child of a process that has loaded everything: a call costs its own work alone, and may be
killed, limited or given another user without harm to others.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples"
MACHINE = ("-m", "mikron-ucp710")
TOOLS = ("--setup", str(SAMPLES / "tools.setup.toml"))


VARYING = ("seconds", "diagnostics")
"""keys of figures that no run repeats: times of stages, and what is said of files that stood there"""


@dataclass(frozen=True)
class Ended:
    """How a call ended: exit code (None where a signal ended it), the signal, all that it printed."""

    code: int | None
    signal: int
    text: str

    @property
    def clean(self) -> bool:
        """True for an exit code of DESIGN section 5 and no trace of Python."""
        return self.code in (0, 1, 2) and "Traceback" not in self.text and "internal error" not in self.text


def commands(inputs: Path) -> dict[str, tuple[str, ...]]:
    """name -> arguments; outputs are relative, to the folder in which the command runs. `inputs` takes what they read."""
    from tests.machines.sheet.test_sheet import TRUNNION

    small, part = inputs / "small.apt", inputs / "part.cls"
    small.write_text("UNITS/MM\nCUTTER/10\nLOADTL/1\nSPINDL/RPM,1000,CLW\nFEDRAT/MMPM,600\nRAPID\nGOTO/0,0,50,0,0,1\nGOTO/0,0,0\n"
                     "GOTO/20,0,0,0,.1,.99498743710662\nGOTO/20,20,0,0,0,1\nRAPID\nGOTO/0,0,50\nFINI\n")
    part.write_bytes((ROOT / "tests" / "golden" / "three_laws.cls").read_bytes())
    (inputs / "files.toml").write_text((SAMPLES / "tools.setup.toml").read_text() + "\n[output]\nfiles = true\n")
    (inputs / "shop.sheet.toml").write_text(TRUNNION)
    cl, figures = str(small), ("--json", "s.json")
    return {
        "convert": ("convert", cl, *MACHINE, "-c", "linuxcnc", *TOOLS, "-o", "p.ngc", *figures),
        "convert into files": ("convert", str(part), *MACHINE, "-c", "fanuc-30i", "--setup", str(inputs / "files.toml"),
                               "-o", "out/main.nc", "--json", "figures/s.json"),
        "setup new": ("setup", "new", cl, *MACHINE, "-c", "linuxcnc", "-o", "s.toml", "--yes", "--force", *figures),
        "machine new": ("machine", "new", str(inputs / "shop.sheet.toml"), "-o", "m.toml", "--drawing", "m.svg", "--force",
                        *figures),
        "machine export": ("machine", "export", "linuxcnc-xyzac-trt", "-o", "sim", *figures),
        "calibrate": ("calibrate", str(SAMPLES / "calibration" / "reversal.toml"), "-o", "e.toml", *figures),
        "errors import": ("errors", "import", str(SAMPLES / "errors" / "runs-mill-3axis-X.csv"), "-m", "mill-3axis", "-o",
                          "x.toml", "--average", *figures),
        "place": ("place", str(SAMPLES / "test_part.cls"), "-m", "mill-3axis", "--setup",
                  str(SAMPLES / "placement" / "mill.setup.toml"), "-o", "placed.toml", *figures),
        "orient": ("orient", str(SAMPLES / "test_part.cls"), *MACHINE, "--max-tilt", "60", "--figure", "o.svg", *figures),
        "time": ("time", cl, *MACHINE, "-c", "linuxcnc", *TOOLS, *figures),
        "inspect": ("inspect", cl, *figures),
    }


def load(words: tuple[str, ...], folder: Path) -> None:
    """Run a command in this process, for what it imports: children find that loaded."""
    from typer.testing import CliRunner

    from postproc.cli.app import app

    here = Path.cwd()
    os.chdir(folder)
    try:
        CliRunner().invoke(app, list(words))
    finally:
        os.chdir(here)


def started(words: tuple[str, ...], folder: Path, said: Path, before: Callable[[], None] = lambda: None) -> int:
    """Process of a command that runs in `folder` and prints into the file `said`; `before` runs in it first.

    It stands in its folder when this returns.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    stands, there = os.pipe()
    child = os.fork()
    if child:
        os.close(there)
        os.read(stands, 1)
        os.close(stands)
        return child
    code = 99
    try:
        os.close(stands)
        os.chdir(folder)
        handle = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
        os.close(there)
        os.dup2(handle, 1)
        os.dup2(handle, 2)
        for number, name in ((1, "stdout"), (2, "stderr")):
            setattr(sys, name, os.fdopen(number, "w", encoding="utf-8", closefd=False))
        before()
        code = _called(words)
        with contextlib.suppress(OSError):
            sys.stderr.flush()
    except BaseException:
        with contextlib.suppress(OSError):
            os.write(2, traceback.format_exc().encode())
    finally:
        os._exit(code)


def _called(words: tuple[str, ...]) -> int:
    from postproc.cli.shared.guard import guarded

    def command() -> None:
        from postproc.cli.app import app
        app()

    sys.argv = ["postproc", *words]
    return guarded(command)


def ended(child: int, said: Path) -> Ended:
    """How a process ended."""
    state = os.waitpid(child, 0)[1]
    text = said.read_text(encoding="utf-8", errors="replace") if said.is_file() else ""
    return Ended(os.WEXITSTATUS(state) if os.WIFEXITED(state) else None,
                 os.WTERMSIG(state) if os.WIFSIGNALED(state) else 0, text)


def run(words: tuple[str, ...], folder: Path, said: Path, before: Callable[[], None] = lambda: None) -> Ended:
    """A command, to its end."""
    return ended(started(words, folder, said, before), said)


def state(folder: Path) -> dict[str, bytes]:
    """Files below a folder, by name; figures without what no run repeats."""
    return {str(p.relative_to(folder)): _settled(p.read_bytes()) for p in sorted(folder.rglob("*")) if p.is_file()}


def _settled(content: bytes) -> bytes:
    """Figures without `VARYING`; all else, and what is no whole JSON text, as it is."""
    if not content.startswith(b"{"):
        return content
    try:
        value = json.loads(content, object_hook=lambda found: {k: v for k, v in found.items() if k not in VARYING})
    except ValueError:
        return content
    return json.dumps(value).encode()


def place(folder: Path, files: Mapping[str, bytes]) -> None:
    """Make the folder hold these files and no others."""
    for path in sorted(folder.rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
