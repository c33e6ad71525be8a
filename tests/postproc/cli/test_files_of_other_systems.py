"""Files as other systems write them: encodings, line ends, names with spaces and letters beyond ASCII."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from postproc.cli.app import app
from tests.postproc.kit import SAMPLES

LINES = ["PARTNO Größe Ä", "UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600", "RAPID", "GOTO/0,0,50",
         "GOTO/0,0,0", "GOTO/20,0,0", "RAPID", "GOTO/20,0,50", "FINI", ""]
ON = ["-m", "mill-3axis", "-c", "linuxcnc", "--setup", str(SAMPLES / "tools.setup.toml"), "-q"]


def program(folder: Path, encoding: str, end: str) -> list[str]:
    """The lines of the program of the file in an encoding, verified, but for those that name files."""
    folder.mkdir()
    part, out = folder / "Teil Größe 1.cls", folder / "N C" / "Teil 1.ngc"
    out.parent.mkdir()
    part.write_bytes(end.join(LINES).encode(encoding))
    for words in (["convert", str(part), *ON, "-o", str(out)], ["verify", str(out), str(part), *ON]):
        done = CliRunner().invoke(app, words)
        assert done.exit_code == 0 and "Traceback" not in done.output, done.output
    return [line for line in out.read_text("utf-8").splitlines() if "source" not in line]


def test_encodings_and_line_ends_change_nothing(tmp_path: Path) -> None:
    """UTF-16 with its mark and cp1252 of Windows, CRLF, old CR: the program of the plain file."""
    plain = program(tmp_path / "plain", "utf-8", "\n")
    assert sum(line.startswith("G1") or " G1" in line for line in plain) >= 1
    for encoding, end in (("utf-16", "\r\n"), ("cp1252", "\r\n"), ("utf-8-sig", "\r\n"), ("utf-16-be", "\n"),
                          ("utf-32", "\n"), ("utf-16-le", "\r\n"), ("cp1252", "\r")):
        found = program(tmp_path / f"{encoding} {len(end)}{ord(end[0])}", encoding, end)
        assert found == plain, (encoding, end)
