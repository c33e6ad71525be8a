"""Modulo (roll-over) rotary axes: words inside one turn, run by each control's own rule, in plan, text,
reader, time and second witness alike."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
from machines.machine import Machine, Turns
from postproc.base.options import Options
from postproc.compile.long_turns import standing_unsaid
from postproc.control.rollover import Rollover
from postproc.controllers.model import load_controller
from postproc.cycle_time.conversion import estimate_of
from postproc.pipeline.result import PostResult
from postproc.readback.dialects.readers import reader_for
from postproc.report.summary import as_dict, as_text
from postproc.witness.turning import check_turning
from postproc.writing.writer import Writer
from tests.postproc.kit import TOOLS, codes, tilted, toolpath
from toolpaths.diagnostics import DiagnosticError, Severity
from toolpaths.toolpath import Toolpath

RULES = (("fanuc-30i", "shortest"), ("fanuc-30i", "sign"), ("linuxcnc", "sign"), ("siemens-840d", "shortest"),
         ("heidenhain-tnc640", "shortest"), ("haas-ngc", "shortest"), ("generic-iso", "sign"), ("generic-iso", "shortest"))
WORD = re.compile(r"(?m)(?<![A-Z])C(?:=(?:DC|ACP|ACN)\()?([-+]?\d+\.?\d*)")
CENTRE = 300.0, 1500.0
"""degrees of C at which the winding cut begins and ends"""


@cache
def rolling(rule: str = "", low: float = 0.0, modulo: bool = True, park: str = "turn") -> Machine:
    """The Mikron with C as a modulo axis."""
    machine = machines.load("mikron-ucp710")
    own = Turns(modulo, low, rule, park)
    turns = tuple(own if letter == "C" else Turns() for letter in machine.axis_names)
    return replace(machine, turns=turns)


@cache
def winding(sense: float = 1.0) -> Toolpath:
    """A cut that winds C more than three turns, crossing the roll-over each time, then a hole side a quarter turn off."""
    turn = np.radians(np.linspace(*CENTRE, 61)) * sense
    axes = np.stack([np.sin(0.5) * np.cos(turn), np.sin(0.5) * np.sin(turn), np.full(61, np.cos(0.5))], axis=1)
    tips = np.stack([20 * np.cos(turn), 20 * np.sin(turn), np.linspace(0.0, -8.0, 61)], axis=1)
    rows = ["GOTO/" + ",".join(f"{v:.9f}" for v in (*p, *a)) for p, a in zip(tips, axes, strict=True)]
    first = "GOTO/" + ",".join(f"{v:.9f}" for v in (*(tips[0] + 40 * axes[0]), *axes[0]))
    side = tilted(40.0, 77.0)
    last = ["GOTO/" + ",".join(f"{v:.9f}" for v in (*(h * side), *side)) for h in (60.0, 30.0, 60.0)]
    return toolpath("RAPID", first, "FEDRAT/MMPM,900", *rows, "RAPID",
                    "GOTO/" + ",".join(f"{v:.9f}" for v in (*(tips[-1] + 40 * axes[-1]), *axes[-1])),
                    "RAPID", last[0], last[1], "RAPID", last[2])


@cache
def converted(controller: str, rule: str, sense: float = 1.0, output: str = "axes",
              low: float = 0.0) -> PostResult:
    return postproc.convert(winding(sense), rolling(rule, low), controller, TOOLS,
                            Options(output=output))


@cache
def counting(controller: str, sense: float = 1.0, park: str = "turn") -> PostResult:
    return postproc.convert(winding(sense), rolling(modulo=False, park=park), controller, TOOLS,
                            Options(output="axes"))


def errors(result: PostResult) -> set[str]:
    return {d.code for d in result.diagnostics if d.severity is Severity.ERROR}


def body(text: str) -> str:
    """Without comments, whose parentheses are not those of DC()."""
    return re.sub(r"(?m)^\(.*\)$|;.*$", "", text)


def values(text: str) -> np.ndarray:
    return np.array([float(v) for v in WORD.findall(body(text))])


def c_of(result: PostResult) -> np.ndarray:
    """Degrees of C at the ends of all executed blocks."""
    assert result.comparison is not None and result.comparison.executed is not None
    return result.comparison.executed[1].end[:, result.machine.axis_names.index("C")]


@pytest.mark.covering
@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize(("controller", "rule"), RULES)
def test_words_stay_inside_one_turn_and_turn_as_planned(controller: str, rule: str, sense: float) -> None:
    result = converted(controller, rule, sense)
    assert result.ok, [str(d) for d in result.diagnostics]
    words, whole = values(result.text), "-360." if controller != "linuxcnc" and rule == "sign" else None
    assert (len(words) > 60 and np.abs(words).max() < 360.0) or whole
    assert np.abs(words).max() <= 360.0
    plain = counting(controller, sense)
    assert plain.ok and np.abs(values(plain.text)).max() > 1000.0
    turned = c_of(result)
    assert abs(turned).max() > 1000.0 and np.abs(np.diff(turned)).max() < 359.9
    assert result.witness is not None and not result.witness.findings
    assert any(what.what == "turns of modulo axes" for what in result.witness.compared)
    last = c_of(result)[-1]
    assert abs(last - 360.0 * round(last / 360.0)) < 1e-6  # parked at a whole turn, nothing unwound


@pytest.mark.covering
@pytest.mark.parametrize(("controller", "rule"), [("fanuc-30i", "shortest"), ("siemens-840d", "shortest"),
                                                   ("heidenhain-tnc640", "shortest"), ("haas-ngc", "shortest")])
@pytest.mark.parametrize("output", ["tcp", "auto"])
def test_in_the_controls_own_modes_too(controller: str, rule: str, output: str) -> None:
    result = converted(controller, rule, 1.0, output)
    assert result.ok, [str(d) for d in result.diagnostics]
    assert np.abs(values(result.text)).max() < 360.0 and result.witness is not None and not result.witness.findings


def test_a_range_of_its_own_is_obeyed() -> None:
    result = converted("heidenhain-tnc640", "shortest", 1.0, "axes", -180.0)
    words = values(result.text)
    assert result.ok and words.min() < -100.0 and words.max() < 180.0


@pytest.mark.parametrize(("controller", "rule"), RULES)
def test_a_turn_of_exactly_half_states_its_direction(controller: str, rule: str) -> None:
    """From C0 to C180 by indexing, and back: never one word of 180 degrees where the control takes the shorter path."""
    path = toolpath("RAPID", "GOTO/0,-40,60,0,-0.6,0.8", "FEDRAT/MMPM,500", "GOTO/0,-10,20,0,-0.6,0.8", "RAPID",
                    "GOTO/0,-40,60,0,-0.6,0.8", "RAPID", "GOTO/0,40,60,0,0.6,0.8", "GOTO/0,10,20,0,0.6,0.8", "RAPID",
                    "GOTO/0,40,60,0,0.6,0.8")
    result = postproc.convert(path, rolling(rule), controller, TOOLS, Options(output="axes"))
    assert result.ok, [str(d) for d in result.diagnostics]
    steps = np.abs(np.diff(np.concatenate([[0.0], c_of(result)])))
    assert np.isclose(steps.sum() % 180.0, 0.0) and steps.sum() > 179.0
    stated = controller == "siemens-840d"
    assert (steps < 179.95).all() or rule == "sign" or stated
    assert not stated or re.search(r"C=AC[PN]\(", result.text)


@pytest.mark.parametrize("controller", ["fanuc-30i", "linuxcnc"])
def test_axes_that_count_park_at_whole_turns_and_unwind_only_where_asked(controller: str) -> None:
    """What is reported is what the time estimate holds more, and where the program ends."""
    left, home = counting(controller), counting(controller, park="home")
    assert left.ok and home.ok and "verify.end" not in codes(left.diagnostics) | codes(home.diagnostics)
    assert c_of(home)[-1] == 0.0 and abs(c_of(left)[-1]) >= 1080.0
    figures, none = as_dict(left, "x.nc")["unwinding"]["C"], as_dict(home, "x.nc")["unwinding"]["C"]
    assert abs(figures["turns_left"]) * 360.0 == abs(c_of(left)[-1]) and none["turns_left"] == 0
    assert figures["next_start_s"] == pytest.approx(abs(c_of(left)[-1]) / 120.0)
    assert none["in_program_s"] == pytest.approx(figures["next_start_s"], abs=0.01) and figures["in_program_s"] < 0.01
    longer = estimate_of(home).seconds - estimate_of(left).seconds
    assert longer == pytest.approx(none["in_program_s"], abs=1.5)
    assert "turns from home" in as_text(left, "x.nc") and "unwinds whole turns" in as_text(home, "x.nc")
    assert "none with modulo = true in" in as_text(left, "x.nc")
    counted = converted(controller, "none")  # modulo = true alone does not help where the control's rule is "none"
    assert 'none with rollover = "shortest" or "sign" in' in as_text(counted, "x.nc")
    rolled = converted(controller, "")
    assert as_dict(rolled, "x.nc")["unwinding"] == {} and "turns from home" not in as_text(rolled, "x.nc")
    assert estimate_of(rolled).seconds < estimate_of(home).seconds - 6.0


def test_the_time_is_that_of_the_way_that_the_control_takes() -> None:
    rolled, plain = estimate_of(converted("linuxcnc", "sign")), estimate_of(counting("linuxcnc"))
    assert rolled is not None and plain is not None and rolled.seconds == pytest.approx(plain.seconds, rel=1e-3)


# ---- ignoring an option is caught --------------------------------------------------------------------------

@pytest.mark.parametrize(("controller", "rule"), [("linuxcnc", "sign"), ("siemens-840d", "shortest")])
def test_a_writer_that_ignores_it_is_caught(controller: str, rule: str,
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Writer, "rolled", lambda self, axis, rows: [
        f"C{text}" for text in self.number_text(self.program.words[rows, axis], 4)])
    result = postproc.convert(winding(), rolling(rule), controller, TOOLS, Options(output="axes"))
    assert not result.ok and "gcode.rollover" in errors(result)


@pytest.mark.parametrize(("controller", "rule"), [("linuxcnc", "sign"), ("fanuc-30i", "sign")])
def test_a_writer_that_forgets_the_sign_is_caught(controller: str, rule: str,
                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    whole = Rollover.words
    monkeypatch.setattr(Rollover, "words", lambda self, degrees, before: (np.abs(whole(self, degrees, before)[0]),
                                                                          np.zeros(len(degrees), dtype=bool)))
    result = postproc.convert(winding(-1.0), rolling(rule), controller, TOOLS, Options(output="axes"))
    assert not result.ok and any(code.startswith("verify.") for code in errors(result))


def test_a_planner_that_does_not_cut_long_turns_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("postproc.pipeline.stages.with_short_turns", lambda path, *rest: path)
    path = toolpath("RAPID", "GOTO/0,-40,60,0,-0.6,0.8", "FEDRAT/MMPM,500", "GOTO/0,-10,20,0,-0.6,0.8", "RAPID",
                    "GOTO/0,-40,60,0,-0.6,0.8", "RAPID", "GOTO/0,40,60,0,0.6,0.8", "GOTO/0,10,20,0,0.6,0.8")
    result = postproc.convert(path, rolling("shortest"), "fanuc-30i", TOOLS, Options(output="axes"))
    assert errors(result) == {"rollover.turn"} and result.text == ""
    [bad] = [d for d in result.diagnostics if d.code == "rollover.turn"]
    assert 'rollover = "none"' in bad.hint
    assert postproc.convert(path, rolling("none"), "fanuc-30i", TOOLS, Options(output="axes")).ok  # the hint, followed


@pytest.mark.parametrize(("controller", "rule", "as_if"), [("linuxcnc", "sign", "shortest"),
                                                            ("fanuc-30i", "shortest", "sign")])
def test_a_reader_of_the_other_rule_is_caught_by_the_second_witness(controller: str, rule: str, as_if: str,
                                                                     monkeypatch: pytest.MonkeyPatch) -> None:
    real = reader_for

    def other(spec, letters, home=None, stop="", rolls=None, clamps=None):
        return real(spec, letters, home, stop, {j: replace(r, rule=as_if) for j, r in (rolls or {}).items()}, clamps)
    monkeypatch.setattr("postproc.verification.read_back.reader_for", other)
    result = postproc.convert(winding(-1.0), rolling(rule), controller, TOOLS, Options(output="axes"))
    assert not result.ok and errors(result) & {"witness.turning", "verify.path", "verify.axis", "verify.rapid", "verify.tip",
                                               "gcode.rollover", "verify.not_reached", "verify.feed", "verify.too_fast",
                                               "verify.off_path"}


def test_a_turn_by_the_other_rule_is_a_finding_of_the_second_witness(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("postproc.witness.second_reading.check_turning", lambda case, executed: check_turning(
        replace(case, modulo=dict.fromkeys(case.modulo, "sign")), executed))
    result = postproc.convert(winding(-1.0), rolling("shortest"), "fanuc-30i", TOOLS, Options(output="axes"))
    assert errors(result) == {"witness.turning"} and result.text == ""


def test_tip_modes_enter_at_the_nearest_whole_turn() -> None:
    """Fanuc's G43.4 is switched on with the tables at zero: a modulo axis does not unwind for that."""
    path = winding()
    seconds = {m: estimate_of(postproc.convert(path, rolling(modulo=m), "fanuc-30i", TOOLS,
                                               Options(output="tcp"))).seconds
               for m in (True, False)}
    assert seconds[True] <= seconds[False] + 0.01


