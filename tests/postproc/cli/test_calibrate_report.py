"""What `postproc calibrate` says: the account, the names, the approach directions, the schema, and what its README says."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
from machines.calibration.calibrate import calibrate
from machines.calibration.measurement_file import COLUMNS, DIRECTION, JOINT, MeasurementModel
from machines.calibration.result_figures import CalibrationFigures
from machines.calibration.result_text import text
from machines.calibration.run import approach_column
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.rods import RodErrors, rod_frame, rod_names
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.files.loader import load
from machines.geometric_error.tables.csv_table import read_csv, write_csv
from machines.user_model import key_texts
from postproc.cli.app import app

ROOT = Path(__file__).parents[3]
README = (ROOT / "machines/calibration/README.md").read_text(encoding="utf-8")
ARCSEC = np.pi / 180.0 / 3600.0


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    shutil.copytree(ROOT / "samples" / "calibration", tmp_path / "calibration")
    for name in ("tool_axis_tour.apt", "tools.setup.toml"):
        shutil.copy(ROOT / "samples" / name, tmp_path)
    return tmp_path / "calibration"


def noted(folder: Path, source: str, code: int = 0) -> tuple[str, str]:
    done = CliRunner().invoke(app, ["calibrate", str(folder / source), "-o", str(folder / "out.toml")])
    assert done.exit_code == code, done.stderr
    return done.stdout, done.stderr


# ---- README and schema -------------------------------------------------------------------------------------

def test_the_example_of_the_readme_is_a_good_file(folder: Path) -> None:
    example = re.search(r"```toml\n(.*?)```", README, re.DOTALL)
    assert example is not None
    (folder / "example.toml").write_text(example[1])
    (folder / "start.toml").write_text((folder / "bar-start.toml").read_text())
    assert "rank 7 of 7" in noted(folder, "example.toml")[0]


def test_readme_and_schema_say_what_every_column_is() -> None:
    done = CliRunner().invoke(app, ["calibrate", "--schema"])
    assert done.exit_code == 0
    schema = json.loads(done.stdout)
    assert set(COLUMNS) <= set(schema["properties"]) and "large" in schema["properties"]
    for kind, columns in COLUMNS.items():
        model = schema["properties"][kind]["anyOf"][0]["$ref"].split("/")[-1]
        listed = {c["name"]: c["meaning"] for c in schema["$defs"][model]["properties"]["table"]["columns"]}
        assert {c.name: c.meaning for c in columns}.items() <= listed.items()
        assert (listed.get("X, Y, ...") == JOINT) == (kind not in ("reversal", "rotary"))
        for column in columns:
            assert f"`{column.name}`" in README and f"`[{kind}]`" in README
            if kind in ("ball_bar", "laser", "reversal"):
                assert column.meaning in README, column
    assert JOINT in README and DIRECTION in README
    assert approach_column("X") == "X way" and "`X way`, ..." in README  # the name in users' tables
    assert {"name": "X way, ...", "unit": "", "meaning": DIRECTION} in \
        schema["$defs"]["LaserModel"]["properties"]["table"]["columns"]
    assert set(key_texts(MeasurementModel)) == set(MeasurementModel.model_fields)


# ---- the account -------------------------------------------------------------------------------------------

def test_only_what_was_asked_for_is_listed_with_as_many_digits_as_are_known(folder: Path) -> None:
    """Three of four parameters of the start; the ball and the bar as they were simulated."""
    start = (folder / "bar-start.toml").read_text() + "EX0C = 0.004\n"
    (folder / "bar-start.toml").write_text(start)
    source = folder / "ball_bar.toml"
    source.write_text(source.read_text().replace('model =', 'parameters = ["EC0Y", "EB0Z", "EA0Z"]\nmodel ='))
    lines = noted(folder, "ball_bar.toml")[0].splitlines()
    assert lines[1] == "rank 7 of 7, condition number 1.000, 72 readings"
    assert re.fullmatch(r"weighted residual 48\.\d\d before, 5\.4\d\d with nothing found of the machine, 1\.0\d\d after",
                        lines[2])
    scaled = re.fullmatch(r"standard deviations are (1\.\d+) times those of the stated noise", lines.pop(3))
    assert scaled is not None
    ball = re.fullmatch(r"ball found at (\S+), (\S+), (\S+) mm, 0\.02\d\d mm from the stated centre; distances are 3\.\d+ "
                        "um too long", lines[3])
    assert ball is not None and [float(v) for v in ball.groups()] == pytest.approx([0.012, -0.02, -89.992], abs=5e-4)
    assert [line.split()[0] for line in lines[5:8]] == ["EC0Y", "EB0Z", "EA0Z"]
    value, sigma = lines[5].split()[1], lines[5].split()[3]
    assert float(sigma) == pytest.approx(0.2377 * float(scaled[1]), abs=6e-4)
    assert len(value.split(".")[1]) == 3 and abs(float(value) - 8.0) < 4 * 0.238
    assert lines[8:] == ["other parameters, which stay as they were: 1"]
    found, _ = calibrate(source)
    assert found is not None and set(found.figures["parameters"]) == {"EC0Y", "EB0Z", "EA0Z"}
    assert found.figures["covariance_scale"] == pytest.approx(float(scaled[1]) ** 2, rel=1e-3)
    assert found.figures["kept"] == 1 and found.figures["unknowns"] == 7 and found.figures["spare"] == 65
    assert found.figures["reduced"] == pytest.approx(found.figures["rms_after"] * np.sqrt(72.0 / 65.0))
    assert load(folder / "out.toml", machines.load("mikron-ucp710")).values[-1] == pytest.approx(4e-6)


def test_what_is_not_known_is_said_to_be_so(folder: Path) -> None:
    done = CliRunner().invoke(app, ["calibrate", str(folder / "rotary.toml"), "-o", str(folder / "out.toml"),
                                    "--json", str(folder / "f.json")])
    out = done.stdout.rstrip()
    assert "rank 20 of 24, condition number 3.6" in out and "+- 0.0000" not in out
    last = out.splitlines()[-1]
    assert last.startswith("not known, 0 in the model: EXC.mean, EXC.cos1, EXC.sin1, ") and "EZC.cos1" not in last
    parameters = json.loads((folder / "f.json").read_text())["parameters"]
    assert parameters["EXC.cos1"]["sigma"] is None and parameters["EZC.cos2"]["sigma"] > 0.0
    for name, value in (("EZC.cos2", 1.5), ("EZC.sin2", -0.5), ("EAC.cos2", 1.0), ("ECC.cos1", 2.0),
                        ("ECC.sin1", 4.0)):
        p = parameters[name]
        assert abs(p["value"] - value) < 4.0 * p["sigma"], name


def test_values_of_a_table_say_where_they_are_and_by_which_way(folder: Path) -> None:
    out, _ = noted(folder, "laser.toml")
    assert re.search(r"EXX\[0\]\+ +-7\.\d+ \+- 0\.212 um +at X -300 \+\n", out)
    assert re.search(r"EXX\[12\]- +4\.\d+ \+- 0\.212 um +at X 300 -$", out) and "zero" not in out
    assert re.search(r"ECC\[1\] .* arcsec +at C 30\n", noted(folder, "reversal.toml")[0])
    found = load(folder.parent / "calibration" / "screw-truth.toml", machines.load("mikron-ucp710"))
    fitted, _ = calibrate(folder / "laser.toml")
    assert fitted is not None and fitted.model is not None
    assert np.abs(fitted.model.values - found.values).max() < 4.0 * 0.212e-3


def test_an_infinite_condition_number_is_called_so() -> None:
    figures = CalibrationFigures(
        parameters={}, kept=0, rank=7, unknowns=11, condition_number=None, readings=216, spare=209, rms_before=1e5,
        rms_instrument=5.0, rms_after=0.99387, reduced=1.0, chance=0.5, covariance_scale=1.0, converged=True,
        not_identifiable=[])
    assert text(figures, "nothing written").splitlines() == [
        "nothing written", "rank 7 of 11, condition number infinite, 216 readings",
        "weighted residual 1.000e+05 before, 5.000 with nothing found of the machine, 0.9939 after"]


# ---- names and columns -------------------------------------------------------------------------------------

def test_a_wrong_name_is_answered_with_those_near_it(folder: Path) -> None:
    (folder / "screw-start.toml").write_text((folder / "screw-start.toml").read_text()
                                             + "[location]\nEC0Y = 0.0\nEC0A = 0.0\nEZ0A = 0.0\n")
    source = folder / "laser.toml"
    source.write_text(source.read_text().replace("model =", 'parameters = ["EC0X", "EXX"]\nmodel ='))
    _, err = noted(folder, "laser.toml", 1)
    assert ("laser.toml:3: error [calibrate.parameter] screw-start.toml has no parameter 'EC0X'; near it are EC0Y, EC0A"
            in err) and "it has" not in err
    assert "the model has EXX[0]+ .. EXX[12]- (26), EC0Y, EC0A, EZ0A" in err


def test_values_that_are_not_reported_are_named_once_and_shortly(folder: Path) -> None:
    (folder / "laser.csv").write_text((folder / "laser.csv").read_text().replace("X way", "run"))
    _, err = noted(folder, "laser.toml", 1)
    assert err.count("[calibrate.rank]") == 1 and "of EXX[1]+, EXX[1]-; of EXX[2]+, EXX[2]-, and of 10 more; say in" in err
    assert "laser.csv: run not used" in err and "info [calibrate.ways]" in err and "add a column X way" in err
    (folder / "bar-start.toml").write_text((folder / "bar-start.toml").read_text() + "EC0A = 0.0\nEZ0A = 0.0\n")
    _, err = noted(folder, "ball_bar.toml", 1)
    assert err.count("[calibrate.rank]") == 1 and "the readings do not determine EC0A, EZ0A; measure" in err


def test_readings_from_one_side_are_off_unless_the_table_says_so(folder: Path) -> None:
    """X always forwards: 3 um of lost motion show as 1.5 um of the place of C, and not where the approach
    directions are reported."""
    (folder / "start.toml").write_text('base = "screw-truth.toml"\n[location]\nEX0C = 0.0\nEY0C = 0.0\n')
    (folder / "probe.toml").write_text((folder / "probe.toml").read_text().replace("EC0Y", "EX0C", 1))
    machine = machines.load("mikron-ucp710")
    kin = machine.kinematics.with_tool(90.0)
    table, _ = read_csv(folder / "probe.csv")
    assert table is not None
    q = np.stack([table.columns[n] for n in "XYZAC"], axis=1)
    forwards = np.zeros(q.shape)
    forwards[:, 0] = 1.0
    off = load(folder / "screw-truth.toml", machine).on(kin).place(q, forwards)[0] - kin.forward(q)[0]
    columns = {n: (table.unit[n], table.columns[n]) for n in "XYZAC"} | {"X way": ("", forwards[:, 0])}
    columns |= {f"d{x}": ("um", off[:, k] + 3e-4 * np.sin(np.arange(len(q)) * (k + 1.0))) for k, x in enumerate("xyz")}
    (folder / "probe.csv").write_text(write_csv(columns))
    (folder / "probe.toml").write_text(re.sub(r"parameters = .*", 'parameters = ["EX0C", "EY0C"]',
                                              (folder / "probe.toml").read_text()))
    found, diagnostics = calibrate(folder / "probe.toml")
    assert found is not None and not diagnostics and abs(found.figures["parameters"]["EX0C"]["value"]) < 0.2
    del columns["X way"]
    (folder / "probe.csv").write_text(write_csv(columns))
    found, diagnostics = calibrate(folder / "probe.toml")
    assert found is not None and [d.code for d in diagnostics] == ["calibrate.ways"]
    assert "for X (up to 3 um)" in diagnostics[0].message
    assert abs(found.figures["parameters"]["EX0C"]["value"]) == pytest.approx(1.5, abs=0.3)


def test_as_many_readings_as_unknowns_are_reported_to_be_unchecked(folder: Path) -> None:
    lines = (folder / "laser.csv").read_text().splitlines()
    (folder / "laser.csv").write_text("\n".join(lines[:28]) + "\n")
    assert "info [calibrate.unchecked] 26 readings for as many unknowns" in noted(folder, "laser.toml")[1]


def test_places_the_machine_cannot_stand_at_are_reported_by_line(folder: Path) -> None:
    kin = machines.load("uranesx").kinematics
    names = rod_names(rod_frame(kin.on_rods), kin.axis_names)
    save(ErrorModel(rods=RodErrors.none(kin.axis_names, names), name="rods"), folder)
    (folder / "d.csv").write_text("X [mm],Y [mm],Z [mm],dx [um],dy [um],dz [um]\n0,0,0,1,2,3\n9000,0,-9000,1,2,3\n")
    (folder / "d.toml").write_text('machine = "uranesx"\nmodel = "rods.toml"\n[poses]\ntable = "d.csv"\nsigma_um = 1\n')
    _, err = noted(folder, "d.toml", 1)
    assert "d.csv:3: error [calibrate.row] uranesx cannot stand there (1 of 2 rows)" in err


def test_names_stand_below_every_drawing(folder: Path) -> None:
    from matplotlib.figure import Figure

    from machines.calibration.figures import MANY, _parameters

    place = Figure().subplots()
    chosen = {f"EXX[{k}]": {"value": 1.0 * k, "sigma": 0.1 if k else None, "unit": "um"} for k in range(3 * MANY)}
    _parameters(place, chosen)
    names = [label.get_text() for label in place.get_xticklabels()]
    assert len(names) == MANY and names[:2] == ["EXX[0]", "EXX[3]"]
