"""What an error model names is never lost to an output, and what a map or a program says of it is heeded."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from postproc.cli.app import app

ERRORS = Path("samples/errors")
COMMON = ["-m", "mikron-ucp710", "-c", "linuxcnc", "--setup", "samples/tools.setup.toml"]


@pytest.fixture
def model(tmp_path: Path) -> Path:
    for file in ERRORS.glob("mikron-ucp710*"):
        shutil.copy(file, tmp_path / file.name)
    return tmp_path / "mikron-ucp710.toml"


def table_of(model: Path) -> Path:
    return next(p for p in sorted(model.parent.glob("*.csv")) if p.name in model.read_text())


@pytest.mark.parametrize("command", [
    ["convert", "samples/pocket.cls", *COMMON, "--error-model", "MODEL", "-o", "TABLE"],
    ["convert", "samples/pocket.cls", *COMMON, "--error-model", "MODEL", "-o", "OTHER", "--json", "TABLE"],
    ["trace", "samples/pocket.cls", "--line", "30", *COMMON, "--error-model", "MODEL", "--json", "TABLE"],
    ["errors", "check", "MODEL", "-m", "mikron-ucp710", "--json", "TABLE"],
    ["errors", "to-map", "MODEL", "-m", "mikron-ucp710", "-o", "OTHER", "--json", "TABLE"]])
def test_no_output_replaces_a_table_of_the_model(command: list[str], model: Path, tmp_path: Path) -> None:
    table = table_of(model)
    before = table.read_bytes()
    known = {"MODEL": str(model), "TABLE": str(table), "OTHER": str(tmp_path / "other.toml")}
    run = CliRunner().invoke(app, [known.get(word, word) for word in command])
    assert run.exit_code == 2 and "would replace the error model" in " ".join(run.output.split())
    assert table.read_bytes() == before and not (tmp_path / "other.toml").exists()


def test_a_map_is_imported_as_its_first_line_says(model: Path, tmp_path: Path) -> None:
    made = CliRunner().invoke(app, ["errors", "to-map", str(model), "-m", "mikron-ucp710", "-o", str(tmp_path / "map.toml"),
                                    "--over", "XYZ", "--step", "X=350", "--step", "Y=275", "--step", "Z=250"])
    assert made.exit_code == 0, made.output
    lattice = next(p for p in tmp_path.glob("map*.csv"))
    assert "directions of the machine" in lattice.read_text().splitlines()[0]
    back = ["errors", "import", str(lattice), "-m", "mikron-ucp710", "-o", str(tmp_path / "back.toml")]
    refused = CliRunner().invoke(app, back)
    assert refused.exit_code == 1 and "error-import.directions" in refused.output
    assert "--directions machine" in refused.output and not (tmp_path / "back.toml").exists()
    assert CliRunner().invoke(app, [*back, "--directions", "machine"]).exit_code == 0
    long = CliRunner().invoke(app, [*back, "--directions", "machine", "--tool-length", "80"])
    assert long.exit_code == 1 and "error-import.tool_length" in long.output


def test_verify_names_the_model_that_the_program_was_written_with(model: Path, tmp_path: Path) -> None:
    program = tmp_path / "a.ngc"
    convert = ["convert", "samples/pocket.cls", *COMMON, "--error-model", str(model), "-o", str(program)]
    assert CliRunner().invoke(app, convert).exit_code == 0
    other = model.with_name("other.toml")
    other.write_text('machine = "mikron-ucp710"\n[location]\nEC0Y = 60.0\nEX0C = 40.0\n')
    verify = ["verify", str(program), "samples/pocket.cls", *COMMON, "--error-model"]
    assert CliRunner().invoke(app, [*verify, str(model)]).exit_code == 0
    run = CliRunner().invoke(app, [*verify, str(other)])
    assert run.exit_code == 1
    first = next(line for line in run.output.splitlines() if " error " in line)
    assert "verify.error_model" in first and "the error model mikron-ucp710, it is verified with other" in first