# ---- the readers, word by word -----------------------------------------------------------------------------

def positions(controller: str, rolls: Rollover, *blocks: str) -> tuple[list[float], set[str]]:
    """Where C stands behind each of its words, by the reader of the control alone."""
    spec, _ = load_controller(controller)
    assert spec is not None
    letters = ("X", "Y", "Z", "A", "C")
    head = "BEGIN PGM X MM\n" if controller == "heidenhain-tnc640" else ""
    tail = "\nM30\nEND PGM X MM\n" if head else "\nM30\n"
    text = head + "\n".join(blocks) + tail
    if head:
        text = "\n".join(f"{n} {line}" for n, line in enumerate(text.splitlines())) + "\n"
    code, found = reader_for(spec, letters, np.zeros(5), "", {4: rolls}).read(text)
    bad = {d.code for d in found if d.severity is Severity.ERROR}
    return (code.words.pick("C")[1].tolist() if code is not None else []), bad


SHORT, SIGNED, STATED = Rollover("shortest"), Rollover("sign"), Rollover("shortest", stated=True)


@pytest.mark.parametrize(("controller", "rolls", "blocks", "wanted"), [
    ("fanuc-30i", SHORT, ["G1 C10. F100", "C350.", "C171.", "C340.", "C100."], [10, -10, -189, -20, 100]),
    ("fanuc-30i", Rollover("sign", whole=True), ["G1 C10. F100", "C350.", "C-340.", "C-360.", "C10.", "C-350."],
     [10, 350, 340, 0, 10, -10]),
    ("linuxcnc", SIGNED, ["G1 C10 F100", "C350", "C-340", "C-0", "C-350"], [10, 350, 340, 0, -10]),
    ("linuxcnc", SIGNED, ["G1 C10 F100", "G91 C-30", "G90 C20", "G91 C400", "G90 C-19"], [10, 20, 379]),
    ("siemens-840d", STATED, ["G1 C=DC(10) F100", "C=DC(350)", "C=ACP(340)", "C=ACN(350)"], [10, -10, 340, -10]),
    ("heidenhain-tnc640", SHORT, ["M126", "L C+10 F100", "L C+350", "M127", "L C+10", "M126", "L C+350"],
     [10, -10, -350, -370]),
])
def test_words_as_the_makers_pages_have_them(controller: str, rolls: Rollover, blocks: list[str],
                                             wanted: list[float]) -> None:
    got, bad = positions(controller, rolls, *blocks)
    assert not bad and got == pytest.approx(wanted)


