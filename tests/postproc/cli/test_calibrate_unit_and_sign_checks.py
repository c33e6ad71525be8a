"""Faults of unit, sign and order in measurement files: each is reported, and no model is written where it would be wrong."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
from machines.calibration.calibrate import calibrate
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.files.loader import load
from postproc.cli.app import app
from toolpaths.diagnostics import Severity

SAMPLES = Path(__file__).parents[3] / "samples" / "calibration"
Rows = Callable[[dict[str, float]], None]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The samples with axis.toml, which start.toml takes in."""
    folder = Path(shutil.copytree(SAMPLES, tmp_path_factory.mktemp("made") / "c"))
    found, _ = calibrate(folder / "reversal.toml")
    assert found is not None and found.model is not None
    save(replace(found.model, name="axis"), folder)
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "c"))


def text(old: str, new: str) -> Callable[[str], str]:
    def change(content: str) -> str:
        assert old in content
        return content.replace(old, new)
    return change


def rows(change: Rows) -> Callable[[str], str]:
    def changed(content: str) -> str:
        note, head, *body = content.splitlines()
        names = [cell.split(" [")[0] for cell in head.split(",")]
        lines = []
        for line in body:
            row = dict(zip(names, map(float, line.split(",")), strict=True))
            change(row)
            lines.append(",".join(f"{v:.9g}" for v in row.values()))
        return "\n".join([note, head, *lines, ""])
    return changed


def scaled(size: float, *names: str) -> Callable[[str], str]:
    return rows(lambda row: row.update({name: size * row[name] for name in names}))


def swapped(a: str, b: str) -> Callable[[str], str]:
    return rows(lambda row: row.update({a: row[b], b: row[a]}))


def along_machine(content: str) -> str:
    """Readings turned back by A and C of the table: what a probe says that is read along the slides."""
    def change(row: dict[str, float]) -> None:
        a, c = np.radians(row["A"]), np.radians(row["C"])
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(a), -np.sin(a)], [0.0, np.sin(a), np.cos(a)]])
        about_z = np.array([[np.cos(c), -np.sin(c), 0.0], [np.sin(c), np.cos(c), 0.0], [0.0, 0.0, 1.0]])
        turned = np.linalg.inv(about_z @ about_x) @ [row["dx"], row["dy"], row["dz"]]
        row.update(zip(("dx", "dy", "dz"), turned.tolist(), strict=True))
    return rows(change)(content)


