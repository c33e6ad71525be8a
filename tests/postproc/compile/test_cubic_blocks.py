"""Splines of the CL file as blocks of the control: POLY on SINUMERIK, SPL on TNC controls, where the option is fitted."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pytest
from scipy.interpolate import BSpline

import machines
import postproc
from machines.machine import Machine
from postproc.base.options import Options
from postproc.cycle_time.conversion import estimate_of
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from postproc.verification.read_back import read_back
from postproc.verification.second_witness import second_witness
from tests.postproc.reader_kit import SIEMENS, TNC, faults, good, words
from toolpaths.cl.read import read_bytes

HEAD = ("TOOL PATH/A,TOOL,MILL_10\nUNITS/MM\nTLDATA/MILL,10.0000,0.0000,80.0000,0.0000,0.0000\n"
        "MSYS/20.0,5.0,3.0,0.0,1.0,0.0,-1.0,0.0,0.0\n")
CUT = "LOAD/TOOL,1\nSPINDL/RPM,3000,CLW\nRAPID\nGOTO/10,0,50,{axis}\nFEDRAT/MMPM,250\nGOTO/10,0,-3\nFEDRAT/MMPM,600\n"
KNOTS = [0.1, 0.4, 0.5, 0.8, 1.0]
CONTROL = [(10, 0, -3), (11, 3, -3), (8, 7, -4), (0, 4, -3), (-4, -2, -2), (-1, -6, -3), (6, -5, -3), (12, -9, -3)]
FILE = (HEAD + CUT.format(axis="0,0,1") + "NURBS/\nKNOT/" + ",".join(map(str, KNOTS)) + "\n"
        + "".join(f"CNTRL/{x},{y},{z}\n" for x, y, z in CONTROL[1:]) + "RAPID\nGOTO/12,-9,50\nEND-OF-PATH\n")
SETUP = SetupFile.model_validate({"tools": {"1": {"gauge_length": 120.0}}, "part": {"origin": (31.0, -12.0, 5.0)}})
BLOCK = {SIEMENS: re.compile(r"^N\d+ (?:POLY )?PO\[.*$", re.M), TNC: re.compile(r"^\d+ SPL .*$", re.M)}


@cache
def shop(option: str, base: str = "mill-3axis") -> Machine:
    file = Path(mkdtemp()) / "shop.toml"
    file.write_text(f'base = "{base}"\n[control]\n{option}\n')
    return machines.load(file)


@cache
def converted(controller: str, option: str = "splines = true", base: str = "mill-3axis", text: str = FILE,
              units: str = "mm") -> PostResult:
    read = read_bytes(text)
    setup = SETUP.model_copy(update={"output": SETUP.output.model_copy(update={"units": units})})
    return postproc.convert(read.toolpath, shop(option, base), controller, setup, diagnostics=read.diagnostics)


def codes(result: PostResult, text: str) -> set[str]:
    """Codes of errors of a program that somebody has changed, by read-back and second witness."""
    assert result.job is not None
    comparison, found = read_back(text, result.job, "part.cls")
    if comparison is not None and not any(d.severity.name == "ERROR" for d in found):
        found += second_witness(result.source, result.setup, result.options, result.job, comparison, text)[1]
    return {d.code for d in found if d.severity.name == "ERROR"}


@pytest.mark.parametrize("base", ["mill-3axis", "mikron-ucp710"])
@pytest.mark.parametrize("controller", [SIEMENS, TNC])
def test_a_piece_is_a_block(controller: str, base: str) -> None:
    made = converted(controller, base=base)
    assert made.ok and made.witness is not None and not made.witness.not_compared
    assert {c.what: c.count for c in made.witness.compared}["curves"] == len(KNOTS)
    assert len(BLOCK[controller].findall(made.text)) == len(KNOTS)
    plain = converted(controller, "", base)
    assert plain.ok and not BLOCK[controller].search(plain.text)
    assert len(made.text.splitlines()) < 0.5 * len(plain.text.splitlines())


@pytest.mark.parametrize("controller", [SIEMENS, TNC])
@pytest.mark.parametrize("units", ["mm", "inch"])
def test_the_blocks_are_the_spline(controller: str, units: str) -> None:
    """What the text says, evaluated here, against scipy's spline in the words of the program."""
    made = converted(controller, units=units)
    assert made.ok, [str(d) for d in made.diagnostics]
    unit = 25.4 if units == "inch" else 1.0
    curve = np.array([(-y, x, z) for x, y, z in CONTROL], dtype=float)  # by the x axis of MSYS
    tail = np.concatenate([np.zeros(4), KNOTS, np.ones(3)])
    here = curve[0] / unit
    breaks, p = [0.0, *KNOTS], np.linspace(0.0, 1.0, 41)[:, None]
    for n, block in enumerate(BLOCK[controller].findall(made.text)):
        end, second, third = here.copy(), np.zeros(3), np.zeros(3)
        for axis, terms in re.findall(r"PO\[([XYZ])\]=\(([^)]*)\)", block):
            end["XYZ".index(axis)], second["XYZ".index(axis)], third["XYZ".index(axis)] = map(float, terms.split(","))
        for axis, value in re.findall(r" ([XYZ])([-+\d.]+)", block) if controller == TNC else ():
            end["XYZ".index(axis)] = float(value)
            k3, k2, k1 = (float(v) for v in re.findall(rf"K[321]{axis}([-+\d.E]+)", block))
            assert abs(k3 + k2 + k1 + float(value) - here["XYZ".index(axis)]) < 1e-6
            second["XYZ".index(axis)], third["XYZ".index(axis)] = k2 + 3.0 * k3, -k3
        said = here + (end - here - second - third) * p + second * p**2 + third * p**3
        true = BSpline(tail, curve, 3)(breaks[n] + p[:, 0] * (breaks[n + 1] - breaks[n])) / unit
        assert np.abs(said - true).max() < 1.2e-4
        here = end