@pytest.mark.parametrize(("controller", "rolls", "blocks"), [
    ("fanuc-30i", SHORT, ["G1 C10. F100", "C190."]),
    ("linuxcnc", SIGNED, ["G1 C10 F100", "C360"]), ("linuxcnc", SIGNED, ["G1 C10 F100", "C-10"]),
    ("siemens-840d", STATED, ["G1 C=DC(10) F100", "C20"]),
    ("siemens-840d", STATED, ["G1 C=DC(10) F100", "C=DC(-20)"]),
    ("siemens-840d", STATED, ["G1 A=DC(10) F100"]),
    ("heidenhain-tnc640", SHORT, ["L C+10 F100", "L C+20"]),
])
def test_what_the_control_refuses_or_nothing_says_is_refused(controller: str, rolls: Rollover,
                                                             blocks: list[str]) -> None:
    assert "gcode.rollover" in positions(controller, rolls, *blocks)[1]


# ---- machine files -----------------------------------------------------------------------------------------

def with_c(folder: Path, *lines: str, axis: str = "C") -> Path:
    text = '\n'.join(['base = "mikron-ucp710"', f"[axes.{axis}]", *lines])
    (folder / "own.toml").write_text(text + "\n")
    return folder / "own.toml"


def test_keys_of_a_machine_file(tmp_path: Path) -> None:
    machine = machines.load(with_c(tmp_path, "modulo = true", "modulo_range = [-180, 180]", 'rollover = "shortest"'))
    assert machine.turns[4] == Turns(True, -180.0, "shortest", "turn") and machine.turns[0] == Turns()
    assert machines.load(with_c(tmp_path, 'park = "home"')).turns[4] == Turns(park="home")