SLIPS = {
    "bar in um": ("ball_bar.csv", text("distance [mm]", "distance [um]"), "calibrate.distance", "write distance [mm]"),
    "bar's change": ("ball_bar.csv", rows(lambda r: r.update(distance=r["distance"] - 150.0)), "calibrate.distance",
                     "not what it differs by"),
    "X in inches": ("ball_bar.csv", text("X [mm]", "X [in]"), "calibrate.travel", "(44 times, "),
    "centre": ("ball_bar.toml", text("-90.0]", "-80.0]"), "calibrate.place", "centre = [0.0119, -0.0200, -89.9920]"),
    "tool": ("ball_bar.toml", text("tool_length = 90.0", "tool_length = 80.0"), "calibrate.place", "tool_length = 80"),
    "bar 2 mm": ("ball_bar.csv", rows(lambda r: r.update(distance=r["distance"] + 2.0)), "calibrate.place",
                 "2.003 mm too long"),
    "probe in mm": ("probe.csv", text("[um]", "[mm]"), "error-model.large", "EC0Y is up to 1.735 degrees"),
    "probe far": ("probe.csv", rows(lambda r: r.update(dz=r["dz"] + 5000.0)), "calibrate.place", "4.97 mm from where"),
    "probe too small": ("probe.csv", scaled(1e-3, "dx", "dy", "dz"), "calibrate.slip", "write [mm] in the header"),
    "probe tenfold": ("probe.csv", scaled(10.0, "dx", "dy", "dz"), "calibrate.slip", "dx, dy, dz a tenth as large"),
    "probe, a tenth": ("probe.csv", scaled(0.1, "dx", "dy", "dz"), "calibrate.slip", "dx, dy, dz ten times as large"),
    "dz tenfold": ("probe.csv", scaled(10.0, "dz"), "calibrate.slip", "dz a tenth as large"),
    "Y for X": ("probe.csv", swapped("X", "Y"), "calibrate.slip", "X and Y changed over"),
    "C turned round": ("probe.csv", scaled(-1.0, "C"), "calibrate.slip", "with C turned round only"),
    "dx turned round": ("probe.csv", scaled(-1.0, "dx"), "calibrate.slip", "with dx turned round only"),
    "all turned round": ("probe.csv", scaled(-1.0, "dx", "dy", "dz"), "calibrate.slip", "with all readings turned round"),
    "dx for dy": ("probe.csv", swapped("dx", "dy"), "calibrate.slip", "with dx and dy changed over"),
    "along the machine": ("probe.csv", None, "calibrate.slip", "along the machine instead of the table"),
    "A in rad": ("probe.csv", text("A [deg]", "A [rad]"), "calibrate.travel", "unit of A [rad]"),
    "laser in mm": ("laser.csv", text("reading [um]", "reading [mm]"), "error-model.large", "EXX is up to 10.56 mm"),
    "laser too small": ("laser.csv", scaled(1e-3, "reading"), "calibrate.slip", "reading in mm (write [mm] in the header)"),
    "laser tenfold": ("laser.csv", scaled(10.0, "reading"), "calibrate.slip", "reading a tenth as large"),
    "laser, a tenth": ("laser.csv", scaled(0.1, "reading"), "calibrate.slip", "reading ten times as large"),
    "laser in inches": ("laser.csv", scaled(1.0 / 25400.0, "reading"), "calibrate.slip", "reading in in (write [in]"),
    "X of the laser in um": ("laser.csv", text("X [mm]", "X [um]"), "calibrate.rank", "do not determine EXX[0]+ .."),
    "laser absolute": ("laser.csv", rows(lambda r: r.update(reading=r["reading"] + 1e3 * r["X"])), "error-model.large",
                       "actual less nominal"),
    "errors by name": ("laser.csv", text("reading", "EXX"), "calibrate.column", "no column reading; tables of errors by"),
    "two columns": ("laser.csv", text("Y [mm],Z [mm]", "V [mm],W [mm]"), "calibrate.column", "no column Y, Z; it has X"),
    "no bar": ("ball_bar.csv", text("\n150,0,0,", "\n0,0,0,"), "calibrate.row", "stands 0 mm from the centre"),
    "no number": ("laser.csv", text("-7.321", "1e300"), "calibrate.row", "reading is 1e+297 mm"),
    "approach direction of nothing": ("laser.csv", text("X way", "x way"), "calibrate.column", "write X way"),
    "approach direction of 2": ("laser.csv", scaled(2.0, "X way"), "calibrate.row", "X way is 2"),
    "approach direction in mm": ("laser.csv", text("X way", "X way [mm]"), "calibrate.unit", "write X way alone"),
    "reversal in degrees": ("reversal.csv", text("[arcsec]", "[deg]"), "error-model.large", "ECC is up to 9.982 degrees"),
    "reversal too small": ("reversal.csv", scaled(1e-3, "reading"), "calibrate.silent", "less than any noise"),
    "arcsec under urad": ("reversal.csv", text("[arcsec]", "[urad]"), "calibrate.slip", "reading in arcsec (write [arcsec]"),
    "urad under arcsec": ("reversal.csv", scaled(4.84813681, "reading"), "calibrate.slip", "reading in urad (write [urad]"),
    "reversal tenfold": ("reversal.csv", scaled(10.0, "reading"), "calibrate.slip", "reading a tenth as large"),
    "reversal, a tenth": ("reversal.csv", scaled(0.1, "reading"), "calibrate.slip", "reading ten times as large"),
    "one set-up turned round": ("reversal.csv", rows(lambda r: r.update(reading=r["reading"] * (-1) ** (r["setup"] == 2))),
                                "calibrate.slip", "set-up 2 turned round"),
    "indexer in the other direction": ("reversal.toml", text("steps = 12", "steps = 12\nshifts = [0, 11, 10, 9]"),
                                       "calibrate.slip",
                              "shifts = [0, 1, 2, 3]"),
    "six in mm": ("rotary.csv", text("[um]", "[mm]"), "error-model.large", "EZC is up to 2.039 mm"),
    "ex turned round": ("rotary.csv", scaled(-1.0, "ex"), "calibrate.slip", "with ex turned round"),
    "ex for ey": ("rotary.csv", swapped("ex", "ey"), "calibrate.slip", "with ex and ey changed over"),
    "six, turns in arcsec under urad": ("rotary.csv", lambda c: c.replace("[arcsec]", "[urad]"), "calibrate.slip",
                                        "ex, ey, ez in arcsec (write [arcsec]"),
    "six, places tenfold": ("rotary.csv", scaled(10.0, "dx", "dy", "dz"), "calibrate.slip", "dx, dy, dz a tenth as large"),
    "six, ez tenfold": ("rotary.csv", scaled(10.0, "ez"), "calibrate.slip", "ez a tenth as large"),
    "six, ez alone in arcsec under urad": ("rotary.csv", text("ez [arcsec]", "ez [urad]"), "calibrate.slip",
                                           "with ez in arcsec (write [arcsec]"),
    "steps backwards": ("rotary.csv", rows(lambda r: r.update(step=(12.0 - r["step"]) % 12.0)), "calibrate.slip",
                        "steps counted in the other direction"),
    "set-ups backwards": ("rotary.csv", rows(lambda r: r.update(setup=2.0 - r["setup"])), "calibrate.slip",
                          "set-ups in the other order"),
}


