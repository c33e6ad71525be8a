"""From a data sheet to a machine: units, pivots by the names of controls, jogs, and every slip at its line of the sheet."""

from __future__ import annotations

import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.machine import Machine
from machines.sheet.drawing import drawing
from machines.sheet.jog import QUESTIONS
from machines.sheet.make import NewMachine, new_machine
from machines.sheet.pivots import points_of
from machines.sheet.quantity import WrongFigureError, read_quantity

TRUNNION = """description = "Our trunnion mill"
source = "brochure of 2023, p. 4"
table = ["B", "C"]
table_slides = ["X"]

[X]
travel = "762 mm"
rapid = "22.9 m/min"
[Y]
travel = "508 mm"
rapid = "900 ipm"
[Z]
travel = "20 in"
rapid = "22.9 m/min"
acceleration = "0.3 g"
[B]
travel = ["-35 deg", "120 deg"]
rapid = "50 rpm"
jog = "right up"
[C]
travel = "endless"
rapid = "300 deg/s"
jog = "anti-clockwise"

[pivots]
form = "haas"
points = { "MRZP" = [-381.02, -254.11, -558.4], "MRZP second" = [-381.05, -254.11, -500.2] }

[times]
tool_change = "2.8 s"
"""
NUTATED = """description = "Our fork head"
source = "brochure"
head = ["C", "B"]

[X]
travel = "2 m"
rapid = "30 m/min"
[Y]
travel = "1 m"
rapid = "30 m/min"
[Z]
travel = "700 mm"
rapid = "20 m/min"
[C]
travel = ["-200 deg", "200 deg"]
rapid = "20 rpm"
[B]
travel = ["-110 deg", "110 deg"]
rapid = "20 rpm"

[pivots]
form = "siemens"
points = { "I3" = [0, 0, 250.1], "I2" = [0.02, 0, 30], "I1" = [-0.02, 0, -280.1] }
"""


def made(folder: Path, text: str = TRUNNION, old: str = "", new: str = "") -> NewMachine:
    assert old in text, old
    path = folder / "shop.sheet.toml"
    path.write_text(text.replace(old, new, 1))
    return new_machine(path, "shop")


def machine_of(folder: Path, text: str) -> Machine:
    result = made(folder, text)
    assert result.machine is not None, [str(d) for d in result.diagnostics]
    return result.machine


def line_of(text: str, part: str) -> int:
    return text[: text.index(part)].count("\n") + 1


def test_a_trunnion_from_its_sheet(tmp_path: Path) -> None:
    result = made(tmp_path)
    assert result.diagnostics == [] and result.machine is not None
    file = tmp_path / "shop.toml"
    file.write_text(result.text)
    m, found = machines.load_checked(file)
    assert m is not None and not found and machines.implausible(file) == []
    assert m.structure == "w C' B' X' b Y Z (C1) t" and m.axis_names == ("X", "Y", "Z", "B", "C")
    np.testing.assert_allclose(m.limits.lower[:4], [-762, -508, -508, np.radians(-35)])
    fast, turning = [22900 / 60, 900 * 25.4 / 60, 22900 / 60], np.radians([300, 300])
    np.testing.assert_allclose(m.limits.velocity, [*fast, *turning], atol=1e-6)
    assert m.limits.acceleration[2] == pytest.approx(0.3 * 9806.65) and m.timing.tool_change == 2.8
    b, c = (joint for name in "BC" for joint in m.kinematics.chain if joint.name == name)
    np.testing.assert_allclose([b.point, c.point], [[-381.02, -254.11, -558.4], [-381.05, -254.11, -500.2]])
    np.testing.assert_allclose([b.direction, c.direction], [[0, 1, 0], [0, 0, -1]])
    stated = {"X.travel", "B.velocity", "Z.acceleration", "C.point", "C.direction", "timing.tool_change"}
    assert stated.isdisjoint(result.assumed)
    assert {"X.acceleration", "B.jerk", "timing.clamp"} <= set(result.assumed)
    assert m.figures["X.travel"] == "brochure of 2023, p. 4: X travel"