@pytest.mark.parametrize("controller", [SIEMENS, TNC])
def test_programs_for_a_control_without_are_refused(controller: str) -> None:
    made = converted(controller)
    assert made.job is not None
    for option in ("", "splines = false", 'splines = "bspline"'):
        other = replace(made.job, machine=shop(option))
        assert "verify.option" in {d.code for d in read_back(made.text, other, "part.cls")[1]}
    assert codes(made, made.text) == set()


@pytest.mark.parametrize(("controller", "old", "new"), [
    (SIEMENS, r"(PO\[X\]=\([-\d.]+,)([\d.]+)", r"\g<1>-\2"), (SIEMENS, r"PO\[Y\]=\(([-\d.]+),([-\d.]+),", r"PO[Y]=(\1,"),
    (SIEMENS, r"POLY ", ""), (SIEMENS, r"(PO\[X\]=\([^)]*\).*?)( F600)", r"\1 PL=2\2"),
    (SIEMENS, r"(PO\[X\]=\([-\d.]+,[-\d.]+,)([-\d.]+)", r"\g<1>0.5"), (SIEMENS, r"N\d+ PO\[.*\n", ""),
    (TNC, r"(K3X)\+", r"\1-"), (TNC, r"(K2Y[-+])(\d)", r"\g<1>9"), (TNC, r"\d+ SPL .*\n", ""), (TNC, r" K1X\S+", ""),
    (TNC, r"SPL( X\S+ Y\S+).*?( F600)", r"L\1\2")])
def test_what_is_changed_is_found(controller: str, old: str, new: str) -> None:
    made = converted(controller)
    changed = re.sub(old, new, made.text, count=1)
    assert changed != made.text and codes(made, changed)


def test_the_second_witness_reads_polynomials_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """A writer and a reader that take K2 for K3's place agree with each other: the text is wrong all the same."""
    from postproc.readback.dialects import siemens_polynomials

    made = converted(SIEMENS)
    changed = re.sub(r"PO\[([XYZ])\]=\(([-\d.]+),([-\d.]+),([-\d.]+)\)", r"PO[\1]=(\2,\4,\3)", made.text)
    assert changed != made.text
    cut = siemens_polynomials.Polynomials.stacked
    monkeypatch.setattr(siemens_polynomials.Polynomials, "stacked", lambda self: cut(self)[:, :, [1, 0, 2, 3]])
    assert codes(made, changed) == {"witness.path"}


def test_time_is_that_of_the_curve() -> None:
    """Its chords are no blocks of the control: neither its block time nor its exact stop holds them up."""
    with_curves, plain = (estimate_of(converted(SIEMENS, f"{option}\nblock_time = 0.02"))
                          for option in ("splines = true", ""))
    assert with_curves is not None and plain is not None
    assert with_curves.seconds < plain.seconds
    free = estimate_of(converted(SIEMENS, "splines = true\nblock_time = 0.0"))
    assert free is not None and with_curves.seconds == pytest.approx(free.seconds, rel=0.01)


