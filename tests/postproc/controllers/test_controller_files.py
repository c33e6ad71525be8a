"""Controller files: shop files on a base, where values come from, faults with their place, and what a dialect cannot say."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from machines.user_model import schema
from postproc.cli.app import app
from postproc.cli.catalogue import controller_values
from postproc.compile.program import Program
from postproc.controllers.model import ControllerFile, builtin_files, load_controller
from postproc.writing.unwritable import unwritable
from tests.postproc.program_kit import LOAD, command, drilled, program, step
from toolpaths.diagnostics import Diagnostic
from toolpaths.toolpath import Cycle

NEW = ("fanuc-30i", "haas-ngc", "heidenhain-tnc640", "siemens-840d")


def shop(folder: Path, *lines: str) -> Path:
    file = folder / "shop.toml"
    file.write_text("\n".join(lines))
    return file


@pytest.mark.parametrize("name", builtin_files())
def test_built_in_files_name_their_sources(name: str) -> None:
    spec, found = load_controller(name)
    assert not found and spec is not None and spec.sources and spec.description


@pytest.mark.parametrize("name", NEW)
def test_a_shop_file_changes_its_keys_and_no_others(name: str, tmp_path: Path) -> None:
    base, _ = controller_values(name)
    file = shop(tmp_path, f'base = "{name}"', "[arcs]", "largest_radius = 500.0", "[format]",
                "feed_decimals = 1")
    values, origins = controller_values(str(file))
    assert {k for k in base if base[k] != values[k]} == {"arcs.largest_radius", "format.feed_decimals"}
    assert origins["arcs.largest_radius"] == "shop.toml:3" and origins["format.feed_decimals"] == "shop.toml:5"
    assert origins["writer"] == f"{name}.toml:2" and origins["cycles.enabled"] == "default"


def test_show_prints_every_value_with_its_place(tmp_path: Path) -> None:
    file = shop(tmp_path, 'base = "haas-ngc"', "[codes]", 'mist = "M73"')
    text = CliRunner().invoke(app, ["controller", "show", str(file)]).output.splitlines()
    assert len(text) == len(controller_values(str(file))[0])
    assert [line.split() for line in text if "codes.mist" in line] == [["shop.toml:3", "codes.mist", "=", '"M73"']]
    assert any(line.startswith("haas-ngc.toml:") and 'work_offsets.G110 = "G154 P1"' in line for line in text)
    assert any(line.startswith("default") and 'codes.flood = "M8"' in line for line in text)


def faults(*lines: str, folder: Path) -> list[Diagnostic]:
    spec, found = load_controller(shop(folder, 'base = "fanuc-30i"', *lines))
    assert spec is None
    return found


def test_faults_name_the_line_and_what_is_allowed(tmp_path: Path) -> None:
    for lines, said in ((['[modes.tcp]', 'enter = ["G43.4 H{tool}"]'], "{register}"),
                        (['[modes.tilted]', 'angles = "ZYZ"'], "'ZXZ', 'ZYX', 'XYZ' or 'rotary'"),
                        (['[program]', 'begin = ["O{nummer}"]'], "{name}, {number}"),
                        (['[codes]', 'dwell = "G4 X{sec}"'], "{seconds}, {milliseconds}"),
                        (['[cycles.table]', 'DRILL = { code = "G81 Z{botom}" }'], "{bottom}"),
                        (['[tools]', 'prelaod = true'], "preload")):
        found = faults(*lines, folder=tmp_path)
        assert len(found) == 1 and list(found[0].lines) == [3] and said in str(found[0]), (lines, [str(d) for d in found])


def test_work_offsets_are_given_for_every_code_of_a_setup(tmp_path: Path) -> None:
    file = shop(tmp_path, 'base = "linuxcnc"', "[program.work_offsets]", 'G54 = "G54"')
    spec, found = load_controller(file)
    assert spec is None and "missing: G55, G56" in str(found[0])


def test_the_schema_explains_every_key() -> None:
    text = schema("controller", ControllerFile)
    tables = {"format", "comment", "program", "codes", "tools", "subprograms", "arcs", "cycles", "feed", "kinematics",
              "modes", "cutter_compensation", "start", "stops", "rollover", "links", "pivots", "alignment"}
    silent = {f"{name}.{key}" for name, model in {**text["$defs"], "": text}.items()
              for key, value in model.get("properties", {}).items() if not value.get("description")}
    assert silent == {f".{key}" for key in tables}
    assert all(text["$defs"][name].get("description") for name in text["$defs"])


def said(controller: str, made: Program, cycles: tuple[Cycle, ...] = ()) -> set[str]:
    spec, _ = load_controller(controller)
    assert spec is not None
    return {f"{d.severity.name} {d.code}" for d in unwritable(spec, made, cycles, "a.cls")}


@pytest.mark.parametrize("name", ["siemens-840d", "heidenhain-tnc640"])
def test_a_radius_register_that_is_not_written_is_said(name: str) -> None:
    made = program([step("feed", X=1.0, F=1.0)], {0: [command("CUTTER_COMPENSATION_LEFT", 7.0)]})
    plain = program([step("feed", X=1.0, F=1.0)], {0: [command("CUTTER_COMPENSATION_LEFT")]})
    assert said(name, made) == {"WARNING cutcom.own_register"} and said(name, plain) == set()
    assert said("fanuc-30i", made) == set()


def test_lengths_that_would_count_twice_are_said() -> None:
    made = program([step("rapid", X=1.0)], {0: LOAD})
    for name, expected in (("heidenhain-tnc640", {"tool.length_twice"}), ("siemens-840d", set()),
                           ("fanuc-30i", set())):
        spec, _ = load_controller(name)
        assert spec is not None
        assert {d.code for d in unwritable(spec, made, (), "a.cls", length_offsets=False)} == expected
        assert {d.code for d in unwritable(spec, made, (), "a.cls")} == set()


def test_a_tap_needs_its_pitch_or_a_speed() -> None:
    steps, hole = drilled("TAP")
    tap, pitched = Cycle("TAP", 8.0, 2.0, 2.0, 200.0), Cycle("TAP", 8.0, 2.0, 2.0, 200.0, pitch=1.0)
    assert said("siemens-840d", program(steps, holes=(hole,)), (tap,)) == {"ERROR cycle.pitch"}
    assert said("siemens-840d", program(steps, holes=(hole,)), (pitched,)) == set()
    assert said("siemens-840d", program(steps, {0: LOAD}, holes=(hole,)), (tap,)) == set()
    assert said("fanuc-30i", program(steps, holes=(hole,)), (tap,)) == set()