AGAIN = {"probe, a tenth", "laser, a tenth", "reversal, a tenth", "dx turned round", "six, ez tenfold", "probe far",
         "ex turned round", "ex for ey", "dz tenfold", "C turned round", "laser tenfold", "reversal tenfold",
         "urad under arcsec", "six, places tenfold", "set-ups backwards", "six in mm"}
"""faults that others show of another file, or the other way round: with -m slow"""


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow if name in AGAIN else ()) for name in SLIPS])
def test_a_fault_is_reported_and_gives_no_model(name: str, folder: Path) -> None:
    file, change, code, words = SLIPS[name]
    (folder / file).write_text((change or along_machine)((folder / file).read_text()))
    source = folder / f"{file.split('.')[0]}.toml"
    done = CliRunner().invoke(app, ["calibrate", str(source), "-o", str(folder / "out.toml")])
    assert any(f"[{code}]" in line and words in line for line in done.stderr.splitlines()), done.stderr
    assert done.exit_code == 1 and "nothing written" in done.stdout and not (folder / "out.toml").exists()


@pytest.mark.parametrize("kind", ["reversal", "probe", "ball_bar", "laser", "rotary"])
def test_good_files_are_not_suspected(kind: str, folder: Path) -> None:
    found, diagnostics = calibrate(folder / f"{kind}.toml")
    assert found is not None and found.model is not None
    assert all(d.severity is Severity.INFO for d in diagnostics) and [d.code for d in diagnostics] == (
        ["calibrate.hidden"] if kind == "rotary" else [])