def test_a_head_by_swivel_data(tmp_path: Path) -> None:
    m = machine_of(tmp_path, NUTATED)
    assert m.structure == "w b X Y Z C B (C1) t"
    b, c = (joint for name in "BC" for joint in m.kinematics.chain if joint.name == name)
    np.testing.assert_allclose([b.point, c.point], [[0, 0, 250.1], [0.02, 0, 280.1]])
    assert {"B.direction", "C.direction"} <= {name for name, origin in m.figures.items() if origin == "assumed"}


MRZP, SECOND = "[-381.02, -254.11, -558.4]", "[-381.05, -254.11, -500.2]"
ODD = "machine.plausible"
HEAD = '[0, 0, 250.1], "I2" = [0.02, 0, 30], "I1" = [-0.02, 0, -280.1]'
TOP = '[table_top]\nspindle_to_table = ["{}", "{}"]\nsize = "{}"\n[times]'
SLOW = TRUNNION.replace('"22.9 m/min"', '"381 mm/min"').replace('"900 ipm"', '"381 mm/min"')
"""mm/s typed as mm/min for all slides"""
IN_INCHES = '[0, 0, 9.85], "I2" = [0.0008, 0, 1.18], "I1" = [-0.0008, 0, -11.03]'
FORK = NUTATED.replace('["C", "B"]', '["A", "B"]').replace("[C]", "[A]")
BACKWARDS = '[0, 0, 250.1], "I2" = [0.02, 0, -130], "I1" = [-0.02, 0, -120.1]'
UPSIDE_DOWN = '[0, 0, -250.1], "I2" = [0.02, 0, -30], "I1" = [-0.02, 0, 280.1]'


@pytest.mark.parametrize(("text", "old", "new", "code", "says", "line"), [
    (TRUNNION, MRZP, "[381.02, -254.11, -558.4]", ODD, "X = 381.02", "points"),
    (TRUNNION, MRZP, "[-381.02, -254.11, 558.4]", ODD, "above the spindle", "points"),
    (TRUNNION, SECOND, "[-381.05, 254.11, -500.2]", ODD, "Y = 254.11", "points"),
    (TRUNNION, MRZP, "[-15.0, -10.0, -21.98]", ODD, "times 25.4", "points"),
    (TRUNNION, '"900 ipm"', '"900 mm/min"', ODD, "of X 381.667: 25.4 times", "900 mm/min"),
    (TRUNNION, '"508 mm"', '"508 in"', ODD, "travel of Z is 508 mm long, of Y 12903.2", "20 in"),
    (TRUNNION, '"50 rpm"', '"300 rpm"', ODD, "B tilts at 1800 deg/s", "300 rpm"),
    (NUTATED, HEAD, UPSIDE_DOWN, ODD, "below the gauge point", "points"),
    (NUTATED, '"I1" = [-0.02, 0, -280.1]', '"I1" = [0.02, 0, -280.1]', "sheet.figure", "closes the chain", "points"),
    (NUTATED, '"I2"', '"I4"', "sheet.figure", "I2 missing", "points"),
    (TRUNNION, '"22.9 m/min"', '"22900 mm/s"', ODD, "22900 mm/s", "rapid"),
    (TRUNNION, '"22.9 m/min"', '"22900"', "sheet.figure", "no unit", "rapid"),
    (TRUNNION, '"0.3 g"', '"0.3 m/min"', "sheet.figure", "no unit of an acceleration", "acceleration"),
    (TRUNNION, 'jog = "right up"', 'jog = "clockwise"', "sheet.figure", "is no answer for B", "jog"),
    (TRUNNION, '["-35 deg", "120 deg"]', '"155 deg"', "sheet.figure", "one figure", None),
    (TRUNNION, 'form = "haas"', 'form = "siemens"', "sheet.figure", "MRZP is not a name of siemens", "points"),
    (TRUNNION, 'table = ["B", "C"]', 'table = ["C"]', "sheet.figure", "B is neither", "[B]"),
    (TRUNNION, "[times]", TOP.format("102 mm", "610 in", "500 mm"), ODD, "from 102 to 15494 mm", "spindle_to_table"),
    (TRUNNION, "[times]", TOP.format("102 mm", "610 mm", "500 in"), ODD, "the table is 12700 mm large", "size = "),
    (TRUNNION.replace("-558.4", "-58.4"), "[times]", TOP.format("102 mm", "610 mm", "500 mm"), ODD,
     "551.6 mm above the table's top", "points"),
    (TRUNNION.replace("-558.4", "-958.4"), "[times]", TOP.format("102 mm", "610 mm", "500 mm"), ODD,
     "348.4 mm below the table's top", "points"),
    (TRUNNION, "[times]", TOP.format("102", "610 mm", "500 mm"), "sheet.figure", "'102' has no unit", "[table_top]"),
    (SLOW, "20 in", "20 in", ODD, "X goes at 6.35 mm/s at most, B at 300 deg/s", "rapid"),
    (TRUNNION.replace('"300 deg/s"', '"50 deg/min"'), '"50 rpm"', '"300 deg/min"', ODD, "B goes at 5 deg/s", "300 deg"),
    (TRUNNION, MRZP, "[-381.02, 254.11, -558.4]", ODD, "B turns about a line at Y = 254.11", "points"),
    (TRUNNION, MRZP, "[-558.4, -254.11, -381.02]", ODD, "with X and Z of it exchanged", "points"),
    (TRUNNION, SECOND, "[-254.11, -381.05, -500.2]", ODD, "of it exchanged it is there", "points"),
    (TRUNNION, MRZP, "[-250.0, -254.11, -558.4]", ODD, "C and B turn pass one another 131.05 mm apart", "points"),
    (TRUNNION, 'travel = "20 in"', 'travel = "20 in"\nzero = "lower"', ODD, "stays far above it", "points"),
    (TRUNNION, '"50 rpm"', '"300 deg/min"', ODD, "B turns at 5 deg/s, C at 300: 60 times", "deg/min"),
    (NUTATED, HEAD, IN_INCHES, ODD, "B turns about a line only 9.85 mm above the gauge point", "points"),
    (FORK, HEAD, BACKWARDS, ODD, "A, which carries B, turns about a line 130 mm below that of B", "points"),
    (TRUNNION, "rapid = ", "rapit = ", "file.unknown-key", "rapit", "rapit"),
])
def test_a_slip_is_seen_at_its_line(tmp_path: Path, text: str, old: str, new: str, code: str, says: str,
                                    line: str | None) -> None:
    found = made(tmp_path, text, old, new).diagnostics
    assert any(d.code == code and says in d.message for d in found), [str(d) for d in found]
    one = next(d for d in found if d.code == code and says in d.message)
    assert (one.file == str(tmp_path / "shop.sheet.toml") and one.hint) or code == "file.unknown-key"
    if line is not None:
        assert one.lines == (line_of(text.replace(old, new, 1), line),)


