"""Spindle and coolant that the CL file does not state: those of the set-up, known to every command; else refused."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

import postproc
from postproc.cli.app import app
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile, load_setup
from tests.postproc.kit import convert, good, machine, toolpath
from toolpaths.diagnostics import Diagnostic, Severity

CONTROLLERS = ("linuxcnc", "generic-iso", "fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc")
CUT = ["RAPID", "GOTO/0,0,30", "GOTO/0,0,0", "GOTO/10,0,0", "RAPID", "GOTO/10,0,30"]
HEAD = ["UNITS/MM", "FEDRAT/MMPM,600", "LOADTL/1", *CUT]
TWO = [*HEAD, "LOADTL/2", *CUT]
LENGTHS = {"1": {"gauge_length": 100.0}, "2": {"gauge_length": 80.0}}


def setup(output: dict[str, object] | None = None, **tools: dict[str, object]) -> SetupFile:
    merged = {n: {**values, **tools.get(f"t{n}", {})} for n, values in LENGTHS.items()}
    return SetupFile.model_validate({"output": output or {}, "tools": merged})


def made(lines: list[str], of: SetupFile | None = None, controller: str = "linuxcnc", name: str = "mill-3axis",
         **options: object) -> PostResult:
    return convert(toolpath(head=lines), name, controller, of or setup(), **options)


def errors(result: PostResult) -> list[Diagnostic]:
    return [d for d in result.diagnostics if d.severity is Severity.ERROR]


def switched(text: str) -> list[str]:
    """What switches spindle and coolant, calls a tool or stops, in order."""
    blocks = [re.sub(r"\(.*?\)|;.*", "", line) for line in text.splitlines()]
    return re.findall(r"(?:S\d+ )?M[34]\b|\bM[589]\b|\bM7\b|\bM0\b|T\d M6", "\n".join(blocks))


@pytest.mark.parametrize(("controller", "name"),
                         list(zip(CONTROLLERS, ("mill-3axis", "fork-head-ab") * 3, strict=True)))
def test_each_tool_has_its_own_and_the_rest_that_of_output(name: str, controller: str,
                                                           tmp_path: Path) -> None:
    of = setup({"spindle": {"rpm": 4000}, "coolant": "flood"},
               t2={"spindle": {"rpm": 900, "direction": "CCLW"}, "coolant": "off"})
    result = good(made(TWO, of, controller, name))
    said = "\n".join(re.sub(r"\(.*?\)|;.*", "", line) for line in result.text.splitlines())
    first, second = re.split(r"(?:T2 M6|T2\n(?:N\d+ )?M6|TOOL CALL 2)", said)
    assert "S4000" in first and {"M3", "M8"} <= set(first.split()) and "M4" not in first.split()
    assert "S900" in second and re.search(r"\bM4\b", second) and not re.search(r"\bM[38]\b", second)
    (tmp_path / "p.nc").write_text(result.text)
    path = toolpath(head=TWO)
    assert postproc.verify(tmp_path / "p.nc", path, machine(name), controller, setup=of).ok
    other = postproc.verify(tmp_path / "p.nc", path, machine(name), controller,
                            setup=setup({"spindle": {"rpm": 4100}, "coolant": "flood"}, t2=of.tools["2"].model_dump(
                                include={"spindle", "coolant"})))
    assert [d.code for d in other.diagnostics if d.severity is Severity.ERROR] == ["verify.setup", "verify.state"]


@pytest.mark.covering(count=3)
@pytest.mark.parametrize(("controller", "name"),
                         list(zip(CONTROLLERS, ("head-table", "mikron-ucp710") * 3, strict=True)))
def test_without_either_it_is_refused_and_the_hint_helps(name: str, controller: str, tmp_path: Path) -> None:
    found = errors(made(TWO, controller=controller, name=name))
    assert [d.code for d in found] == ["spindle.not_started"] and found[0].lines == (6, 7, 13, 14)
    tables, keys = zip(*re.findall(r"(\[[a-z.0-9]+\]) (spindle = .*?\})", found[0].hint), strict=True)
    assert tables == ("[tools.1]", "[tools.2]", "[output]") and len(set(keys)) == 1
    key = keys[0].replace("...", "5000")
    for text in (f"[output]\n{key}\n", f"[tools.1]\n{key}\n[tools.2]\n{key}\n"):
        assert tomllib.loads(text)
        (tmp_path / "s.toml").write_text(text + ("[tools.1]\ngauge_length = 100\n[tools.2]\ngauge_length = 80\n"
                                                 if "output" in text else ""))
        of, _ = load_setup(tmp_path / "s.toml")
        assert of is not None
        lengths = {n: t.model_copy(update={"gauge_length": LENGTHS[n]["gauge_length"]}) for n, t in of.tools.items()}
        assert good(made(TWO, of.model_copy(update={"tools": lengths}), controller, name))


def test_the_files_own_records_count() -> None:
    of = setup({"spindle": {"rpm": 4000}, "coolant": "flood"}, t1={"spindle": {"rpm": 900}})
    own = ["UNITS/MM", "FEDRAT/MMPM,600", "LOADTL/1", "SPINDL/RPM,1500,CCLW", "COOLNT/MIST", *CUT]
    assert switched(good(made(own, of)).text) == ["T1 M6", "S1500 M4", "M7", "M5", "M9"]
    before = ["UNITS/MM", "FEDRAT/MMPM,600", "SPINDL/RPM,1500,CCLW", "LOADTL/1", *CUT]
    assert switched(good(made(before, of)).text) == ["T1 M6", "S1500 M4", "M8", "M5", "M9"]


def test_what_the_tool_before_has_left_in_force_counts_before_output() -> None:
    lines = ["UNITS/MM", "FEDRAT/MMPM,600", "LOADTL/1", "SPINDL/RPM,1500,CLW", *CUT, "LOADTL/2", *CUT]
    assert "S1500 M3" in switched(good(made(lines, setup({"spindle": {"rpm": 4000}}))).text)[4:]
    assert "S900 M3" in switched(good(made(lines, setup(t2={"spindle": {"rpm": 900}}))).text)[3:]


def test_what_the_set_up_states_for_one_tool_is_not_in_force_for_the_next() -> None:
    """T2 has none of its own: `[output]` counts, else what the file's own records have left, else it is refused."""
    own: dict[str, object] = {"spindle": {"rpm": 900}, "coolant": "flood"}
    text = good(made(TWO, setup({"spindle": {"rpm": 4000}, "coolant": "mist"}, t1=own))).text
    assert switched(text) == ["T1 M6", "S900 M3", "M8", "M5", "M9", "T2 M6", "S4000 M3", "M7", "M5", "M9"]
    refusal, = errors(made(TWO, setup(t1=own)))
    assert refusal.code == "spindle.stopped" and refusal.lines == (13, 14) and "line" not in refusal.message
    assert "[tools.2] spindle" in refusal.hint and "[tools.1]" not in refusal.hint
    assert "M8" not in switched(good(made(TWO, setup(t1=own, t2={"spindle": {"rpm": 800}}))).text)[5:]
    filed = [*HEAD[:2], "SPINDL/RPM,1500,CCLW", "COOLNT/MIST", "LOADTL/3", *CUT, *TWO[2:]]
    of = setup({"spindle": {"rpm": 4000}}, t1={"spindle": {"rpm": 900}})
    assert switched(good(made(filed, of)).text)[-5:] == ["T2 M6", "M7", "S1500 M4", "M5", "M9"]
    later = [*TWO[:9], "SPINDL/RPM,1500,CLW", *TWO[9:]]
    assert "S1500 M3" in switched(good(made(later, setup(t1=own))).text)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_cut_behind_spindl_off_is_refused(controller: str) -> None:
    lines = ["UNITS/MM", "FEDRAT/MMPM,600", "LOADTL/1", "SPINDL/RPM,1500,CLW", *CUT, "SPINDL/OFF", *CUT]
    of = setup({"spindle": {"rpm": 4000}}, t1={"spindle": {"rpm": 900}})
    found = errors(made(lines, of, controller))
    assert [(d.code, d.lines) for d in found] == [("spindle.stopped", (14, 15))] and "line 11" in found[0].message
    assert good(made([*lines[:11], "SPINDL/RPM,1500,CLW", *lines[11:]], of, controller))