def test_what_is_large_is_taken_where_the_file_says_so(folder: Path) -> None:
    """And the model that is written says so in its turn, so that it is read again."""
    (folder / "probe.csv").write_text(rows(lambda r: r.update(dz=r["dz"] + 5000.0))((folder / "probe.csv").read_text()))
    (folder / "laser.csv").write_text(text("[um]", "[mm]")((folder / "laser.csv").read_text()))
    for name in ("probe", "laser"):
        content = (folder / f"{name}.toml").read_text()
        (folder / f"{name}.toml").write_text("large = true\n" + content.replace("sigma_um = 0.3", "sigma_um = 300"
                                                                                if name == "laser" else "sigma_um = 0.3"))
        done = CliRunner().invoke(app, ["calibrate", str(folder / f"{name}.toml"), "-o", str(folder / f"{name}-m.toml")])
        assert done.exit_code == 0 and "warning" in done.stderr, done.stderr
    model = load(folder / "laser-m.toml", machines.load("mikron-ucp710"))
    assert model.large and np.abs(model.values).max() > 10.0
    assert "large = true" in (folder / "laser-m.toml").read_text()
    assert "large = true" not in (folder / "probe-m.toml").read_text()


@pytest.mark.parametrize(("kind", "column"),
                         [("reversal", "reading"), ("laser", "reading"), ("ball_bar", "distance")])
def test_more_noise_than_stated_is_refused_and_taken_where_it_is_asked_for(kind: str, column: str, folder: Path) -> None:
    """The hint is followed; the model's covariance grows by what is left, and its file says so."""
    rng, table = np.random.default_rng(5), folder / f"{kind}.csv"
    noise = {"reversal": 0.5, "laser": 3.0, "ball_bar": 3e-3}[kind]
    before, _ = calibrate(folder / f"{kind}.toml")
    table.write_text(rows(lambda r: r.update({column: r[column] + noise * rng.normal()}))(table.read_text()))
    found, diagnostics = calibrate(folder / f"{kind}.toml")
    assert found is not None and found.model is None
    assert any("accept_residual" in d.hint or "write sigma" in d.hint for d in diagnostics)
    arguments = ["calibrate", str(folder / f"{kind}.toml"), "-o", str(folder / "out.toml")]
    done = CliRunner().invoke(app, [*arguments, "--accept-residual"])
    assert done.exit_code == 0 and "calibrate.residual" in done.stderr, done.stderr
    assert "covariance scaled by" in (folder / "out.toml").read_text() and "times those of the stated noise" in done.stdout
    (folder / f"{kind}.toml").write_text("accept_residual = true\n" + (folder / f"{kind}.toml").read_text())
    accepted, _ = calibrate(folder / f"{kind}.toml")
    assert before is not None and accepted is not None and accepted.model is not None
    for name, p in accepted.figures["parameters"].items():
        assert 6.0 < p["sigma"] / before.figures["parameters"][name]["sigma"] < 16.0


def test_uncertainty_that_is_stated_as_it_is_makes_a_rough_fit_good(folder: Path) -> None:
    """Too little explained is refused at the stated uncertainty, and taken at the true one; the uncertainty
    found grows by as much."""
    rng = np.random.default_rng(3)
    noisy = rows(lambda r: r.update({k: r[k] + 200.0 * rng.normal() for k in ("dx", "dy", "dz")}))
    (folder / "probe.csv").write_text(noisy((folder / "probe.csv").read_text()))
    found, diagnostics = calibrate(folder / "probe.toml")
    assert found is not None and found.model is None and [d.code for d in diagnostics] == ["calibrate.unexplained"]
    stated = re.search(r"write (sigma_um = [0-9.]+)", diagnostics[0].hint)
    assert stated is not None and 150.0 < float(stated[1].split()[-1]) < 250.0
    (folder / "probe.toml").write_text((folder / "probe.toml").read_text().replace("sigma_um = 0.3", stated[1]))
    found, diagnostics = calibrate(folder / "probe.toml")
    assert found is not None and found.model is not None and not diagnostics
    assert found.figures["parameters"]["EX0C"]["sigma"] > 20.0
