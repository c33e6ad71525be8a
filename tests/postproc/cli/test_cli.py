"""The command line as others call it: keys, exit codes, streams, refusals."""

from __future__ import annotations

import errno
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner, Result

from postproc.cli.app import app, main
from postproc.cli.shared.group import only_called
from tests.postproc.kit import HEAD, SAMPLES, TOOLS
from toolpaths.cl.text.dialects import DIALECTS

MILL = ["-m", "mill-3axis", "-c", "linuxcnc"]
POCKET = str(SAMPLES / "pocket.cls")


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


def figures(*arguments: str | Path) -> dict[str, Any]:
    got = run(*arguments, "--json", "-")
    assert got.exit_code == 0, got.stderr
    found = json.loads(got.stdout)
    assert (found["schema_version"], found["ok"]) == (1, True)
    return found


def cl(folder: Path, *lines: str) -> Path:
    path = folder / "part.apt"
    path.write_text("\n".join([*HEAD, *lines, "FINI"]))
    return path


def test_convert_keys(tmp_path: Path) -> None:
    out = tmp_path / "p.ngc"
    d = figures("convert", POCKET, *MILL, "-o", out)
    assert d["output"] == str(out) and out.exists()
    assert (d["points_in"], d["rewinds"], d["singular_events"]) == (96, 0, 0)
    assert d["lower_bound_s"] < d["cycle_time_s"] < d["band_s"][1]
    assert sum(op["time_s"] for op in d["time"]["operations"]) == pytest.approx(d["cycle_time_s"], rel=1e-6)
    moving = [n for n in out.read_text().splitlines() if re.search(r"[XYZ]-?\d", n) and not n.startswith("(")]
    holes = 6 * 2 + sum(3 * 2 for _ in range(2))
    assert len(moving) <= d["blocks_out"] <= len(moving) + 10 * holes
    assert 0 <= d["worst_tip_deviation_mm"] < 0.01 and d["worst_axis_deviation_deg"] == 0
    assert set(d["axis_extents"]) == {"X", "Y", "Z"}
    assert d["axis_extents"]["X"] == pytest.approx([-56, 56]) and d["axis_extents"]["Z"][1] == 400
    assert {x["severity"] for x in d["diagnostics"]} <= {"info", "warning"}
    assert {"code", "message", "file", "lines", "count", "hint"} <= set(d["diagnostics"][0])


def test_verify_and_inspect_keys(tmp_path: Path) -> None:
    out = tmp_path / "p.ngc"
    assert run("convert", POCKET, *MILL, "-o", out).exit_code == 0
    d = figures("verify", out, POCKET, *MILL)
    assert d["proved"] is True and d["gcode"] == str(out) and d["worst_tip_deviation_mm"] < 1e-3
    d = figures("inspect", POCKET)
    assert {"points", "rapids", "arcs", "cycles", "operations", "tools", "units", "five_axis", "length_mm", "extents",
            "unknown_words", "diagnostics"} <= set(d)
    want = json.loads((SAMPLES / "expected_counts.json").read_text())["pocket.cls"]
    assert (d["points"], d["arcs"], d["rapids"], d["five_axis"]) == (want["points"], want["arcs"],
                                                                     want["rapids"], False)
    assert d["extents"]["x"] == pytest.approx(want["extents_mm"]["x"], abs=1e-3)


def test_lists_and_shows() -> None:
    found = {m["name"]: m for m in figures("machine", "list")["machines"]}
    assert found["mikron-ucp710"]["axes"] == ["X", "Y", "Z", "A", "C"]
    assert found["mikron-ucp710"]["structure"] == "w C' A' b X Y Z (C1) t"
    assert {c["name"] for c in figures("controller", "list")["controllers"]} >= {"linuxcnc", "generic-iso"}
    shown = figures("controller", "show", "linuxcnc")
    assert shown["values"]["format.line_length"] == 252
    assert shown["origins"]["format.line_length"].startswith("linuxcnc.toml:")
    assert figures("machine", "show", "mill-3axis")["axes"][2]["upper"] == 400
    for kind in ("machine", "controller"):
        assert "$defs" in json.loads(run(kind, "schema").stdout)