def test_distances_of_the_brochure_agree_with_it(tmp_path: Path) -> None:
    """They prove figures and make none: the machine is the same."""
    good = made(tmp_path, TRUNNION, "[times]", TOP.format("610 mm", "102 mm", "500 mm"))
    assert good.diagnostics == [] and good.text == made(tmp_path, TRUNNION).text
    assert "equal ends" in made(tmp_path, TRUNNION, "[times]", TOP.format("1 in", "25.4 mm", "")).diagnostics[0].message
    moved = made(tmp_path, TRUNNION.replace('["X"]', '["X", "Z"]'), "[times]", TOP.format("2 in", "22 in", ""))
    assert moved.diagnostics == [], "where Z moves the table its top has no one place"


def test_all_faults_come_in_one_run(tmp_path: Path) -> None:
    text = TRUNNION.replace('"762 mm"', '"762"').replace('"900 ipm"', '"fast"')
    text = text.replace("right up", "tip left").replace("2.8 s", "2.8 h")
    found = made(tmp_path, text).diagnostics
    assert [d.lines[0] for d in found] == [line_of(text, part) for part in ('"762"', '"fast"', "tip left", "2.8 h")]


def test_odd_figures_come_with_what_cannot_be_read(tmp_path: Path) -> None:
    """Inches per minute typed for mm/s came one run after the length without a unit, a reversed travel one more later."""
    text = TRUNNION.replace('"762 mm"', '"762"').replace('"900 ipm"', '"900 in/s"').replace('"20 in"', '["0 in", "-20 in"]')
    found = made(tmp_path, text).diagnostics
    assert [(d.code, d.lines[0]) for d in found] == [
        ("sheet.figure", line_of(text, '"762"')), ("sheet.figure", line_of(text, '["0 in"')),
        ("machine.plausible", line_of(text, '"900 in/s"'))]
    assert '["-20 in", "0 in"]' in found[1].hint
    assert len(made(tmp_path, TRUNNION.replace('"900 ipm"', '"900 in/s"')).diagnostics) == 1, "of one figure"
    text = TRUNNION.replace("-558.4", "558.4").replace("2.8 s", "2.8 h")
    assert {d.code for d in made(tmp_path, text).diagnostics} == {"sheet.figure", "machine.plausible"}, "the sign of a pivot"
    text = TRUNNION.replace('"762 mm"', '"762"').replace("-254.11", "254.11").replace("22.9 m/min", "22900 mm/s", 1)
    found = made(tmp_path, text).diagnostics
    assert [d.lines[0] for d in found] == [line_of(text, part) for part in ('"762"', "22900 mm/s", "MRZP")], found
    assert made(tmp_path, TRUNNION).unread == ("B", "C")


