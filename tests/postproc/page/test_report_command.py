"""The command `report` and `convert --report`: what is written, when, and that texts of files stay texts."""

from __future__ import annotations

import hashlib
import json
import math
import re
import zlib
from base64 import b64decode
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from postproc.cli.app import app
from postproc.page import drawings
from postproc.page.columns import unpacked
from postproc.page.quantity_drawings import tilt
from tests.postproc.kit import SAMPLES
from tests.postproc.page.page_kit import CUTS, HOSTILE, LINES, refused, reported, small, turned

SETUP = str(SAMPLES / "tools.setup.toml")


def test_each_control_is_a_run_with_what_its_proof_says_and_rests_on() -> None:
    made = small()
    assert made.code == 0 and made.values["ok"] and made.values["report_version"] == 1
    assert [run["controller"] for run in made.values["runs"]] == ["linuxcnc", "siemens-840d"]
    for run in made.values["runs"]:
        assert run["proved"] and run["conversion"]["worst_tip_deviation_mm"] <= run["tolerance_mm"] == 0.01
        assert run["statement"].startswith("proved: tip within")
        assert {one["role"] for one in run["files"]} >= {"cl_file", "program", "setup", "machine", "controller"}
        low, high = run["conversion"]["band_s"]
        assert low <= run["conversion"]["cycle_time_s"] <= high


def test_hashes_are_those_of_the_files_and_of_the_program_that_convert_writes(tmp_path: Path) -> None:
    cl = tmp_path / "part.cls"
    cl.write_text("\n".join(LINES) + "\n")
    page = tmp_path / "r.html"
    done = CliRunner().invoke(app, ["convert", str(cl), "-m", "mikron-ucp710", "-c", "linuxcnc", "--setup", SETUP, "-o",
                                    str(tmp_path / "part.nc"), "--report", str(page)])
    assert done.exit_code == 0, done.output
    said = {(one["role"], one["file"]): one["sha256"] for one in small().values["runs"][0]["files"]}
    for role, file in (("cl_file", cl), ("program", tmp_path / "part.nc")):
        assert said[role, file.name] == hashlib.sha256(file.read_bytes()).hexdigest()
    assert said["program", "part.nc"] in page.read_text()


def test_the_page_asks_nothing_of_anybody_and_holds_texts_as_texts() -> None:
    page = small().page.read_text()
    assert page.count("<script") == page.count("</script>") and HOSTILE not in page
    assert "\\u003c/script\\u003e" in page  # the name of the part, in the JSON
    assert "default-src 'none'" in page
    shown = re.sub(r"(?s)<title>.*?</title>|<script type=.*?</script>", "", page)  # texts and figures, whatever they say
    assert not re.search(r"""(src|href)=["']?(?!#)\w|@import|url\(|importScripts|fetch\(|XMLHttpRequest""", shown)


def test_texts_are_the_bytes_of_the_files_and_may_be_left_out(tmp_path: Path) -> None:
    page = small().page.read_text()
    kept = dict(re.findall(r'id="text-([\w-]+)" data-name="[^"]*">([^<]*)<', page))
    assert set(kept) == {"cl", "nc0-0", "nc1-0"}
    assert zlib.decompress(b64decode(kept["cl"])).decode().splitlines() == LINES
    without = reported("--no-texts")
    assert without.code == 0 and 'id="text-cl"' not in without.page.read_text()


def test_what_cannot_be_converted_is_on_the_page_with_its_reasons() -> None:
    made = refused()
    run = made.values["runs"][0]
    assert made.code == 1 and not made.values["ok"] and not run["converted"] and run["points"] is None
    assert any(d["severity"] == "error" for d in run["conversion"]["diagnostics"])
    assert made.page.exists() and "not converted" in made.said


@pytest.mark.parametrize("sigma", ["[sigma]\nEA0C = 5.0\n", ""])
def test_each_place_has_the_uncertainty_of_its_error(sigma: str, tmp_path: Path) -> None:
    """A table that is tilted by 50 arcsec, known to 5 arcsec (one standard deviation): a fifth of the error at each place
    (k = 2)."""
    model = tmp_path / "e.toml"
    model.write_text('machine = "mikron-ucp710"\ncorrected_by = "post"\nlength_unit = "um"\nangle_unit = "arcsec"\n'
                     "[location]\nEA0C = 50.0\n" + sigma)
    made = reported("--error-model", str(model), "--no-texts")
    errors = made.values["runs"][0]["errors"]
    every = [*errors["places"], *errors["worst"]]
    assert made.code == 0 and len(every) == 12 + 10 and errors["worst_before_um"] > 1.0
    assert min(one["before_um"] for one in every) < 0.9 * errors["worst_before_um"]
    found = [one["uncertainty_k2_um"] for one in every]
    assert found == [pytest.approx(0.2 * one["before_um"], rel=1e-3) if sigma else None for one in every]
    assert errors["uncertainty_k2_um"] >= max(found) if sigma else errors["uncertainty_k2_um"] is None