def test_a_new_tool_behind_spindl_off_takes_the_set_up() -> None:
    lines = ["UNITS/MM", "FEDRAT/MMPM,600", "LOADTL/1", "SPINDL/RPM,1500,CLW", *CUT, "SPINDL/OFF", "LOADTL/2", *CUT]
    assert [d.code for d in errors(made(lines))] == ["spindle.stopped"] and "[output]" in errors(made(lines))[0].hint
    assert "S4000 M3" in switched(good(made(lines, setup({"spindle": {"rpm": 4000}}))).text)


def test_a_direction_without_a_speed_takes_the_speed_of_the_set_up() -> None:
    lines = ["UNITS/MM", "FEDRAT/MMPM,600", "LOADTL/1", "SPINDL/CCLW", *CUT]
    assert [d.code for d in errors(made(lines))] == ["spindle.no_speed"]
    assert "S4000 M4" in switched(good(made(lines, setup({"spindle": {"rpm": 4000}}))).text)


@pytest.mark.parametrize("tables", ["[output]", "[tools.1]"])
def test_a_speed_of_0_is_none_and_the_set_up_counts(tables: str) -> None:
    """As CAM writes it where nobody has entered a speed; the direction is the record's, and the tool before counts not."""
    lines = ["UNITS/MM", "FEDRAT/MMPM,600", "LOADTL/1", "SPINDL/RPM,0,CCLW", *CUT]
    found = errors(made(lines))
    assert {d.code for d in found} <= {"spindle.speed", "spindle.no_speed"} and all(tables[:7] in d.hint for d in found)
    turns = {"spindle": {"rpm": 4000}}
    of = setup(turns) if tables == "[output]" else setup(t1=turns)
    result = good(made(lines, of))
    assert "S4000 M4" in switched(result.text) and "spindle.of_setup" in {d.code for d in result.diagnostics}
    after = ["UNITS/MM", "FEDRAT/MMPM,600", "LOADTL/2", "SPINDL/RPM,1500,CLW", *CUT, *lines[2:]]
    assert "S4000 M4" in switched(good(made(after, of)).text) and "spindle.speed" in {d.code for d in errors(made(after))}
    assert errors(made([n.replace(",0,", ",-5,") for n in lines], of))[0].code == "spindle.speed"