def test_one_cause_is_one_line(tmp_path: Path) -> None:
    """A wrong end of a slide, or a number that both axes share, came once for each axis; a travel in the wrong unit with all
    that is compared with it."""
    for old, new in (('"762 mm"', '"762 mm"\nzero = "lower"'), ('"762 mm"', '"30 mm"'), (MRZP, "[-381.02, -254.11, 558.4]"),
                     ('"22.9 m/min"', '"22.9 mm/min"')):
        assert len(made(tmp_path, TRUNNION, old, new).diagnostics) == 1, new
    (one,) = made(tmp_path, TRUNNION, '"22.9 m/min"', '"22.9 mm/min"').diagnostics
    assert one.hint == "see to the unit of X rapid, which the sheet has as 22.9 mm/min"
    (one,) = made(tmp_path, TRUNNION, '"300 deg/s"', '"3200 deg/s"').diagnostics
    assert one.hint == "see to the unit of C rapid, which the sheet has as 3200 deg/s, or state its acceleration"
    (one,) = made(tmp_path, NUTATED, '"I2"', '"I4"').diagnostics
    assert "I4" in one.message and "I2 missing" in one.message, "a misspelt name"


def test_a_misspelt_key_hides_no_wrong_figure(tmp_path: Path) -> None:
    """Keys that do not fit are left out, and the figures of the rest are looked at in the same run."""
    text = TRUNNION.replace("rapid = ", "rapids = ", 1).replace("[Y]", "[Y]\nzeros = \"upper\"", 1)
    faults = made(tmp_path, text.replace('jog = "anti-clockwise"', 'jog = "left"')).diagnostics
    assert {d.code for d in faults} == {"file.unknown-key", "file.range"}, "without the speed of X nothing can be made"
    text = TRUNNION.replace("[Y]", "[Y]\nzeros = \"upper\"", 1).replace('jog = "anti-clockwise"', 'jog = "left"')
    assert text.count(" m/min") >= 1
    faults = made(tmp_path, text.replace(" m/min", "", 1)).diagnostics
    assert {d.code for d in faults} == {"file.unknown-key", "file.range", "sheet.figure"}, faults


@pytest.mark.parametrize("word", ["counterclockwise", "Anti-Clockwise", "CCW", "turns anticlockwise"])
def test_a_jog_in_another_spelling(word: str, tmp_path: Path) -> None:
    ours, other = (made(tmp_path, TRUNNION.replace('"anti-clockwise"', f'"{said}"').replace(
        '"right up"', '"right side goes up"' if said == word else '"right up"').replace(
            '["-35 deg", "120 deg"]', '"-35 to 120 deg"' if said == word else '["-35 deg", "120 deg"]')).machine
                   for said in (word, "anti-clockwise"))
    assert ours is not None and other is not None and all(
        was in TRUNNION for was in ('"anti-clockwise"', '"right up"', '["-35 deg", "120 deg"]'))
    q = np.array([[0.0, 0.0, 0.0, 0.2, 0.7]])
    np.testing.assert_array_equal(ours.kinematics.forward(q)[1], other.kinematics.forward(q)[1])