def test_trace_shows_one_point(tmp_path: Path) -> None:
    path = cl(tmp_path, "RAPID", "GOTO/0,0,5", "GOTO/12.5,0,5", "GOTO/20,0,5")
    d = figures("trace", path, "--line", "7", *MILL)
    assert d["record"] == "GOTO/12.5,0,5"
    (move,) = d["points"][0]["moves"]
    assert move["joints"] == [{"X": 12.5, "Y": 0, "Z": 5}] and not move["linked"]
    assert "X12.5" in move["blocks"][0] and move["read_back"]["tip_deviation_mm"] < 1e-9
    run("convert", path, *MILL, "-o", tmp_path / "p.ngc")
    assert "X12.5" in (tmp_path / "p.ngc").read_text().splitlines()[move["read_back"]["program_line"] - 1]
    got = run("trace", path, "--line", "3", *MILL)
    assert got.exit_code == 1 and "trace.no_point" in got.stderr and "lines 6, 7" in got.stderr


def test_json_to_a_file_leaves_the_summary(tmp_path: Path) -> None:
    got = run("convert", POCKET, *MILL, "-o", tmp_path / "p.ngc", "--json", tmp_path / "s.json")
    assert "proved: tip within" in got.stdout
    assert json.loads((tmp_path / "s.json").read_text())["points_in"] == 96


def test_json_dash_prints_json_alone_even_where_it_fails(tmp_path: Path) -> None:
    path = cl(tmp_path, "RAPID", "GOTO/0,0,5", "RAPID", "GOTO/9000,0,5")
    got = run("convert", path, *MILL, "-o", tmp_path / "p.ngc", "--json", "-")
    d = json.loads(got.stdout)
    assert got.exit_code == 1 and d["output"] is None
    assert (d["schema_version"], d["ok"]) == (1, False)
    assert {x["code"] for x in d["diagnostics"] if x["severity"] == "error"} == {"travel.exceeded"}
    assert "travel.exceeded" in got.stderr
    got = run("convert", path, "-m", "nothing", "-c", "linuxcnc", "-o", tmp_path / "p.ngc", "--json", "-")
    d = json.loads(got.stdout)
    assert got.exit_code == 1 and d["diagnostics"] and d["ok"] is False


def test_header_is_enough_to_verify_again(tmp_path: Path) -> None:
    out = tmp_path / "p.ngc"
    path = SAMPLES / "five_faces.cls"
    assert run("convert", path, "-m", "head-table", "-c", "generic-iso", "-o", out, "--setup", TOOLS, "--tolerance", "0.02",
               "--axis-tolerance", "0.1", "--units", "mm", "--feed-mode", "auto").exit_code == 0
    head = "\n".join(n for n in out.read_text().splitlines() if n.startswith("("))
    machine, controller = re.search(r"\(machine (\S+)\)", head)[1], re.search(r"\(controller (\S+)\)", head)[1]
    tolerance, axis = re.search(r"tolerance ([\d.]+) mm, axis tolerance ([\d.]+)", head).groups()
    setup = re.search(r"\(setup (\S+), fingerprint ", head)[1]
    units = re.search(r"\(CL file read with --units (\S+)\)", head)[1]
    again = run("verify", out, path, "-m", machine, "-c", controller, "--setup", Path(TOOLS).with_name(setup), "--tolerance",
                tolerance, "--axis-tolerance", axis, "--units", units)
    assert again.exit_code == 0 and again.stdout.startswith("proved")
    without = run("verify", out, path, "-m", machine, "-c", controller)
    assert without.exit_code == 1


