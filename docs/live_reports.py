"""Reports and a dossier as the commands write them, next to the site's pages: `conf.py` has them made with the site."""

from __future__ import annotations

import shutil
from pathlib import Path

from typer.testing import CliRunner

from postproc.cli.app import app

ROOT = Path(__file__).parents[1]
COMMANDS = {
    "first-program.html": ["report", "samples/five_faces.cls", "-m", "mikron-ucp710", "-c", "linuxcnc", "-c",
                           "siemens-840d", "--setup", "samples/tools.setup.toml"],
    "corrected.html": ["report", "samples/test_part.cls", "-m", "mikron-ucp710", "-c", "siemens-840d", "--orient",
                       "per-pass", "--error-model", "samples/errors/mikron-ucp710.toml", "--setup",
                       "samples/bodies/test_part.setup.toml"],
    "machine.html": ["machine", "report", "uranesx", "-c", "linuxcnc"]}
"""file: the command that writes it, called from the project's folder"""


def write_reports(folder: Path) -> None:
    """All of them, from scratch.

    Raises:
        RuntimeError: with what a command has said that did not write its page.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, words in COMMANDS.items():
        made = folder / name
        given = [str(ROOT / word) if word.startswith("samples/") else word for word in words]
        ran = CliRunner().invoke(app, [*given, "-o", str(made), "-q"])
        if ran.exit_code or not made.exists():
            raise RuntimeError(f"postproc {' '.join(words)}: {ran.output}")
