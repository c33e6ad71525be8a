"""A part that is not where it was meant: its place from readings, what that does to output modes, and a program for it."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import toolpaths
from postproc.alignment.align import AlignedPart, ProbeReading, align
from postproc.base.options import Options
from postproc.cli.app import app
from postproc.job.job import prepare
from postproc.setup.model import load_setup
from postproc.verification.read_back import read_back
from tests.postproc.kit import SAMPLES, convert, good, machine, setup_of
from toolpaths.diagnostics import DiagnosticError

GOLDEN = Path(__file__).parents[2] / "golden"
TURN, SHIFT = np.array([0.2, -0.15, 0.3]), np.array([0.12, -0.2, 0.05])
"""degrees about x, y, z (rotation vector) and mm by which parts of these tests are off, about the table's origin"""
TOUCHED = [((-40, -30, 0), (0, 0, 1)), ((40, -30, 0), (0, 0, 1)), ((0, 35, 0), (0, 0, 1)), ((30, 30, 0), (0, 0, 1)),
           ((-50, -20, -5), (-1, 0, 0)), ((-50, 30, -5), (-1, 0, 0)), ((-30, -40, -5), (0, -1, 0)),
           ((40, -40, -5), (0, -1, 0))]
"""points and directions: a plane, an edge, another edge"""
HEAD = "x [mm],y [mm],z [mm],nx,ny,nz,X [mm],Y [mm],Z [mm]"
ORIGIN = "[part]\norigin = [15, -8, 30]\n"


def hits(turn: Any = TURN, shift: Any = SHIFT, noise: float = 0.0, seed: int = 0, touched: Any = None) -> np.ndarray:
    """Where a probe that comes along the nominal normal meets the surfaces of the moved part, (N, 3)."""
    rng, rotation = np.random.default_rng(seed), Rotation.from_rotvec(np.radians(turn)).as_matrix()
    result = []
    for point, normal in TOUCHED if touched is None else touched:
        x, n = np.array(point, float), np.array(normal, float)
        on, out = rotation @ x + shift, rotation @ n
        result.append(x + ((on - x) @ out) / (n @ out) * n + n * rng.normal(0.0, 1.0) * noise)
    return np.array(result)


def table(measured: np.ndarray, touched: Any = None, head: str = HEAD) -> str:
    rows = [[*point, *normal, *(float(v) for v in hit)]
            for (point, normal), hit in zip(TOUCHED if touched is None else touched, measured, strict=True)]
    return "\n".join([head, *(",".join(f"{v:.6f}" for v in row) for row in rows), ""])


def aligned_part(folder: Path, text: str, name: str = "mikron-ucp710", controller: str = "fanuc-30i",
                 file: Path = GOLDEN / "short_five_axis.apt", setup: str = ORIGIN, probe: ProbeReading | None = None,
                 large: bool = False) -> AlignedPart:
    (folder / "r.csv").write_text(text)
    (folder / "s.toml").write_text((SAMPLES / "tools.setup.toml").read_text() + setup)
    path, found = toolpaths.read(file)
    return align(path, machine(name), controller, Options(setup=str(folder / "s.toml")), folder / "r.csv",
                 probe or ProbeReading(), large, found)


def errors(made: AlignedPart) -> list[str]:
    return [d.code for d in made.diagnostics if d.severity == 2]


def test_the_place_is_found_with_its_uncertainty(tmp_path: Path) -> None:
    """Readings with noise of 4 um: shift and turns are as far from the truth as their standard deviations say."""
    middle = np.mean([point for point, _ in TOUCHED], axis=0)
    expected = Rotation.from_rotvec(np.radians(TURN)).apply(middle) + SHIFT - middle
    weighted = []
    for seed in range(6):
        made = aligned_part(tmp_path, table(hits(noise=0.004, seed=seed)), probe=ProbeReading(sigma=0.004), setup="",
                            file=SAMPLES / "pocket.cls", name="mill-3axis", controller="siemens-840d")
        assert made.found is not None
        values, sigma = made.found.values, made.found.sigma
        weighted.append((values - np.concatenate([expected, np.radians(TURN)])) / sigma)
    assert np.abs(weighted).max() < 4.5 and 0.5 < np.sqrt(np.mean(np.square(weighted))) < 1.6


