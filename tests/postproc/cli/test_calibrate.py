"""`postproc calibrate`: from files to models, what is refused, and the whole loop on a simulated machine."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
import postproc
import toolpaths
from machines.calibration.calibrate import calibrate
from machines.geometric_error.files.loader import load
from postproc.base.options import Options
from postproc.cli.app import app
from postproc.pipeline.convert import verify
from toolpaths.units import DEG

SAMPLES = Path(__file__).parents[3] / "samples"
ARCSEC = DEG / 3600.0


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    shutil.copytree(SAMPLES / "calibration", tmp_path / "c")
    return tmp_path / "c"


def run(folder: Path, source: str, output: str, code: int = 0) -> dict:
    done = CliRunner().invoke(app, ["calibrate", str(folder / source), "-o", str(folder / output), "--json", "-"])
    assert done.exit_code == code, done.stderr
    return json.loads(done.stdout)


def test_samples_are_what_their_script_writes(tmp_path: Path) -> None:
    script = SAMPLES / "calibration" / "make_measurements.py"
    subprocess.run([sys.executable, script, tmp_path], check=True, timeout=60)
    for made in tmp_path.iterdir():
        assert made.read_bytes() == (script.parent / made.name).read_bytes(), made.name


def test_the_whole_loop_gains_what_it_should(folder: Path) -> None:
    """Measure, identify, correct, and run the program on the true machine: 60 um and more become 2 um and less."""
    axis = run(folder, "reversal.toml", "axis.toml")
    assert axis["rank"] == 24 and axis["not_identifiable"] == [] and 0.4 < axis["rms_after"] < 1.3
    places = run(folder, "probe.toml", "machine.toml")
    machine = machines.load("mikron-ucp710")
    truth, found = load(folder / "truth.toml", machine), load(folder / "machine.toml", machine)
    for name, p in places["parameters"].items():
        if "0" in name[:3]:
            unit = ARCSEC if p["unit"] == "arcsec" else 1e-3
            assert abs(p["value"] * unit - truth.axes.constants[name]) < 4.0 * p["sigma"] * unit, name
            assert 0.0 < p["sigma"] < 0.5
        else:
            assert p["sigma"] > 0.01  # what the first fit knew of the axis is kept
    kin, rng = machine.kinematics.with_tool(90.0), np.random.default_rng(2)
    q = np.column_stack([rng.uniform(-100, 100, (500, 3)), rng.uniform(-0.4, 1.5, 500), rng.uniform(-3, 3, 500)])
    tip, _ = kin.forward(q)
    off = np.linalg.norm(truth.on(kin).place(q)[0] - tip, axis=1)
    left = np.linalg.norm(truth.on(kin).place(q)[0] - found.on(kin).place(q)[0], axis=1)
    assert off.max() > 0.05 and left.max() < 0.002

    path, notes = toolpaths.read(SAMPLES / "tool_axis_tour.apt")
    setup = str(SAMPLES / "tools.setup.toml")
    corrected = Options(setup=setup, error_model=str(folder / "machine.toml"))
    result = postproc.convert(path, machine, "linuxcnc", options=corrected, diagnostics=notes)
    assert result.ok
    (folder / "p.ngc").write_text(result.text)
    on_truth = Options(setup=setup, error_model=str(folder / "truth.toml"))
    assert verify(folder / "p.ngc", path, machine, "linuxcnc", None, on_truth, notes).ok
    plain = postproc.convert(path, machine, "linuxcnc", options=Options(setup=setup), diagnostics=notes)
    (folder / "n.ngc").write_text(plain.text)
    assert not verify(folder / "n.ngc", path, machine, "linuxcnc", None, on_truth, notes).ok


FAULTS = [
    ("one set-up", "reversal.csv", None, "calibrate.rank", 5),
    ("axis", "reversal.toml", ('axis = "C"', 'axis = "B"'), "calibrate.axis", 6),
    ("key", "reversal.toml", ("sigma_arcsec", "sigma_arcsecs"), "file.unknown-key", 8),
    ("kind", "reversal.toml", ("[reversal]", "[laser]"), "file.unknown-key", 6),
    ("machine", "reversal.toml", ("mikron-ucp710", "mikron"), "file.not-found", None),
    ("column", "reversal.csv", ("reading", "angle"), "calibrate.column", 5),
    ("unit", "reversal.csv", ("[arcsec]", "[um]"), "calibrate.unit", 5),
    ("step", "reversal.csv", ("0,11,", "0,12,"), "calibrate.row", 14),
    ("endless", "reversal.toml", ("steps = 12", "steps = 100000000"), "file.range", 7),
    ("no uncertainty", "reversal.toml", ("= 0.05", "= 1e-320"), "file.range", 8),
    ("gap", "reversal.csv", ("3,0,", "1000000000,0,"), "calibrate.setup", 5),
    ("oblique", "reversal.toml", ('"mikron-ucp710"\n\n[reversal]\ntable = "reversal.csv"\naxis = "C"',
                                  '"nutating-head"\n\n[reversal]\ntable = "reversal.csv"\naxis = "B"'), "calibrate.axis", 6),
    ("twice", "reversal.csv", ("0,11,", "0,10,"), "calibrate.row", 14),
]


@pytest.mark.parametrize(("name", "change", "code", "line"), [f[1:] for f in FAULTS],
                         ids=[f[0] for f in FAULTS])
def test_faults_are_named_and_nothing_is_written(folder: Path, name: str, change: tuple[str, str] | None, code: str,
                                                 line: int | None) -> None:
    text = (folder / name).read_text()
    if change is None:
        text = "\n".join(text.splitlines()[:14]) + "\n"
    else:
        assert change[0] in text
        text = text.replace(*change, 1)
    (folder / name).write_text(text)
    found, diagnostics = calibrate(folder / "reversal.toml")
    assert found is None or found.model is None
    first = next(d for d in diagnostics if d.code == code)
    assert line is None or first.lines == (line,)
    if code == "calibrate.rank":
        figures = run(folder, "reversal.toml", "out.toml", 1)
        assert figures["output"] is None and figures["not_identifiable"] and figures["rank"] == 13
    assert not (folder / "out.toml").exists()


def test_a_direction_of_no_length_is_refused(folder: Path) -> None:
    (folder / "l.toml").write_text('machine = "mikron-ucp710"\nmodel = "start.toml"\n[laser]\ntable = "probe.csv"\n'
                                   'sigma_um = 1\ntoward = [0, 0, 0]\n')
    found, diagnostics = calibrate(folder / "l.toml")
    assert found is None and [d.lines for d in diagnostics] == [(6,)] and "[1, 0, 0]" in str(diagnostics[0])


def test_one_reading_is_not_enough_and_more_than_noise_is_reported(folder: Path) -> None:
    text = (folder / "reversal.csv").read_text()
    (folder / "reversal.csv").write_text("\n".join(text.splitlines()[:3]) + "\n")
    assert run(folder, "reversal.toml", "o.toml", 1)["rank"] == 3
    (folder / "reversal.csv").write_text(text.replace("\n0,5,-11", "\n0,5,-1"))  # one reading 10 arcsec off
    figures = run(folder, "reversal.toml", "o.toml", 1)
    assert [d["code"] for d in figures["diagnostics"]] == ["calibrate.residual"] and figures["rms_after"] > 2.0
    assert "robust = true" in figures["diagnostics"][0]["hint"] and figures["chance"] < 1e-3
    (folder / "reversal.toml").write_text("robust = true\n" + (folder / "reversal.toml").read_text())
    figures = run(folder, "reversal.toml", "o.toml")
    assert not figures["diagnostics"] and figures["reduced"] < 1.5 and figures["covariance_scale"] < 4.0


def test_a_fit_without_support_is_refused(folder: Path) -> None:
    rows = (folder / "probe.csv").read_text().splitlines()
    (folder / "probe.csv").write_text("\n".join(rows[:5]) + "\n")
    run(folder, "reversal.toml", "axis.toml")
    figures = run(folder, "probe.toml", "out.toml", 1)
    assert figures["not_identifiable"] and not (folder / "out.toml").exists()


def test_all_six_errors_from_a_file(folder: Path) -> None:
    from machines.calibration.rotary_bench import PARTS, Bench
    from machines.geometric_error.tables.csv_table import write_csv
    from samples.calibration.rotary_readings import simulate

    rng, bench = np.random.default_rng(1), Bench(12)
    wave = np.zeros((12, 6))
    wave[:, 2], wave[:, 5] = 1e-3 * np.cos(2 * bench.angles), 4 * ARCSEC * np.sin(bench.angles)
    sigma = np.repeat([1e-5, 0.02 * ARCSEC], 3)
    read = simulate(bench, wave, np.zeros((12, 6)), np.zeros((3, 3, 6)), sigma, rng).reshape(-1, 6)
    columns = {"setup": ("", np.repeat(np.arange(3.0), 12)), "step": ("", np.tile(np.arange(12.0), 3))}
    columns |= {p: ("um" if p[0] == "d" else "arcsec", read[:, k]) for k, p in enumerate(PARTS)}
    (folder / "six.csv").write_text(write_csv(columns))
    (folder / "six.toml").write_text('machine = "mikron-ucp710"\n[rotary]\ntable = "six.csv"\naxis = "C"\nsteps = 12\n'
                                     'harmonics = 2\nsigma_um = 0.01\nsigma_arcsec = 0.02\n')
    figures = run(folder, "six.toml", "six-model.toml")
    assert figures["parameters"]["EZC.cos2"]["value"] == pytest.approx(1.0, abs=0.05)
    assert figures["parameters"]["ECC.sin1"]["value"] == pytest.approx(4.0, abs=0.1)
    assert load(folder / "six-model.toml", machines.load("mikron-ucp710")).axes.frame == {"C": "fixed"}
    (folder / "six.csv").write_text("\n".join((folder / "six.csv").read_text().splitlines()[:13]) + "\n")
    refused = run(folder, "six.toml", "none.toml", 1)
    assert refused["output"] is None and not (folder / "none.toml").exists()


@pytest.mark.parametrize(("source", "ending"), [("reversal.toml", "SVG"), ("probe.toml", "png")])
def test_figures_are_drawn_when_asked_for(folder: Path, source: str, ending: str) -> None:
    from xml.etree import ElementTree

    run(folder, "reversal.toml", "axis.toml")
    odd = folder / f"$x_{{$ & <b>\u0007-- {source}"
    odd.write_text((folder / source).read_text())
    images = []
    for name in ("a", "b"):
        done = CliRunner().invoke(app, ["calibrate", str(odd), "-o", str(folder / "o.toml"),
                                        "--figure", str(folder / f"{name}.{ending}")])
        assert done.exit_code == 0, done.output
        images.append((folder / f"{name}.{ending}").read_bytes())
    assert images[0] == images[1] and len(images[0]) > 10_000
    if ending == "png":
        assert images[0].startswith(b"\x89PNG")
    else:
        text = images[0].decode()
        assert ElementTree.fromstring(text).tag.endswith("svg")
        assert ("condition number" in text) == (source == "reversal.toml")
        assert "residual [standard deviations]" in text


def test_a_figure_shows_what_the_readings_gave(folder: Path) -> None:
    """Points of the picture are those of the account: signature, residuals in standard deviations, 15.32 for m = 2."""
    from matplotlib.figure import Figure

    from machines.calibration import figures as drawn

    found, _ = calibrate(folder / "reversal.toml")
    assert found is not None
    panels = drawn._panels(found.figures)
    sheet = Figure()
    places = sheet.subplots(len(panels), 1)
    for place, (panel, given) in zip(places, panels, strict=True):
        panel(place, given)
    axis, indexer = places[0].lines
    assert axis.get_ydata() == pytest.approx(found.figures["axis_arcsec"])
    assert indexer.get_ydata() == pytest.approx(found.figures["indexer_arcsec"])
    residuals = np.concatenate([line.get_ydata() for line in places[1].lines[:4]])
    assert np.sqrt(np.mean(residuals**2)) == pytest.approx(found.figures["rms_after"])
    assert places[2].lines[0].get_xdata().tolist() == list(range(2, 13))
    assert places[2].lines[0].get_ydata()[0] == pytest.approx(15.3226, abs=1e-3)


def test_wrong_figures_are_refused_and_none_is_drawn_of_a_refused_fit(folder: Path) -> None:
    call = ["calibrate", str(folder / "reversal.toml"), "-o", str(folder / "o.toml"), "--figure"]
    done = CliRunner().invoke(app, [*call, str(folder / "f.gif")])
    assert done.exit_code == 2 and ".png or .svg" in done.output and not (folder / "o.toml").exists()
    (folder / "reversal.csv").write_text("\n".join((folder / "reversal.csv").read_text().splitlines()[:14]) + "\n")
    done = CliRunner().invoke(app, [*call, str(folder / "f.png")])
    assert done.exit_code == 1 and not (folder / "f.png").exists()


def test_drawing_is_not_loaded_unless_asked_for(folder: Path) -> None:
    code = (f"import sys; from machines.calibration.calibrate import calibrate; "
            f"calibrate({str(folder / 'reversal.toml')!r}); sys.exit('matplotlib' in sys.modules)")
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 0