def test_a_message_names_the_block_that_moves_for_its_line() -> None:
    """Feeds lowered for an axis: the block of each CL line is the first with its point as the axes have it."""
    made = reported(lines=tuple(line.replace("600", "60000") for line in LINES))
    run = made.values["runs"][0]
    page = made.page.read_text()
    text = zlib.decompress(b64decode(dict(re.findall(r'id="text-([\w-]+)" data-name="[^"]*">([^<]*)<', page))["nc0-0"]))
    program, links = text.decode().splitlines(), dict(zip((d["code"] for d in run["conversion"]["diagnostics"]),
                                                          run["message_lines"], strict=True))
    slowed = next(d for d in run["conversion"]["diagnostics"] if d["code"] == "feed.reduced")
    assert [one["cl_line"] for one in links["feed.reduced"]] == slowed["lines"][:8] and links["setup.tool_unused"] == []
    for one in links["feed.reduced"]:
        tilt = 180.0 / math.pi * math.asin(float(LINES[one["cl_line"] - 1].split(",")[3]))
        before = 180.0 / math.pi * math.asin(float(LINES[one["cl_line"] - 2].split(",")[3]))
        turned = re.findall(r" A(-?[\d.]+)", "\n".join(program[:one["nc_line"]]))[-1]
        assert one["nc_file"] == 0 and before - 1e-3 < abs(float(turned)) < tilt + 1e-3, one
        assert re.search(r"G1|[XYZAC]-?\d", program[one["nc_line"] - 1]), one


def test_figures_are_drawn_without_a_browser_with_units_on_their_axes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each sheet filled; that a sheet becomes PNG and SVG is of `toolpaths/drawing.py`."""
    from matplotlib.figure import Figure

    drawn = dict[str, list[str]]()

    def filled(size: tuple[float, float], title: str, fill: Callable[[Figure], None], ending: str) -> bytes:
        sheet = Figure(figsize=size)
        if title in drawn:
            return ending.encode()  # the same sheet in the other form
        fill(sheet)
        drawn[title] = [place.get_xlabel() + "|" + place.get_ylabel() for place in sheet.axes]
        return ending.encode()
    monkeypatch.setattr(drawings, "image", filled)
    made = drawings.drawings(small().values | {"runs": small().values["runs"][1:]})
    given = [name for name in drawings.names(1) if not name.startswith(("errors", "polytope", "path-correction"))]
    assert sorted(made) == sorted(given) and made["path-1.svg"] == b".svg"
    more = drawings.drawings(turned().values)
    assert {"errors-1.svg", "polytope-1.png", "path-correction-1.png"} <= set(more) <= set(drawings.names(1))
    labels = [label for one in drawn.values() for label in one]
    assert len(drawn) > 20 and all(re.search(r"\b(mm|um|deg|s|m/s[²³]?)(\b|$|,)|%", label) for label in labels), labels


def test_tilts_are_those_of_the_cl_file() -> None:
    """Of the cuts, whose axes the CL file has at 0, 0.02, ... rad from z; on a machine of axes they come from its axes."""
    run = small().values["runs"][0]
    columns = unpacked(b64decode(run["points"]["data"]), run["points"]["columns"])
    found, lines = tilt(run, columns), columns["CL line"].astype(int)
    for k in (1, 5, 11):
        last = np.flatnonzero(lines == LINES.index(CUTS[k]) + 1)[-1]
        assert found[last] == pytest.approx(math.degrees(0.02 * k), abs=1e-3)


@pytest.mark.parametrize(("arguments", "said"), [
    (["-o", "r.txt"], "r.txt is no .html file"), (["-m", "a", "-m", "a"], "a is named twice"),
    ([*(x for k in range(13) for x in ("-c", f"c{k}"))], "a report holds up to 12")])
def test_wrong_use(arguments: list[str], said: str, tmp_path: Path) -> None:
    given = ["report", "part.cls", *arguments]
    for option, value in (("-m", "mill-3axis"), ("-c", "linuxcnc"), ("-o", str(tmp_path / "r.html"))):
        given += [] if option in arguments else [option, value]
    done = CliRunner().invoke(app, given)
    assert done.exit_code == 2 and said in " ".join(done.output.replace("│", " ").split())


def test_a_page_never_replaces_an_input(tmp_path: Path) -> None:
    cl = tmp_path / "part.html"
    cl.write_text("\n".join(LINES))
    done = CliRunner().invoke(app, ["report", str(cl), "-m", "mill-3axis", "-c", "linuxcnc", "-o", str(cl)])
    assert done.exit_code == 2 and cl.read_text().startswith("PARTNO")


def test_its_time_is_that_of_the_command_time(tmp_path: Path) -> None:
    """For a control that is executed: by formulas the blade took 224 s, executed 309 s, neither in the band of the other."""
    cl, said = tmp_path / "part.cls", tmp_path / "t.json"
    cl.write_text("\n".join(LINES) + "\n")
    done = CliRunner().invoke(app, ["time", str(cl), "-m", "mikron-ucp710", "-c", "siemens-840d", "--setup",
                                    str(SAMPLES / "tools.setup.toml"), "--json", str(said)])
    assert done.exit_code == 0, done.output
    found, run = json.loads(said.read_text()), small().values["runs"][1]
    assert run["controller"] == "siemens-840d" and run["conversion"]["time"]["model"] == "control"
    assert run["conversion"]["cycle_time_s"] == pytest.approx(found["cycle_time_s"])
    assert run["conversion"]["band_s"] == pytest.approx(found["band_s"])
    assert all(one["seconds"][run["what_if"]["factors"].index(1.0)] == run["conversion"]["cycle_time_s"]
               for one in run["what_if"]["limits"])