@pytest.mark.parametrize(("name", "controller"), [("mikron-ucp710", "siemens-840d"), ("head-table", "heidenhain-tnc640"),
                                                  ("trunnion-bc", "linuxcnc")])
def test_the_program_for_the_measured_place_is_proved_and_the_nominal_one_is_off_as_stated(
        name: str, controller: str, tmp_path: Path) -> None:
    made = aligned_part(tmp_path, table(hits()), name, controller)
    assert not errors(made) and made.part is not None and made.nominal is not None
    assert {one.mode for one in made.modes} >= {"axes"} and all(
        one.converted or one.mode == "tilted" for one in made.modes), made.modes
    path, _ = toolpaths.read(GOLDEN / "short_five_axis.apt")
    setup = setup_of((tmp_path / "s.toml").read_text())
    moved = setup.model_copy(update={"part": made.part})
    nominal = good(convert(path, name, controller, setup=setup))
    wide = replace(nominal.options, tolerance=5.0, axis_tolerance=5.0)
    job, found = prepare(nominal.toolpath, nominal.machine, nominal.controller, moved, wide)
    assert job is not None, found
    turned = replace(job, control=nominal.job.control) if nominal.job is not None else job
    comparison, _ = read_back(nominal.text, replace(turned, modes=nominal.job.modes), "part.cls")
    assert comparison is not None
    assert 0.7 * made.nominal.tip < comparison.worst_tip <= made.nominal.tip + 0.01
    assert comparison.worst_axis <= np.radians(made.nominal.axis) + 1e-3
    assert made.nominal.axis == pytest.approx(np.hypot(*TURN[:2]), abs=0.05)
    proved = good(convert(path, name, controller, setup=moved))
    assert proved.comparison is not None and proved.comparison.tip_bound <= 0.01


def test_dog_leg_rapids_of_the_measured_place_in_machine_coordinates(tmp_path: Path) -> None:
    made = aligned_part(tmp_path, table(hits()), "trunnion-bc", "haas-ngc")
    assert [one.refused for one in made.modes if one.mode == "axes"] == [""]


def entered(lines: tuple[str, ...]) -> dict[str, float]:
    """Numbers by the word before them."""
    return {word.lower(): float(value) for line in lines for word, value in re.findall(
        r"\b(SP[ABC]|d[xyzabc]|[XYZR]),? ?(-?\d+\.\d+)", line)}


def test_what_is_entered_turns_the_frame_to_the_part(tmp_path: Path) -> None:
    """Angles about fixed X, Y, Z and the origin of the work offset put points of the part where they stand."""
    for controller, letters in (("fanuc-30i", ("da", "db", "dc")), ("heidenhain-tnc640", ("spa", "spb", "spc"))):
        made = aligned_part(tmp_path, table(hits()), controller=controller)
        said = entered(made.entry)
        rotation = Rotation.from_euler("xyz", [said[k] for k in letters], degrees=True)
        assert made.found is not None
        points = np.array([[0.0, 0.0, 0.0], [40.0, -30.0, 5.0]])
        origin = np.array([15.0, -8.0, 30.0])
        there = made.found.move.points(points + origin)
        by_control = rotation.apply(points) + origin + (
            [said["dx"], said["dy"], said["dz"]] if controller == "fanuc-30i" else np.zeros(3))
        shift = there[0] - by_control[0] if controller != "fanuc-30i" else 0.0
        np.testing.assert_allclose(by_control + shift, there, atol=2e-4)


def test_a_control_that_turns_about_z_alone_gets_no_tilt(tmp_path: Path) -> None:
    """LinuxCNC: G10 L2 R for a part that lies flat; none for one that leans, nor with rotary axes."""
    flat = aligned_part(tmp_path, table(hits(turn=(0, 0, 0.3))), "mill-3axis", "linuxcnc", SAMPLES / "pocket.cls")
    assert not errors(flat) and len(flat.entry) == 1 and entered(flat.entry)["r"] == pytest.approx(0.3, abs=1e-4)
    assert aligned_part(tmp_path, table(hits(turn=(0, 0, 0.3))), controller="linuxcnc").entry == ()
    leaning = aligned_part(tmp_path, table(hits()), "mill-3axis", "linuxcnc", SAMPLES / "pocket.cls")
    assert leaning.part is None and leaning.entry == ()
    assert "reach.axis" in errors(leaning) and "align.tilt" in {d.code for d in leaning.diagnostics}