@pytest.mark.parametrize(("machine", "controller", "nearest"), [
    ("mikron-upc710", "linuxcnc", "mikron-ucp710"), ("mill-3axis", "linuxcncc", "linuxcnc")])
def test_unknown_names_get_the_nearest(machine: str, controller: str, nearest: str, tmp_path: Path) -> None:
    got = run("convert", POCKET, "-m", machine, "-c", controller, "-o", tmp_path / "p.ngc")
    assert got.exit_code == 1 and nearest in got.stderr and "Traceback" not in got.stderr
    assert not list(tmp_path.iterdir())


def test_wrong_use_is_exit_code_two(tmp_path: Path) -> None:
    out = tmp_path / "p.ngc"
    for arguments in (["convert", POCKET, *MILL], ["convert", POCKET, *MILL, "-o", out, "--tolerance", "-1"],
                      ["convert", POCKET, *MILL, "-o", out, "--feed-mode", "fast"], ["nonsense"],
                      ["convert", POCKET, *MILL, "-o", out, "--units", "parsec"],
                      ["convert", POCKET, *MILL, "-o", tmp_path], ["trace", POCKET, *MILL, "--line", "0"]):
        got = run(*arguments)
        assert got.exit_code == 2, arguments
    assert not out.exists()


def test_output_is_never_the_input(tmp_path: Path) -> None:
    path = cl(tmp_path, "RAPID", "GOTO/0,0,5", "GOTO/1,0,5")
    before = path.read_bytes()
    link = tmp_path / "link.ngc"
    link.symlink_to(path)
    for out in (path, tmp_path / "." / "part.apt", link):
        assert run("convert", path, *MILL, "-o", out).exit_code == 2
    assert path.read_bytes() == before


def test_output_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    got = run("convert", POCKET, *MILL, "-o", tmp_path / "file" / "p.ngc")
    assert got.exit_code == 1 and "file.write" in got.stderr and "Traceback" not in got.stderr
    long = run("convert", POCKET, *MILL, "-o", tmp_path / ("x" * 300))
    assert long.exit_code == 1 and "file.write" in long.stderr
    json_too = run("inspect", POCKET, "--json", tmp_path / "file" / "s.json")
    assert json_too.exit_code == 1 and "Traceback" not in json_too.stderr


@pytest.mark.parametrize(("name", "text", "code"), [
    ("none", "", ""), ("empty", "UNITS/MM\nFINI\n", ""), ("comments", "$$ nothing\n", ""),
    ("start only", "UNITS/MM\nFROM/0,0,5\nFINI\n", "convert.no_motion"), ("binary", "\x00\x01\x02", "")])
def test_files_without_a_point(name: str, text: str, code: str, tmp_path: Path) -> None:
    path = tmp_path / "part.apt"
    path.write_text(text)
    got = run("convert", path, *MILL, "-o", tmp_path / "p.ngc")
    assert got.exit_code == 1 and (code or "error [") in got.stderr, name
    assert got.exception is None or isinstance(got.exception, SystemExit)
    assert not (tmp_path / "p.ngc").exists()


def test_missing_files(tmp_path: Path) -> None:
    none = tmp_path / "none.cls"
    for arguments in (["convert", none, *MILL, "-o", tmp_path / "p.ngc"], ["verify", none, POCKET, *MILL],
                      ["convert", POCKET, *MILL, "-o", tmp_path / "p.ngc", "--setup", none], ["inspect", none],
                      ["machine", "show", str(none)], ["machine", "check", str(tmp_path / "none.toml")]):
        got = run(*arguments)
        assert got.exit_code in (1, 2) and "none" in got.stderr, arguments
        assert got.exception is None or isinstance(got.exception, SystemExit), arguments