@pytest.mark.parametrize(("record", "side"), [("SPINDL/SFM,300,CLW", "M3"), ("SPINDL/120.0,SMM,CCLW", "M4"),
                                              ("SPINDL/SMM,120,CLW,MAXRPM,6000", "M3")])
def test_of_a_cutting_speed_the_set_up_states_the_turns(record: str, side: str, tmp_path: Path) -> None:
    lines = ["UNITS/MM", "FEDRAT/MMPM,600", "LOADTL/1", "CUTTER/12,0", record, *CUT, "GOTO/0,10,30"]
    refusal, = errors(made(lines))
    assert refusal.code == "spindle.surface_speed" and "[tools.N]" in refusal.hint
    of = setup(t1={"spindle": {"rpm": 2400}})
    result = good(made(lines, of))
    assert f"S2400 {side}" in switched(result.text)
    (tmp_path / "p.nc").write_text(result.text.replace(f"S2400 {side}", f"S2500 {side}"))
    changed = postproc.verify(tmp_path / "p.nc", toolpath(head=lines), machine("mill-3axis"), "linuxcnc", setup=of)
    assert "verify.state" in {d.code for d in changed.diagnostics}


def test_maxrpm_of_a_cutting_speed_limits_the_speed_of_the_set_up() -> None:
    lines = ["UNITS/MM", "FEDRAT/MMPM,600", "LOADTL/1", "CUTTER/1,0", "SPINDL/SMM,200,MAXRPM,3000,CLW,RANGE,LOW", *CUT,
             "GOTO/0,10,30"]
    assert "spindle.limit" in {d.code for d in errors(made(lines, setup(t1={"spindle": {"rpm": 4000}})))}
    fits = good(made(lines, setup(t1={"spindle": {"rpm": 3000}})))
    assert "S3000 M3" in switched(fits.text) and "spindle.range" in {d.code for d in fits.diagnostics}
    wrong = [line.replace("200", "-200") for line in lines]
    assert "spindle.surface_speed" in {d.code for d in errors(made(wrong, setup(t1={"spindle": {"rpm": 3000}})))}


def test_feeds_per_revolution_dwells_and_taps_count_with_it() -> None:
    of = setup({"spindle": {"rpm": 600}})
    assert "F60" in good(made([n.replace("MMPM,600", "MMPR,0.1") for n in HEAD], of)).text
    drill = [*HEAD, "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3,DWELL,15,REV", "GOTO/10,0,0", "CYCLE/OFF"]
    assert "P1.5" in good(made(drill, of)).text
    tap = [*HEAD, "CYCLE/TAP,DEPTH,5,MMPM,600,CLEAR,3", "GOTO/10,0,0", "CYCLE/OFF"]
    assert "G84" in good(made(tap, of)).text
    assert "G74" in good(made(tap, setup({"spindle": {"rpm": 600, "direction": "anti-clockwise"}}))).text
    assert "G4 P1" in good(made([*HEAD, "DELAY/10,REV", "GOTO/0,0,40"], of)).text


