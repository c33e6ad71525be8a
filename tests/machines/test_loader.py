"""Machine files: each fault is a diagnostic with its line, each key is read, internal units come out."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.kinds import BUILT_IN
from toolpaths.diagnostics import DiagnosticError

GOOD = (Path(machines.__file__).parent / "data" / "mikron-ucp710.toml").read_text()
A_TABLE = "[kinematics.axes.A]\n"
AXIS_B = "[axes.B]\ntravel = [0, 1]\nvelocity = 1\nacceleration = 1\njerk = 1\nhome = 0\n"


def faults(folder, old="", new="", text=GOOD):
    assert old in text
    path = folder / "shop.toml"
    path.write_text(text.replace(old, new, 1))
    machine, diagnostics = machines.load_checked(path)
    assert machine is None
    for d in diagnostics:
        assert d.lines and d.file == str(path), d
    return diagnostics


def only(folder, old, new, text=GOOD):
    found = faults(folder, old, new, text)
    assert len(found) == 1, found
    return found[0]


def line_of(text, part):
    return (text[: text.index(part)].count("\n") + 1,)


@pytest.mark.parametrize("name", machines.names())
def test_catalogue_loads(name):
    machine, diagnostics = machines.load_checked(name)
    assert machine is not None and machine.name == name and not diagnostics
    assert machine.description and machine.structure and np.all(machine.limits.lower < machine.limits.upper)


def test_load_raises_with_all_diagnostics():
    with pytest.raises(DiagnosticError, match="did you mean 'mikron-ucp710'"):
        machines.load("mikron-ucp700")


@pytest.mark.parametrize(("name", "hint"), [
    ("mickron.toml", "did you mean 'mikron-ucp710'?"), ("haas-ucm-750.toml", "did you mean 'haas-umc-750'?"),
    ("okuma", "most alike of [0-9]+ are: okuma-mu-5000v, ")])
def test_a_misspelt_name_is_answered_with_the_nearest(name, hint):
    """Not with the list of all; with .toml as little as without."""
    _, [found] = machines.load_checked(name)
    assert re.match(hint.replace("?", "[?]"), found.hint) and len(found.hint) < 160


def test_a_shop_file_starts_from_a_built_in_one(tmp_path):
    path = tmp_path / "our-mikron.toml"
    path.write_text(
        'base = "mikron-ucp710"\n[kinematics.axes.C]\npoint = [0.012, -0.004, 0]\n[axes.Z]\nvelocity = 400\n')
    m = machines.load(path)
    assert m.name == "our-mikron" and m.limits.velocity[2] == 400 and m.limits.velocity[1] == 500
    tip, _ = m.kinematics.forward(np.array([[0, 0, 0, 0, np.pi]]))
    np.testing.assert_allclose(tip, [[0.024, -0.008, 0]], atol=1e-15)


def test_positive_minus_one_turns_the_sense(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text('base = "mikron-ucp710"\n[kinematics.axes.C]\npositive = -1\n')
    q = np.array([[10, 20, 30, 0.3, 0.7]])
    mirrored = q * [1, 1, 1, 1, -1]
    ours, theirs = machines.load(path).kinematics, machines.load("mikron-ucp710").kinematics
    np.testing.assert_array_equal(ours.forward(q), theirs.forward(mirrored))


def test_home_and_travel_are_in_radians(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text('base = "mikron-ucp710"\n[axes.A]\nhome = 90\n')
    m = machines.load(path)
    np.testing.assert_allclose(m.home, [0, 0, 250, np.pi / 2, 0])
    np.testing.assert_allclose(m.limits.upper, [355, 275, 250, np.pi * 2 / 3, np.inf])


@pytest.mark.parametrize(("old", "new", "code", "words"), [
    ("velocity = 500 ", "velocty = 500 ", "file.unknown-key", "did you mean 'velocity'?"),
    ('kind = "serial"', 'kind = "seriall"', "machine.kind", "did you mean 'serial'?"),
    ('kind = "serial"', 'kind = ["serial"]', "machine.kind", "did you mean 'serial'?"),
    ("w C' A' b X Y Z (C1) t", "w C' A b X Y Z (C1) t", "file.value", "primed"),
    ("w C' A' b X Y Z (C1) t", "w C' A' b X Y (C1) t", "file.value", "three linear"),
    ("w C' A' b X Y Z (C1) t", "w C' A' B' b X Y Z t", "file.value", "up to two rotary"),
    ("w C' A' b X Y Z (C1) t", "C' A' X Y Z", "file.value", "from w over one b to t"),
    ("w C' A' b X Y Z (C1) t", "w C' A' b X Q Z (C1) t", "file.value", "'Q'"),
    ("w C' A' b X Y Z (C1) t", "w A' C' b X Y Z (C1) t", "machine.geometry", "only turns it about itself"),
    ("[kinematics.axes.A]\n", "[kinematics.axes.A]\ndirection = [0, 0, -1]\n", "machine.geometry", "parallel"),
    ("[kinematics.axes.A]\n", "[kinematics.axes.A]\ndirection = [1, 1, 0]\n", "machine.geometry", "length 1.41421"),
    ("[kinematics.axes.A]\n", "[kinematics.axes.A]\ndirection = [0, 0, 0]\n", "machine.geometry", "length 0"),
    ("[kinematics.axes.A]\n", "[kinematics.axes.A]\npositive = 2\n", "file.range", "positive"),
    ("[kinematics.axes.A]\npoint = [0, 0, 0]\n", "", "machine.geometry", "rotary axis A has no point"),
    (A_TABLE, "[kinematics.axes.X]\ndirection = [0, 1, 0]\n" + A_TABLE, "machine.geometry", "span"),
    (A_TABLE, "[kinematics.axes.X]\npoint = [0, 1, 0]\n" + A_TABLE, "machine.geometry", "no point"),
    ("[kinematics.axes.A]\n", "[kinematics.axes.B]\n[kinematics.axes.A]\n", "machine.axis-unknown", "X, Y, Z, A, C"),
    ("travel = [-355, 355]", "travel = [355, -355]", "file.value", "empty"),
    ("travel = [-355, 355]", 'travel = "unlimited"', "machine.travel", "linear axis X"),
    ("travel = [-355, 355]", 'travel = "endless"', "file.type", "travel"),
    ("home = 250", "home = 251", "machine.home", "outside its travel"),
    ('retract_axis = "Z"', 'retract_axis = "A"', "machine.retract-axis", "choose from X, Y, Z"),
    ("[timing]", AXIS_B + "[timing]", "machine.axis-unknown", "no axis B"),
    ("[timing]", '[control]\nmodule = "xyzac-trt-kins"\n[timing]', "machine.control", "needs axis C along"),
    ("[timing]", '[control]\nmodule = "trtkins"\n[timing]', "machine.control", "xyzac-trt-kins, xyzbc-trt-kins"),
    ("clamp = 0.5", "clamp = -0.5", "file.range", "timing.clamp"),
    ("jerk = 1800", "#", "file.missing-key", "axes.A.jerk"),
])
def test_faults(tmp_path, old, new, code, words):
    d = only(tmp_path, old, new)
    assert d.code == code and words in str(d), d


def test_faults_point_at_their_line(tmp_path):
    assert only(tmp_path, "home = 250", "home = 251").lines == line_of(GOOD, "home = 250")
    assert only(tmp_path, "(C1) t", "(C1)").lines == line_of(GOOD, "structure")


def test_missing_tables(tmp_path):
    z = GOOD[GOOD.index("[axes.Z]") : GOOD.index("[axes.A]")]
    assert only(tmp_path, z, "").code == "machine.axis-missing"
    assert {d.code for d in faults(tmp_path, text="")} == {"file.missing-key"}
    assert only(tmp_path, "", "", text='kinematics = "serial"').code == "file.missing-key"


def test_a_module_of_another_structure_is_refused(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text('base = "trunnion-bc"\n[control]\nmodule = "xyzac-trt-kins"\n')
    assert "xyzac-trt-kins is for w C' A'" in machines.load_checked(path)[1][0].message


def test_square_brackets_and_bare_spindle_of_the_code(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text('base = "mikron-ucp710"\n[kinematics]\nstructure = "[w C\' A\' b X Y Z (C) t]"\n')
    assert machines.load(path).axis_names == ("X", "Y", "Z", "A", "C")


def test_schema_is_json_and_names_every_kind():
    text = json.dumps(machines.schema())
    for kind in BUILT_IN:
        assert f'"{kind}"' in text
