"""Conversions whose bytes must be the same wherever they are made; as a command it makes all and prints a hash each.

    python -m tests.determinism.cases FOLDER [QUICK]
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples"
TOOLS = ("--setup", "samples/tools.setup.toml")
QUICK = {
    "planned": ("convert", "samples/pocket.cls", "-m", "mikron-ucp710", "-c", "siemens-840d", "--feed", "planned"),
    "tour": ("convert", "samples/tool_axis_tour.apt", "-m", "fork-head-ab", "-c", "heidenhain-tnc640", *TOOLS)}
"""by name: the command without its outputs; a part of `CASES`"""
CASES = QUICK | {
    "pocket": ("convert", "samples/pocket.cls", "-m", "mill-3axis", "-c", "linuxcnc", *TOOLS),
    "five_faces": ("convert", "samples/five_faces.cls", "-m", "mikron-ucp710", "-c", "fanuc-30i"),
    "smooth": ("convert", "samples/test_part.cls", "-m", "mikron-ucp710", "-c", "siemens-840d", "--smooth"),
    "corrected": ("convert", "samples/five_faces.cls", "-m", "mikron-ucp710", "-c", "linuxcnc", "--error-model",
                  "samples/errors/mikron-ucp710.toml"),
    "dome": ("convert", "samples/h4a_dome.cls", "-m", "h4a-c-table", "-c", "linuxcnc", "--setup", "samples/h4a.setup.toml"),
    "delta": ("convert", "samples/pocket.cls", "-m", "uranesx", "-c", "linuxcnc", "--setup", "samples/delta.setup.toml"),
    "orient": ("convert", "samples/test_part.cls", "-m", "mikron-ucp710", "-c", "linuxcnc", "--orient", "auto"),
    "blade": ("convert", "samples/blade.cls", "-m", "mikron-ucp710", "-c", "haas-ngc", "--feed", "planned")}


def made(name: str, folder: Path) -> str:
    """SHA-256 over the program and its JSON, without paths and without what a clock said, of a case that is run here."""
    from typer.testing import CliRunner

    from postproc.cli.app import app

    program, values = folder / f"{name}.nc", folder / f"{name}.json"
    done = CliRunner().invoke(app, [*CASES[name], "-o", str(program), "--json", str(values), "-q"])
    if done.exit_code:
        raise SystemExit(f"{name}: {done.output}")
    told = json.loads(values.read_text("utf-8").replace(str(folder), ""))
    told["witness"].pop("seconds")
    return hashlib.sha256(program.read_bytes() + json.dumps(told).encode()).hexdigest()


def main() -> None:
    folder = Path(sys.argv[1])
    os.chdir(ROOT)
    for name in (QUICK if sys.argv[2:] else CASES):
        print(name, made(name, folder))


if __name__ == "__main__":
    main()