@pytest.mark.parametrize(("letter", "in_table"), QUESTIONS)
def test_what_a_jog_shows_is_what_the_machine_does(letter: str, in_table: bool, tmp_path: Path) -> None:
    """By forward kinematics alone: where a point of the table, or the tip, is after the jog."""
    other = "C" if letter != "C" else "B"
    axes = f"[{letter}]\ntravel = [\"-90 deg\", \"90 deg\"]\nrapid = \"20 rpm\"\njog = \"{{}}\"\n" \
           f"[{other}]\ntravel = [\"-90 deg\", \"90 deg\"]\nrapid = \"20 rpm\"\n"
    place = "-400" if in_table else "200"
    side = 'table = ["%s", "%s"]' % ((letter, other) if letter != "C" else (other, letter)) if in_table else \
        'head = ["%s", "%s"]' % ((other, letter) if letter != "C" else (letter, other))
    for seen, sign in zip(QUESTIONS[letter, in_table][1:], (1, -1), strict=True):
        text = NUTATED.split("[C]")[0].replace('head = ["C", "B"]', side) + axes.format(seen) + \
            f"[pivots]\nform = \"machine\"\npoints = {{ {letter} = [0, 0, {place}], {other} = [0, 0, {place}] }}\n"
        m = machine_of(tmp_path, text)
        moved = _moved(m, letter, in_table)
        expected = {"front up": moved[1][2] > 1, "front down": moved[1][2] < -1, "right up": moved[0][2] > 1,
                    "right down": moved[0][2] < -1, "clockwise": moved[0][1] < -1, "anti-clockwise": moved[0][1] > 1,
                    "tip back": moved[2][1] > 1, "tip front": moved[2][1] < -1, "tip left": moved[2][0] < -1,
                    "tip right": moved[2][0] > 1}
        assert expected[seen], (letter, in_table, seen, sign, moved)


def _moved(m: Machine, letter: str, in_table: bool) -> np.ndarray:
    """How the right edge and the front edge of what turns, and the tip of a tool, move at +10 degrees, machine frame, mm."""
    kin = m.kinematics.with_tool(0.0)
    q = np.zeros((4, 5))
    q[1:, :3] = np.eye(3)
    turned = q.copy()
    turned[:, m.axis_names.index(letter)] = np.radians(10.0)
    tips = kin.forward(turned)[0]
    pivot = next(joint.point for joint in m.kinematics.chain if joint.name == letter)
    if in_table:  # tip = R x + t holds for the gauge point x: the place of a point p of the table is R^-1 (p - t)
        matrix, shift = (tips[1:] - tips[0]).T, tips[0]
        points = np.array([[100.0, 0, 0], [0, -100.0, 0], [0, 0, 0]]) + pivot
        return (points - shift) @ matrix - points
    turn = next(joint.direction for joint in m.kinematics.chain if joint.name == letter)
    edges = np.array([[100.0, 0, 0], [0, -100.0, 0]])
    tip = tips[0] - kin.forward(np.zeros((1, 5)))[0][0]
    return np.array([*(np.radians(10.0) * np.cross(turn, edges)), tip])


def test_pivots_of_each_control() -> None:
    b, c = np.array([-1.0, -2.0, -300.0]), np.array([-1.5, -2.5, -280.0])
    for form, given in (("haas", {"MRZP": b, "MRZP second": c}), ("siemens", {"I2": b, "I3": c - b, "I4": -c}),
                        ("heidenhain", {"Trans 1": b, "Trans 2": c - b}), ("fanuc", {"19700": b, "19703": c - b}),
                        ("machine", {"B": b, "C": c})):
        points, wrong = points_of(form, ("B", "C"), (), {name: tuple(v) for name, v in given.items()})
        assert wrong == [], form
        np.testing.assert_allclose([points["B"], points["C"]], [b, c])
    points, wrong = points_of("heidenhain", ("C",), ("B",), {"Trans 1": tuple(b), "Trans 2": tuple(c - b)})
    np.testing.assert_allclose([points["B"], points["C"]], [b, c], err_msg="one sequence, from the tool on")
    points, wrong = points_of("haas", ("B", "C"), (), {"MRZP": tuple(b)})
    np.testing.assert_allclose([points["B"], points["C"]], [b, b])