def test_turning_is_refused_but_inspected(tmp_path: Path) -> None:
    path = tmp_path / "turn.cls"
    path.write_text("TOOL PATH/FACE_TURN,TOOL,OD_80_L\nTLDATA/TURN,INSERT,80,0\nMSYS/0,0,0,0,0,1,1,0,0\nLOAD/TOOL,1\n"
                    "SPINDL/SMM,200,CLW\nRAPID\nGOTO/10,0,0\nFEDRAT/MMPR,0.2\nGOTO/5,0,0\nEND-OF-PATH\n")
    assert run("inspect", path).exit_code == 0
    got = run("convert", path, *MILL, "-o", tmp_path / "p.ngc")
    assert got.exit_code == 1 and got.stderr.count("error [") == 1 and "this is a turning file (FACE_TURN)" in got.stderr


def test_unknown_motion_word_stops_unless_allowed(tmp_path: Path) -> None:
    path = cl(tmp_path, "RAPID", "GOTO/0,0,5", "WIGGLE/1,2,3", "GOTO/1,0,5")
    out = tmp_path / "p.ngc"
    got = run("convert", path, *MILL, "-o", out)
    assert got.exit_code == 1 and "WIGGLE" in got.stderr and not out.exists()
    assert run("convert", path, *MILL, "-o", out, "--allow-unknown", "wiggle").exit_code == 0
    assert "allow unknown WIGGLE" in out.read_text()


def test_help_is_instant_and_lists_the_commands() -> None:
    got = subprocess.run([sys.executable, "-X", "importtime", "-m", "postproc.cli.app", "--help"], capture_output=True,
                         text=True, check=True, timeout=30)
    assert all(word in got.stdout for word in ("convert", "verify", "inspect", "trace", "machine", "controller"))
    assert not re.search(r"\| +(numpy|numba|pydantic)\s*$", got.stderr, re.MULTILINE)


NOT_NEEDED = (
    "numba", "scipy", "rich", "ruckig", "toppra", "trimesh", "toolpaths.smoothing", "toolpaths.cl.systems.nci",
    "toolpaths.cl.systems.freecad", "toolpaths.cl.systems.step_nc", "machines.geometric_error.actual",
    "machines.kinematics.legs", "postproc.feedrate", "postproc.planning.planned", "postproc.correction",
    "postproc.readback.macros.siemens",
    "postproc.readback.macros.klartext", "postproc.readback.macros.fanuc", "postproc.readback.dialects.siemens",
    "postproc.readback.dialects.klartext", "postproc.readback.dialects.haas", "postproc.writing.siemens",
    "postproc.writing.heidenhain", "postproc.cycle_time.linuxcnc", "postproc.proof.file", "postproc.pipeline.optimised",
    "postproc.joints.run_roads", "postproc.verification.tool_table", "postproc.verification.tool_table_file")
"""modules and packages that a small conversion for a serial machine and one control does without"""


def test_a_small_conversion_imports_what_it_needs(tmp_path: Path) -> None:
    got = subprocess.run([sys.executable, "-X", "importtime", "-m", "postproc", "convert", str(SAMPLES / "five_faces.cls"),
                          "-m", "mikron-ucp710", "-c", "fanuc-30i", "-o", str(tmp_path / "part.nc")],
                         capture_output=True, text=True, check=True, timeout=60)
    loaded = {line.rpartition("|")[2].strip() for line in got.stderr.splitlines()}
    assert "postproc.readback.dialects.fanuc" in loaded and [name for name in NOT_NEEDED if not find_spec(name)] == []
    assert loaded & set(NOT_NEEDED) == set()


def test_the_command_that_is_called_is_built_alone() -> None:
    root = typer.main.get_command(app)
    for name in set(root.commands) - {"batch"}:
        assert list(typer.main.get_command(only_called(app, [name, "--help"])).commands) == [name]
    for arguments in ([], ["--help"], ["--version"], ["convrt"], ["batch", "--help"]):
        assert only_called(app, arguments) is app