@pytest.mark.parametrize(("axis", "lines", "right"), [
    ("C", ['rollover = "sign"'], ['rollover = "sign"', "modulo = true"]),
    ("C", ["modulo = true", "modulo_range = [10, 370]"], ["modulo = true", "modulo_range = [0, 360]"]),
    ("C", ["modulo = true", 'rollover = "sign"', "modulo_range = [-180, 180]"],
     ["modulo = true", 'rollover = "sign"', "modulo_range = [0, 360]"]),
    ("A", ["modulo = true"], ["modulo = true", 'travel = "unlimited"']),
    ("A", ['park = "home"'], []), ("X", ["modulo = true"], []),
])
def test_keys_that_contradict_each_other_are_refused(axis: str, lines: list[str], right: list[str],
                                                     tmp_path: Path) -> None:
    with pytest.raises(DiagnosticError) as fault:
        machines.load(with_c(tmp_path, *lines, axis=axis))
    assert all((d.hint or "write " in d.message) and d.lines for d in fault.value.diagnostics)
    machines.load(with_c(tmp_path, *right, axis=axis))  # the hint, followed


@pytest.mark.parametrize(("controller", "rule", "right"), [("siemens-840d", "sign", "shortest"),
                                                            ("linuxcnc", "shortest", "sign")])
