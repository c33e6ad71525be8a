"""What the tests of the report share: a small five-axis path with a hostile name, reported once."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from typer.testing import CliRunner

from postproc.cli.app import app
from tests.postproc.kit import SAMPLES

HOSTILE = "</script><script>window.hacked=1</script><img src=x onerror=window.hacked=2>"
CUTS = [f"GOTO/{2 * k},{k % 3},{10 + k % 2},{math.sin(0.02 * k):.8f},0,{math.cos(0.02 * k):.8f}" for k in range(12)]
LINES = ["PARTNO " + HOSTILE, "UNITS/MM", "MULTAX/ON", "LOADTL/4", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600", "RAPID",
         "GOTO/0,0,50,0,0,1", *CUTS, "RAPID",
         "GOTO/30,0,60,0,0,1", "FINI"]


@dataclass(frozen=True)
class Made:
    """A report: exit code, what was printed, the page and its JSON by place."""

    code: int
    said: str
    page: Path
    values: dict[str, Any]


def reported(*arguments: str, lines: tuple[str, ...] = tuple(LINES)) -> Made:
    """`postproc report` of CL lines on a trunnion machine under LinuxCNC, with further arguments."""
    folder = Path(mkdtemp())
    cl, page, figures = folder / "part.cls", folder / "r.html", folder / "r.json"
    cl.write_text("\n".join(lines) + "\n")
    given = [] if "-m" in arguments else ["-m", "mikron-ucp710"]
    given += [] if "-c" in arguments else ["-c", "linuxcnc"]
    done = CliRunner().invoke(app, ["report", str(cl), *given, "--setup", str(SAMPLES / "tools.setup.toml"), "-o", str(page),
                                    "--json", str(figures), *arguments])
    values = json.loads(figures.read_text()) if figures.exists() else {}
    return Made(done.exit_code, done.output, page, values)


@cache
def refused() -> Made:
    """The same with a point that the machine does not reach."""
    return reported(lines=tuple(line.replace("GOTO/30,0,60", "GOTO/30,0,9000") for line in LINES))


BALL = ["TOOL PATH/PASSES,TOOL,BALL16", "TLDATA/MILL,16.0000,8.0000,75.0000,0.0000,0.0000",
        "MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000", "LOAD/TOOL,4,ADJUST,4",
        "SPINDL/RPM,9000,CLW", "RAPID", "GOTO/0.0,0.0,30.0,0.0,0.0,1.0", "FEDRAT/MMPM,60000.0",
        *(f"GOTO/0.0,{float(k)},{0.01 * k * k:.6f}" for k in range(6)), "RAPID", "GOTO/0.0,5.0,30.0", "END-OF-PATH"]
"""one pass of a ball cutter with a fixed axis"""


@cache
def turned() -> Made:
    """A pass whose axis is chosen, on a machine with errors that are corrected."""
    return reported("--orient", "per-pass", "--units", "mm", "--error-model", str(SAMPLES / "errors/mikron-ucp710.toml"),
                    lines=tuple(BALL))


@cache
def along() -> Made:
    """The begin of the blade: a cut of a ball cutter along which the axis swings and may be turned by ten degrees."""
    setup = Path(mkdtemp()) / "cone.toml"
    setup.write_text("[orientation]\ncone = 10.0\n[tools.4]\ngauge_length = 130.25\n")
    lines = (SAMPLES / "blade.cls").read_text().splitlines()
    return reported("--orient", "auto", "--setup", str(setup), "-c", "siemens-840d", lines=(*lines[:50], *lines[-3:]))


@cache
def small() -> Made:
    """The small path under two controls."""
    return reported("-c", "linuxcnc", "-c", "siemens-840d")