def test_help_lists_commands_from_convert_to_files_and_cuts_none_short() -> None:
    root = typer.main.get_command(app)
    page = run("--help").stdout
    first = re.findall(r"^  (?:│ )?([a-z]+) {2,}", page.partition("Commands:")[2], re.MULTILINE)
    assert first[:5] == ["convert", "verify", "compare", "inspect", "trace"] and set(first) == set(root.commands)
    assert "..." not in page.partition("Commands:")[2]


def commands(group: Any, words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, (*words, name))
        else:
            yield (*words, name), command


ROOT_PAGE = typer.main.get_command(app)
PAGES = dict(commands(ROOT_PAGE))


@pytest.mark.parametrize("words", PAGES, ids=" ".join)
def test_help_says_what_each_option_takes(words: tuple[str, ...]) -> None:
    """No option or argument is only a type; each has its help; the dialects are all named."""
    for one in PAGES[words].params:
        if one.name != "help":
            assert getattr(one, "help", None), one.name
        if one.param_type_name == "option" and not one.is_flag:
            assert one.metavar, one.name
    page = " ".join(run(*words, "--help").stdout.split())
    usage = page.partition("Usage: ")[2].partition(" Arguments: ")[0]
    names = [one.metavar if one.required else f"[{one.metavar}]" for one in PAGES[words].params
             if one.param_type_name == "argument"]
    assert f"{usage} ".startswith(f"postproc {' '.join([*words, '[OPTIONS]', *names])} ")
    assert not re.search(r"<=x|x>=|<str>|<path>|\.\.\.\.", page)
    if "--dialect" in page:
        assert ", ".join(DIALECTS) in page


GROUPS = {(): ROOT_PAGE} | {(name,): one for name, one in ROOT_PAGE.commands.items() if hasattr(one, "commands")}


@pytest.mark.parametrize("columns", [80, 120, 140])
@pytest.mark.parametrize("words", [*GROUPS, *PAGES], ids=lambda words: " ".join(words) or "postproc")
def test_help_fits_a_terminal(words: tuple[str, ...], columns: int) -> None:
    """No line is longer than the terminal; texts of commands are cut short in a narrow one alone."""
    command = (GROUPS | PAGES)[words]
    lines = command.get_help(typer.Context(command, info_name="postproc", terminal_width=columns)).splitlines()
    assert len(lines) > 8 and [line for line in lines if len(line) > columns] == []
    assert columns == 80 or [line for line in lines if line.endswith("...") and not line.startswith("Usage: ")] == []


def test_same_input_same_output(tmp_path: Path) -> None:
    texts = []
    for name in ("a.ngc", "b.ngc"):
        assert run("convert", POCKET, *MILL, "-o", tmp_path / name).exit_code == 0
        texts.append((tmp_path / name).read_bytes())
    assert texts[0] == texts[1] and b"\r" not in texts[0]


@pytest.mark.parametrize("command", [["convert", "-o", "a.ngc", "-c", "linuxcnc"], ["time"],
                                     ["trace", "--line", "9", "-c", "linuxcnc"]])
def test_a_range_without_an_error_model_is_wrong_use(command: list[str]) -> None:
    name, *rest = command
    run = CliRunner().invoke(app, [name, "samples/pocket.cls", "-m", "mill-3axis", *rest, "--error-model-beyond"])
    assert run.exit_code == 2 and "--error-model-beyond" in run.output


def test_an_output_that_is_full_is_reported(monkeypatch: pytest.MonkeyPatch,
                                            capsys: pytest.CaptureFixture[str]) -> None:
    def full() -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("postproc.cli.app.app", full)
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 1 and "standard output cannot be written: No space left" in capsys.readouterr().err


def test_time_of_a_file_that_is_refused_is_null(tmp_path: Path) -> None:
    got = run("time", cl(tmp_path, "RAPID", "GOTO/0,0,9000"), "-m", "mill-3axis", "--json", "-")
    noted = json.loads(got.stdout)
    assert got.exit_code == 1 and noted["cycle_time_s"] is None and noted["operations"] == [] and noted["diagnostics"]