def test_a_rotary_axis_without_ends_by_the_words_of_brochures_and_machine_files(tmp_path: Path) -> None:
    """"unlimited" is the word of machine files, and was refused in a sheet."""
    texts = [made(tmp_path, old='travel = "endless"', new=f'travel = "{word}"').text for word in (
        "endless", "unlimited", "Continuous")]
    assert texts[0] and len(set(texts)) == 1


def test_quantities() -> None:
    assert read_quantity("50 rpm", "turning speed") == 300.0 and read_quantity('30 "', "length") == 762.0
    assert read_quantity("25 min-1", "turning speed") == 150.0 == read_quantity("150 deg/sec", "turning speed")
    assert read_quantity("60 IPM", "speed") == 25.4 and read_quantity("5 m/s^2", "acceleration") == 5000.0
    for text, says in (("30", "no unit"), ("8,100 mm", "comma")):
        with pytest.raises(WrongFigureError, match=says):
            read_quantity(text, "length")


def test_the_drawing_shows_travel_pivots_and_senses(tmp_path: Path) -> None:
    m = machine_of(tmp_path, TRUNNION)
    root = ElementTree.fromstring(drawing(m))
    words = [element.text or "" for element in root.iter("{http://www.w3.org/2000/svg}text")]
    assert "B (table): through (-381.02, -254.11, -558.4)" in words
    assert {"seen from the front", "seen from above", "X+", "B+", "C+"} <= set(words)
    other = drawing(machine_of(tmp_path, TRUNNION.replace("anti-clockwise", "clockwise")))
    assert other != drawing(m)


def test_the_sheet_of_the_readme_is_one(tmp_path: Path) -> None:
    page = (Path(machines.__file__).parent / "sheet" / "README.md").read_text("utf-8")
    text = page.split("```toml\n")[1].split("```")[0]
    assert tomllib.loads(text) and made(tmp_path, text).machine is not None


TURNS = ((0, 0), (60, 0), (0, 90), (30, -120))


def readings_of(machine: Machine, length: float = 150.0, turns: tuple[tuple[float, float], ...] = TURNS) -> str:
    """A ball that stands on the table, as the control shows it in four poses, with its digits."""
    kin = machine.kinematics.with_tool(length)
    ball = np.array([[-300.0, -200.0, -450.0]])
    lines = []
    for b, c in turns:
        q = np.array([[0.0, 0.0, 0.0, np.radians(b), np.radians(c)]])
        for _ in range(3):  # slides are straight: the place where the tip meets the ball
            tip, _ = kin.forward(q)
            jacobian = kin.jacobian(q)[0, :3, :3]
            q[0, :3] += np.linalg.solve(jacobian, (ball - tip)[0])
        lines.append(f"{{ B = {b}, C = {c}, at = [{', '.join(f'{v:.3f}' for v in q[0, :3])}] }}")
    return f"\n[touched]\nprobe_length = {length}\nreadings = [{', '.join(lines)}]\n"


def test_readings_of_one_ball_find_a_wrong_sign_that_no_rule_sees(tmp_path: Path) -> None:
    """Signs of a second pivot 0.4 and 0.8 mm beside the first, an axis that counts against its jog."""
    text = TRUNNION.replace("[-381.05, -254.11, -500.2]", "[-381.05, -254.11, -557.6]").replace('"haas"', '"fanuc"').replace(
        '"MRZP"', '"19700"').replace('"MRZP second" = [-381.05, -254.11, -557.6]', '"19703" = [-0.4, 0.8, 0]')
    touched = readings_of(machine_of(tmp_path, text))
    assert made(tmp_path, text + touched).diagnostics == []
    for old, new, says in (("0.8, 0]", "-0.8, 0]", "Y of 19703 0.8"), ("[-0.4", "[0.4", "X of 19703 -0.4"),
                           ("anti-clockwise", "clockwise", "jog = 'anti-clockwise' under [C]")):
        slip = text.replace(old, new, 1)
        assert made(tmp_path, slip).diagnostics == [], "plausible by itself"
        [fault] = made(tmp_path, slip + touched).diagnostics
        assert fault.code == "sheet.figure" and says in fault.hint and "one point" in fault.message and fault.lines
    [fault] = made(tmp_path, text + touched.replace("C = 90", "C = 0").replace("C = -120", "C = 0")).diagnostics
    assert "no reading turns C" in fault.message