def test_a_rule_that_the_control_has_not_is_refused(controller: str, rule: str, right: str) -> None:
    result = postproc.convert(winding(), rolling(rule), controller, TOOLS, Options(output="axes"))
    [bad] = [d for d in result.diagnostics if d.severity is Severity.ERROR]
    assert bad.code == "machine.rollover" and f'"{right}"' in bad.hint and result.text == ""
    assert converted(controller, right).ok


def test_haas_counts_turns_unless_the_machine_file_says_so() -> None:
    assert np.abs(values(converted("haas-ngc", "").text)).max() > 1000.0
    assert "map" in converted("haas-ngc", "shortest").text.lower()


@pytest.mark.parametrize(("base", "key", "code", "shown"), [
    ("heidenhain-tnc640", "on = []", "gcode.rollover", ""), ("haas-ngc", 'default = "shortest"', "", "MAPPED TO ONE TURN"),
    ("siemens-840d", 'shortest = "{letter}={value}"', "gcode.rollover", ""),
    ("siemens-840d", 'positive = "{letter} = ACP({value})"', "", "C = ACP(180"),
    ("siemens-840d", 'negative = "{letter} = ACN({value})"', "", "C = ACN(0"),
    ("linuxcnc", 'zero_negative = "-360"', "", "C-360"), ("fanuc-30i", 'rules = ["none"]', "machine.rollover", ""),
    ("linuxcnc", 'needs = { sign = "OWN WORDS {axes}" }', "", "OWN WORDS C"),
])
def test_each_key_of_a_controller_file_counts(base: str, key: str, code: str, shown: str,
                                              tmp_path: Path) -> None:
    shop = tmp_path / "shop.toml"
    shop.write_text(f'base = "{base}"\n[rollover]\n{key}\n')
    path = toolpath("RAPID", "GOTO/0,40,60,0,0.6,0.8", "FEDRAT/MMPM,500", "GOTO/0,10,20,0,0.6,0.8", "RAPID",
                    "GOTO/0,40,60,0,0.6,0.8", "RAPID", "GOTO/0,-40,60,0,-0.6,0.8", "GOTO/0,-10,20,0,-0.6,0.8")
    result = postproc.convert(path, rolling(), shop, TOOLS, Options(output="axes"))
    assert result.ok == (not code), [str(d) for d in result.diagnostics]
    assert not code or (any(e.startswith(code) for e in errors(result)) and result.text == "")
    assert shown in result.text


def test_restart_blocks_are_refused_where_an_axis_that_stands_cannot_be_stated() -> None:
    """A word that repeats where the axis stands may turn it on the rule of the sign; without it a restart is off."""
    sign, shortest = {4: Rollover("sign")}, {4: Rollover("shortest")}
    letters = ("X", "Y", "Z", "A", "C")
    for restart, skipped in ((True, False), (False, True)):
        [found] = standing_unsaid(sign, letters, restart, skipped, "a.cls")
        assert found.code == "rollover.standing" and "C" in found.message and "restart" in found.hint
        assert standing_unsaid(shortest, letters, restart, skipped, "a.cls") == []
    assert standing_unsaid(sign, letters, False, False, "a.cls") == [] == standing_unsaid({}, letters, True, True, "a.cls")


def test_stated_paths_are_of_0_to_360_degrees() -> None:
    """DC of Siemens takes no negative word (alarm 16830)."""
    result = converted("siemens-840d", "shortest", 1.0, "axes", -180.0)
    assert not result.ok and [d.code for d in result.diagnostics if d.severity is Severity.ERROR] == ["machine.rollover"]
    assert "modulo_range = [0, 360]" in next(d.hint for d in result.diagnostics if d.code == "machine.rollover")