@pytest.mark.parametrize("more", ["CUTCOM/LEFT\n", "CUTCOM/OFF\n"])
def test_under_compensation_splines_stay_arcs(more: str) -> None:
    made = converted(SIEMENS, text=FILE.replace("FEDRAT/MMPM,600\n", more + "FEDRAT/MMPM,600\n"))
    assert not BLOCK[SIEMENS].search(made.text)


@pytest.mark.parametrize("options", [Options(feed="planned"), Options(smooth=True)])
def test_points_that_are_moved_or_planned_stay_arcs(options: Options) -> None:
    read = read_bytes(FILE)
    made = postproc.convert(read.toolpath, shop("splines = true"), SIEMENS, SETUP, options, diagnostics=read.diagnostics)
    assert made.ok and not BLOCK[SIEMENS].search(made.text)


def test_poly_as_its_page_has_it() -> None:
    """Job Planning, POLY: f(p) = a0 + a1 p + a2 p2 + a3 p3 for p from 0 to PL; an axis without coefficients goes straight; a
    block without PO is a line; G1 ends POLY."""
    head = "G17 G710 G90 G94 G40 G64\nG54\nG0 X0 Y0 Z0\nG1 X0 Y0 F600\n"
    motion = good(SIEMENS, head + "POLY PO[X]=(1,2.5,0.7) PO[Y]=(0.3,1,3.2) PL=1.5\nX3 Y=PO(4,1,0.5,0.25,0.125)\nX5\n"
                  "G1 X6\nM30\n")
    rows = np.array(words(motion))
    first = rows[motion.line == 5]
    p = 1.5 * np.arange(1, len(first) + 1) / len(first)
    for axis, end, second, third in ((0, 1.0, 2.5, 0.7), (1, 0.3, 1.0, 3.2)):
        slope = (end - second * 1.5**2 - third * 1.5**3) / 1.5
        assert np.abs(first[:, axis] - (slope * p + second * p**2 + third * p**3)).max() < 1e-4
    fifth = rows[motion.line == 6]
    p = np.arange(1, len(fifth) + 1) / len(fifth)
    y = 0.3 + (3.7 - 1.875) * p + p**2 + 0.5 * p**3 + 0.25 * p**4 + 0.125 * p**5
    assert np.abs(fifth[:, 0] - (1.0 + 2.0 * p)).max() < 1e-4 and np.abs(fifth[:, 1] - y).max() < 1e-4
    assert (motion.line >= 7).sum() == 2 and len(first) > 8


def test_spl_as_its_page_has_it() -> None:
    """iTNC 530, 60642x, 12.7: X(t) = K3X t3 + K2X t2 + K1X t + X, t from 1 to 0; its first example.
    """
    head = ("0 BEGIN PGM A MM\n1 CYCL DEF 247 DATUM SETTING Q339=+1\n2 TOOL CALL 1 Z S900\n"
            "3 L X+28.338 Y+19.385 Z-0.5 R0 FMAX M3\n")
    spline = ("4 SPL X24.875 Y15.924 Z-0.5 K3X-4.688E-002 K2X2.459E-002 K1X3.486E+000 K3Y-4.563E-002 K2Y2.155E-002 "
              "K1Y3.486E+000 K3Z0.000E+000 K2Z0.000E+000 K1Z0.000E+000 F10000\n")
    motion = good(TNC, head + spline + "5 M30\n6 END PGM A MM\n")
    rows = np.array(words(motion))[motion.line == 5]
    t = 1.0 - np.arange(1, len(rows) + 1) / len(rows)
    assert np.abs(rows[:, 0] - (-0.04688 * t**3 + 0.02459 * t**2 + 3.486 * t + 24.875)).max() < 0.001
    assert np.abs(rows[:, 1] - (-0.04563 * t**3 + 0.02155 * t**2 + 3.486 * t + 15.924)).max() < 0.001
    assert faults(TNC, head + spline.replace("X24.875", "X24.873") + "5 M30\n6 END PGM A MM\n") == {"gcode.curve": [5]}


@pytest.mark.parametrize("body", [
    "PO[X]=(1,2,3)\n", "POLY PO[]=(1,1) PO[X]=(2,1)\n", "POLY PO[C]=(1,2)\n", "POLY PO[X]=(1,2,3,4,5,6)\n",
    "POLY PO[X]=(1,2) PL=0\n", "POLY PO[X]=(1,2) PL=2 PL=3\n", "G0 X5 POLY\n",
    "G1 POLY PO[X]=(1,2)\n", "G93\nPOLY PO[X]=(1,2) F10\n", "G41\nPOLY PO[X]=(1,2)\n", "POLY X1\nG1 PO[X]=(1,2)\n",
    "R1=2\nPOLY PO[X]=(1,2,3)\n"])