def test_readings_with_the_table_turned(tmp_path: Path) -> None:
    """Side faces touched at C 90: words of the work offset and machine coordinates give the same place."""
    m, measured = machine("mikron-ucp710"), hits()
    length = 80.0
    kin = m.kinematics.with_tool(length)
    c = np.radians([0.0, 90.0] * 4)
    q = np.zeros((8, 5))
    q[:, m.axis_names.index("C")] = c
    placed = measured + np.array([15.0, -8.0, 30.0])
    slides = kin.at_tip(placed, q, np.array([m.axis_names.index(k) for k in "XYZ"]))
    zero = m.kinematics.at_tip(np.array([[15.0, -8.0, 30.0]]), np.zeros((1, 5)), np.arange(3))[0]
    shown = slides[:, :3] - zero[:3] - [0.0, 0.0, length]
    for machine_coordinates, columns in ((False, shown), (True, slides[:, :3])):
        rows = [f"{','.join(map(str, (*p, *n)))},{x:.6f},{y:.6f},{z:.6f},{np.degrees(turn):.6f}"
                for (p, n), (x, y, z), turn in zip(TOUCHED, columns, c, strict=True)]
        made = aligned_part(tmp_path, "\n".join([f"{HEAD},C [deg]", *rows, ""]),
                            probe=ProbeReading(length, machine_coordinates))
        assert made.found is not None and made.found.worst[0] < 1e-4, errors(made)
        np.testing.assert_allclose(made.found.values[3:], np.radians(TURN), atol=1e-6)


def test_a_basic_rotation_leaves_the_rest_as_it_was_meant(tmp_path: Path) -> None:
    """Two points of an edge: turn about Z and the place across it; the rest is named and stays."""
    edge = TOUCHED[6:]
    made = aligned_part(tmp_path, table(hits(turn=(0, 0, 0.3), shift=(0, -0.2, 0), touched=edge), edge))
    assert made.found is not None and not errors(made)
    assert set(made.found.undetermined) == {"x", "z", "a", "b"}
    assert made.found.values[5] == pytest.approx(np.radians(0.3), rel=1e-5)
    assert {"align.open", "align.no_spare"} <= {d.code for d in made.diagnostics}


def changed(measured: np.ndarray, what: str) -> np.ndarray:
    """Readings with a usual mistake in them."""
    other = measured.copy()
    if what == "units":
        return other / 25.4
    if what == "sign":
        other[:, 1] *= -1.0
    elif what == "columns":
        other = other[:, [1, 0, 2]]
    elif what == "swapped":
        other[[1, 4]] = other[[4, 1]]
    elif what == "off the plane":
        other[2, 2] += 0.4
    return other


@pytest.mark.parametrize(("what", "said"), [
    ("units", "another unit"), ("sign", "the sign of Y changed"), ("columns", "the columns X and Y changed over"),
    ("swapped", "the readings of lines 3 and 6 changed over"), ("off the plane", "that of line 4 left out")])
def test_usual_mistakes_are_named(what: str, said: str, tmp_path: Path) -> None:
    made = aligned_part(tmp_path, table(changed(hits(noise=0.003), what)))
    (fault,) = [d for d in made.diagnostics if d.severity == 2]
    assert fault.code in ("align.misfit", "align.large") and said in fault.hint and made.part is None, str(fault)