@pytest.mark.parametrize("kind", ["mist", "through", "air"])
def test_coolant_of_other_kinds(kind: str) -> None:
    of = setup({"spindle": {"rpm": 600}, "coolant": kind})
    text = good(made(HEAD, of, "haas-ngc")).text
    assert {"mist": "M8", "through": "M88", "air": "M83"}[kind] in text.splitlines()


def test_a_passage_that_is_taken_up_again_and_a_stop_restate_it() -> None:
    lines = [*HEAD, "STOP", "GOTO/5,0,0", *CUT]
    said = switched(good(made(lines, setup({"spindle": {"rpm": 600}, "coolant": "flood", "restart": True}))).text)
    assert said[:3] == ["T1 M6", "S600 M3", "M8"] and said[said.index("M0") + 1:][:2] == ["S600 M3", "M8"]


@pytest.mark.parametrize("direction", ["clockwise", "CLW", "cw", "M3", "anti-clockwise", "CCLW", "CCW", "counter-clockwise",
                                       "M4"])
def test_directions_by_every_name(direction: str) -> None:
    turns = setup({"spindle": {"rpm": 1, "direction": direction}}).output.spindle
    want = "clockwise" if direction in ("clockwise", "CLW", "cw", "M3") else "anti-clockwise"
    assert turns is not None and turns.direction == want


@pytest.mark.parametrize(("text", "says"), [
    ("[output]\nspindle = { rpm = 0 }\n", "more than 0"),
    ("[output]\nspindle = { rpm = 9, direction = \"left\" }\n", "clockwise"),
    ("[tools.1]\ncoolant = \"water\"\n", "flood"), ("[output]\nspindle = { speed = 9 }\n", "speed")])
def test_set_ups_that_say_nothing_sensible(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(text)
    got = CliRunner().invoke(app, ["setup", "check", str(tmp_path / "s.toml")])
    assert got.exit_code == 1 and says in got.output + got.stderr and "s.toml:2" in got.output + got.stderr


def test_the_set_up_of_the_readme_is_a_good_file(tmp_path: Path) -> None:
    readme = (Path(__file__).parents[3] / "README.md").read_text()
    (tmp_path / "s.toml").write_text(readme.split("## The set-up file")[1].split("```")[1].removeprefix("toml\n"))
    of, found = load_setup(tmp_path / "s.toml")
    assert not found and of is not None and of.output.spindle is not None and of.tools["1"].coolant == "flood"


def test_every_command_knows_it(tmp_path: Path) -> None:
    (tmp_path / "part.apt").write_text("\n".join([*HEAD, "FINI"]))
    (tmp_path / "s.toml").write_text("[output]\nspindle = { rpm = 4000 }\n[tools.1]\ngauge_length = 100\n"
                                     'coolant = "flood"\n')

    def run(*words: str) -> str:
        got = CliRunner().invoke(app, [words[0], str(tmp_path / "part.apt"), "-m", "mill-3axis", "-c", "linuxcnc", "--setup",
                                       str(tmp_path / "s.toml"), *words[1:]])
        assert got.exit_code == 0, got.output
        return got.stdout

    out = str(tmp_path / "part.ngc")
    shown = json.loads(run("convert", "-o", out, "--json", "-"))["tools"]
    assert shown == [{"number": 1, "name": "", "gauge_length_mm": 100.0, "spindle_rpm": [4000.0],
                     "of_setup": ["4000 rev/min clockwise", "coolant flood"], "length_margin_mm": {
                         "shorter": None, "ends_shorter": "", "longer": None, "ends_longer": ""}}]
    assert "T1: 4000 rev/min clockwise, of the set-up" in run("convert", "-o", out)
    assert "(T1: 4000 rev/min clockwise, of the set-up)" in Path(out).read_text()
    point = json.loads(run("trace", "--line", "7", "--json", "-"))["points"][0]
    assert (point["tool"], point["spindle_rpm"], point["coolant"]) == (1, 4000.0, "flood")
    assert "spindle 4000 rev/min clockwise  coolant flood" in run("trace", "--line", "7")
    assert json.loads(run("time", "--json", "-"))["cycle_time_s"] > 0.0