def test_other_polynomials_are_refused(body: str) -> None:
    head = "G17 G710 G90 G94 G40 G64\nG54\nG0 X0 Y0 Z0\nG1 X0 F600\n"
    assert "gcode.curve" in faults(SIEMENS, head + body + "M30\n")


CUSP = FILE.replace("RAPID\nGOTO/12,-9,50", "NURBS/\nKNOT/1.0\nCNTRL/32,11,-3\nCNTRL/12.0,11,-3\nCNTRL/32,-9.0001,-3\n"
                    "RAPID\nGOTO/32,-9.0001,50")


def test_a_spline_that_turns_back_stays_arcs() -> None:
    """Where steps of its parameter stand nearly still its chords are no moves to be compared with; the others are blocks."""
    made = converted(SIEMENS, text=CUSP)
    assert made.ok and len(BLOCK[SIEMENS].findall(made.text)) == len(KNOTS)


def test_what_is_refused_as_blocks_is_written_as_arcs(monkeypatch: pytest.MonkeyPatch) -> None:
    from postproc.writing.siemens import SiemensWriter

    cubic = SiemensWriter.cubic
    monkeypatch.setattr(SiemensWriter, "cubic", lambda self, block: cubic(self, block).replace("PO[X]=(", "PO[X]=(1"))
    made = converted.__wrapped__(SIEMENS)
    assert made.ok and "splines.as_arcs" in {d.code for d in made.diagnostics} and not BLOCK[SIEMENS].search(made.text)


@pytest.mark.parametrize(("controller", "option", "text", "code"), [
    (TNC, 'splines = "bspline"', FILE, "splines.no_word"), ("fanuc-30i", "splines = true", FILE, "splines.no_word"),
    (SIEMENS, "splines = true", FILE.replace("NURBS/", "CUTCOM/LEFT,1\nGOTO/10,0,-3.5\nNURBS/"), "splines.kept"),
    (TNC, "splines = false", FILE, ""), (TNC, "splines = true", FILE.partition("NURBS/")[0], "")])
def test_splines_that_are_asked_for_are_not_arcs_without_a_word(controller: str, option: str, text: str, code: str) -> None:
    found = {d.code for d in converted(controller, option, text=text).diagnostics}
    assert {c for c in found if c.startswith("splines.")} == ({code} if code else set())


MORE = "OPSKIP/OFF\nNURBS/\nKNOT/1.0\nCNTRL/15,9,-3\nCNTRL/16,-4,-3\nCNTRL/18,-9,-4\nRAPID\nGOTO/12,-9"
SKIPPED = FILE.replace("NURBS/", "OPSKIP/ON\nNURBS/").replace("RAPID\nGOTO/12,-9", MORE)


@pytest.mark.parametrize(("controller", "text", "files"), [
    (SIEMENS, FILE, True), (TNC, FILE, True), (SIEMENS, SKIPPED, False), (TNC, SKIPPED, False),
    (SIEMENS, SKIPPED.replace("OPSKIP/OFF\n", ""), False)])
def test_what_is_written_is_verified(controller: str, text: str, files: bool, tmp_path: Path) -> None:
    """Polynomials in files of subprograms, behind a code of the feed, or none left under the block switch."""
    read = read_bytes(text)
    setup = SETUP.model_copy(update={"output": SETUP.output.model_copy(update={"files": files})})
    made = postproc.convert(read.toolpath, shop("splines = true"), controller, setup, diagnostics=read.diagnostics)
    assert made.ok and bool(made.files) == files
    (tmp_path / "part.nc").write_text(made.text)
    for name, block in made.files.items():
        (tmp_path / name).write_text(block)
    found = postproc.verify(tmp_path / "part.nc", read.toolpath, shop("splines = true"), controller, setup,
                            diagnostics=read.diagnostics)
    assert {d.code for d in found.diagnostics if d.severity.name == "ERROR"} == set()


def test_programs_next_to_it_are_no_subprograms(tmp_path: Path) -> None:
    """A program with polynomials beside it, whose name only a remark holds, does not change what is verified."""
    plain = converted(SIEMENS, "")
    (tmp_path / "part.nc").write_text(plain.text)
    (tmp_path / "A.nc").write_text(converted(SIEMENS).text)
    read = read_bytes(FILE)
    found = postproc.verify(tmp_path / "part.nc", read.toolpath, shop(""), SIEMENS, SETUP, diagnostics=read.diagnostics)
    assert found.ok, [str(d) for d in found.diagnostics]