@pytest.mark.parametrize(("turns", "old", "new", "says"), [
    (((0, 0), (60, 0), (0, 180)), "", "", "agree with jog = 'clockwise' under [C] as well"),
    (((0, 0), (0.01, 0), (0, 90)), "", "", "B 1 mm further in Z as well"),
    (((0, 0), (60, 0), (0, 360)), "", "", "no reading turns C"),
    (TURNS, "B = 60", "A = 40, B = 60", "A is no rotary axis of the sheet"),
])
def test_readings_that_prove_too_little_prove_nothing(tmp_path: Path, turns: tuple[tuple[float, float], ...], old: str,
                                                      new: str, says: str) -> None:
    text = TRUNNION.replace(', "MRZP second" = [-381.05, -254.11, -500.2]', "")
    touched = readings_of(machine_of(tmp_path, text), turns=turns).replace(old, new)
    [fault] = made(tmp_path, text + touched).diagnostics
    assert says in fault.message and fault.hint and fault.lines


G10 = "G10 L52\nN19700 R-381.02 (X)\nN19701 P1 R-254.11\nN19702Q1L1P-558.4\nN19680 R2\n{c}N19704 R.0\nN19705 R0.\nG11"
CARR = "N1 $TC_CARR1[1]=0 $TC_CARR2[1]=0 $TC_CARR3[1]=0\n" \
       "$TC_CARR4[1]=-381.02 ; I2\n$TC_CARR5[1]=-254.11\nN5 $TC_CARR6[1]=-558.4 $TC_CARR15[1]=-0.03\n" \
       "$TC_CARR16[1]=0\n$TC_CARR17[1]=0\n$TC_CARR23[2]=\"P\""


def test_pivots_as_a_control_puts_them_out(tmp_path: Path) -> None:
    points = 'points = { "MRZP" = [-381.02, -254.11, -558.4], "MRZP second" = [-381.05, -254.11, -500.2] }'
    for form, text in (("fanuc", G10.format(c="N19703 R-0.03\n")), ("siemens", CARR)):
        sheet = TRUNNION.replace('"haas"', f'"{form}"').replace(points, f"text = \'\'\'\n{text}\n\'\'\'")
        chain = {joint.name: joint.point for joint in machine_of(tmp_path, sheet).kinematics.chain}
        np.testing.assert_allclose([chain["B"], chain["C"]], [[-381.02, -254.11, -558.4], [-381.05, -254.11, -558.4]])


@pytest.mark.parametrize(("form", "old", "new", "says"), [
    ("fanuc", "R-0.03", "R-30", "'N19703 R-30': no number with a decimal point"),
    ("fanuc", "R-381.02", "R.", "'N19700 R.': no number with a decimal point"),
    ("fanuc", "N19701 P1 R", "N19701Q1L2P", "paths 1 and 2: give the lines of one"),
    ("fanuc", "N19704 R.0\n", "", "N19704 is missing, Y of 19703"),
    ("fanuc", "N19704", "N19703", "'N19703 R.0': -0.03 stands in a line before it"),
    ("siemens", "$TC_CARR5[1]", "$TC_CARR5[2]", "carriers 1 and 2: give the lines of one"),
    ("siemens", "$TC_CARR16[1]=0", "", "$TC_CARR16 is missing, Y of I3"),
    ("siemens", "# end", "points = { I2 = [1, 2, 3] }", "I2 in `text` and in `points`"),
])
def test_numbers_of_a_control_that_cannot_be_one_machine(tmp_path: Path, form: str, old: str, new: str, says: str) -> None:
    """Numbers of several carriers or paths, of no digits, twice, or not all of a vector: none is taken for 0."""
    text = {"fanuc": G10.format(c="N19703 R-0.03\n"), "siemens": CARR}[form]
    table = f"[pivots]\nform = \"{form}\"\ntext = '''\n{text}\n'''\n# end\n".replace(old, new, 1)
    [fault] = made(tmp_path, TRUNNION.split("[pivots]")[0] + table).diagnostics
    assert fault.code == "sheet.figure" and says in fault.message and fault.lines and fault.hint, str(fault)