def test_distances_that_are_not_those_of_the_drawing(tmp_path: Path) -> None:
    """Whole points: centres of three balls, one of them 0.4 mm too far."""
    balls = [((0, 0, 0), (0, 0, 0)), ((80, 0, 0), (0, 0, 0)), ((0, 60, 0), (0, 0, 0))]
    places = Rotation.from_rotvec(np.radians(TURN)).apply([p for p, _ in balls]) + SHIFT
    good_one = aligned_part(tmp_path, table(places, balls))
    assert good_one.found is not None and not good_one.found.undetermined and good_one.part is not None
    np.testing.assert_allclose(good_one.found.values[3:], np.radians(TURN), atol=1e-6)
    places[1, 0] += 0.4
    (fault,) = [d for d in aligned_part(tmp_path, table(places, balls)).diagnostics if d.severity == 2]
    assert fault.code == "align.misfit" and "mm apart, nominal 80.0000 mm" in fault.message


def test_a_part_far_off_is_taken_only_on_request(tmp_path: Path) -> None:
    text = table(hits(turn=(0, 0, 4.0)))
    assert errors(aligned_part(tmp_path, text)) == ["align.large"]
    assert not errors(aligned_part(tmp_path, text, large=True))


REFUSED = {HEAD.replace("Z [mm]", "W [mm]"): "align.column", HEAD.replace("X [mm]", "X [deg]"): "align.unit",
           HEAD.replace("X [mm]", "X"): "align.unit", HEAD.replace("x [mm],", ""): "error-table.row"}


@pytest.mark.parametrize("head", REFUSED)
def test_tables_that_are_refused(head: str, tmp_path: Path) -> None:
    made = aligned_part(tmp_path, table(hits(), head=head))
    assert errors(made) == [REFUSED[head]] and all(d.hint or d.code.startswith("error-table") for d in made.diagnostics
                                                   if d.severity == 2)


def test_copies_and_blank_cells_are_refused(tmp_path: Path) -> None:
    text = table(hits())
    assert errors(aligned_part(tmp_path, text + text.splitlines()[1] + "\n")) == ["align.twice"]
    cells = text.splitlines()
    cells[2] = ",".join([*cells[2].split(",")[:8], ""])
    made = aligned_part(tmp_path, "\n".join(cells))
    assert errors(made) == ["align.cell"] and list(made.diagnostics[-1].lines) == [3]
    with pytest.raises(DiagnosticError):
        aligned_part(tmp_path, text, controller="none")


def test_the_command_writes_a_set_up_that_converts(tmp_path: Path) -> None:
    """Comments and tools stay; nothing is written where the readings do not fit."""
    (tmp_path / "s.toml").write_text("# shop\n" + (SAMPLES / "tools.setup.toml").read_text() + ORIGIN)
    (tmp_path / "r.csv").write_text(table(hits(noise=0.002)))
    file, out = str(GOLDEN / "short_five_axis.apt"), tmp_path / "new.toml"
    words = ["setup", "align", str(tmp_path / "r.csv"), file, "-m", "mikron-ucp710", "-c", "fanuc-30i", "--setup",
             str(tmp_path / "s.toml"), "-o", str(out)]
    done = CliRunner().invoke(app, [*words, "--json", "-"])
    assert done.exit_code == 0, done.output
    values = json.loads(done.stdout)
    assert values["output"] == str(out) and values["turns_deg"][2] == pytest.approx(0.3, abs=0.01)
    assert [one["corrected_by_control"] for one in values["modes"]] == [False, True, True] and values["entry"]
    setup, found = load_setup(out)
    assert setup is not None and not found and out.read_text().startswith("# shop") and setup.tools["1"].length == 120.0
    given = ["-m", "mikron-ucp710", "-c", "fanuc-30i", "--setup", str(out)]
    assert CliRunner().invoke(app, ["convert", file, *given, "-o", str(tmp_path / "p.nc")]).exit_code == 0
    verify = ["verify", str(tmp_path / "p.nc"), file, "-m", "mikron-ucp710", "-c", "fanuc-30i", "--setup"]
    assert CliRunner().invoke(app, [*verify, str(out)]).exit_code == 0
    assert CliRunner().invoke(app, [*verify, str(tmp_path / "s.toml")]).exit_code == 1
    out.unlink()
    (tmp_path / "r.csv").write_text(table(changed(hits(), "off the plane")))
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 1 and "that of line 4 left out" in done.output and not out.exists()
