"""Files that a user writes: each fault is a diagnostic with file, line, what was found and what to do."""

from pathlib import Path
from typing import Annotated, Literal

import pytest
from pydantic import Field

from machines.toml_lines import key_lines
from machines.user_file import ValueSource, load_toml, read_toml, values_of
from machines.user_model import UserModel, schema


class Axis(UserModel):
    travel: tuple[float, float]
    velocity: float = Field(gt=0)
    reach: tuple[float, float] | Literal["all"] = "all"


class File(UserModel):
    name: str
    axes: dict[str, Axis]
    pins: dict[str, float] = Field(default_factory=dict)
    steps: tuple[Axis, ...] = ()


GOOD = """\
name = "small"

[axes.X]
travel = [-10, 10.5]
velocity = 500
"""


def write(folder: Path, text: str, name: str = "m.toml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_what_a_caller_changes_is_changed_for_nobody_else(tmp_path: Path) -> None:
    path = write(tmp_path, GOOD)
    first, _ = load_toml(path, File)
    values_of(path)["axes"].clear()
    assert first is not None
    first.axes.clear()
    again, _ = load_toml(path, File)
    assert again is not None and list(again.axes) == ["X"] and list(values_of(path)["axes"]) == ["X"]


def only(folder: Path, text: str, **builtin: Path):
    model, diagnostics = load_toml(write(folder, text), File, builtin, "machine")
    assert model is None
    assert len(diagnostics) == 1, diagnostics
    return diagnostics[0]


def test_a_good_file_loads_without_diagnostics(tmp_path):
    model, diagnostics = load_toml(write(tmp_path, GOOD), File)
    assert diagnostics == []
    assert model == File(name="small", axes={"X": Axis(travel=(-10.0, 10.5), velocity=500.0)})


def test_windows_line_ends_and_byte_order_mark(tmp_path):
    path = tmp_path / "m.toml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert load_toml(path, File)[0] is not None


def test_syntax_error_has_its_line(tmp_path):
    d = only(tmp_path, GOOD + "velocity 3\n")
    assert (d.code, d.lines) == ("file.syntax", (6,))
    assert d.file.endswith("m.toml")


def test_unclosed_text_at_the_end_has_a_line(tmp_path):
    assert only(tmp_path, GOOD + 'name = """x').lines == (6,)


def test_unknown_key_names_the_nearest(tmp_path):
    d = only(tmp_path, GOOD + "velocty = 3\n")
    assert (d.code, d.lines) == ("file.unknown-key", (6,))
    assert "axes.X.velocty" in d.message and "'velocity'" in d.hint


def test_unknown_key_at_the_top_and_in_an_array(tmp_path):
    assert only(tmp_path, "pin = 1\n" + GOOD).hint == "did you mean 'pins'?"
    step = "[[steps]]\ntravel = [0, 1]\nvelocity = 1\n"
    d = only(tmp_path, GOOD + step + step + "trave = 3\n")
    assert (d.lines, d.hint) == ((12,), "did you mean 'travel'?")


def test_unknown_key_without_near_one_lists_all(tmp_path):
    assert only(tmp_path, GOOD + "q = 3\n").hint == "known: reach, travel, velocity"


def test_missing_key_points_at_its_table(tmp_path):
    d = only(tmp_path, GOOD.replace("velocity = 500\n", ""))
    assert (d.code, d.lines) == ("file.missing-key", (3,))
    assert "axes.X.velocity" in d.message


@pytest.mark.parametrize("value", ['"fast"', "true", "[1]", "2024-01-01"])
def test_wrong_type(tmp_path, value):
    d = only(tmp_path, GOOD.replace("500", value))
    assert (d.code, d.lines) == ("file.type", (5,))


@pytest.mark.parametrize("value", ["0", "-1.5", "inf", "nan"])
def test_out_of_range(tmp_path, value):
    d = only(tmp_path, GOOD.replace("500", value))
    assert (d.code, d.lines) == ("file.range", (5,))


def test_array_of_the_wrong_length(tmp_path):
    assert only(tmp_path, GOOD.replace("10.5", "1, 2")).lines == (4,)


def test_all_faults_are_reported_at_once(tmp_path):
    _, diagnostics = load_toml(write(tmp_path, GOOD.replace("500", "0").replace("name", "label")), File)
    assert sorted(d.code for d in diagnostics) == ["file.missing-key", "file.range", "file.unknown-key"]


def test_a_misspelt_key_is_not_missing_as_well(tmp_path):
    assert only(tmp_path, GOOD.replace("velocity", "velocty")).code == "file.unknown-key"


@pytest.mark.parametrize("value", ['"none"', "[1]", "[1, 2, 3]", "true", '["a", 2]'])
def test_a_union_gives_one_fault_that_names_the_choices(tmp_path, value):
    d = only(tmp_path, GOOD + f"reach = {value}\n")
    assert d.lines == (6,) and "axes.X.reach" in d.message


def test_no_such_name_suggests_one(tmp_path):
    model, (d,) = load_toml("mikrom", File, {"mikron": tmp_path, "mill": tmp_path}, "machine")
    assert model is None and d.code == "file.not-found"
    assert "machine" in d.message and "'mikron'" in d.hint


def test_a_folder_and_binary_are_refused(tmp_path):
    assert load_toml(tmp_path, File)[1][0].code == "file.unreadable"
    (tmp_path / "b.toml").write_bytes(b"name = '\xff'")
    assert load_toml(tmp_path / "b.toml", File)[1][0].code == "file.encoding"


def test_base_merges_tables_and_replaces_the_rest(tmp_path):
    base = write(tmp_path, GOOD + "[pins]\na = 1\nb = 2\n", "base.toml")
    own = write(tmp_path, 'base = "small"\nname = "mine"\n[axes.X]\ntravel = [0, 1]\n[pins]\nb = 3\n')
    model, diagnostics = load_toml(own, File, {"small": base})
    assert diagnostics == [] and model is not None
    assert model.name == "mine" and model.pins == {"a": 1, "b": 3}
    assert model.axes["X"] == Axis(travel=(0.0, 1.0), velocity=500.0)


def test_origin_of_each_value_through_a_base(tmp_path):
    base = write(tmp_path, GOOD, "base.toml")
    own = write(tmp_path, 'base = "small"\n[axes.X]\ntravel = [0, 1]\n')
    file, _ = read_toml(own, {"small": base})
    assert file is not None
    assert file.origin(("axes", "X", "travel")) == ValueSource(str(own), 3)
    assert file.origin(("axes", "X", "velocity")) == ValueSource(str(base), 5)


def test_a_fault_in_the_base_names_the_base_file(tmp_path):
    base = write(tmp_path, GOOD.replace("500", "0"), "base.toml")
    d = only(tmp_path, 'base = "base.toml"\n')
    assert (d.file, d.lines) == (str(base), (5,))


def test_a_fault_of_a_built_in_base_is_that_of_the_file_that_takes_it(tmp_path):
    base = write(tmp_path, GOOD.replace("500", "0"), "base.toml")
    write(tmp_path, 'base = "small"\n', "between.toml")
    for first, where in (("small", "m.toml"), ("between.toml", "between.toml")):
        d = only(tmp_path, f'# a file\nbase = "{first}"\n', small=base)
        assert (Path(d.file).name, d.lines) == (where, (2 if where == "m.toml" else 1,))
        assert d.message.endswith("(axes.X.velocity is that of base base, line 5)")


def test_base_may_be_a_file_next_to_this_one(tmp_path):
    write(tmp_path, GOOD, "base.toml")
    assert load_toml(write(tmp_path, 'base = "base.toml"\n'), File)[0] is not None


def test_base_cycle_unknown_base_and_wrong_type(tmp_path):
    d = only(tmp_path, 'base = "other"\n', other=write(tmp_path, 'base = "m.toml"\n', "other.toml"))
    assert (d.code, d.lines) == ("file.base-cycle", (1,))
    d = only(tmp_path, '\nbase = "smal"\n', small=write(tmp_path, GOOD, "b.toml"))
    assert (d.code, d.lines) == ("file.not-found", (2,))
    d = only(tmp_path, "\nbase = 3\n")
    assert (d.code, d.lines) == ("file.type", (2,))


def test_schema_knows_base_and_forbids_the_rest():
    s = schema("file", File)
    assert "base" in s["properties"] and s["additionalProperties"] is False


def test_key_lines_of_every_construct():
    text = (
        '# a = 1\na.b = """x\n[no]\n""" # c\n"q.r" = [ # note ]\n  {c = 1, d = "]}"},\n  {c = 2},\n]\n'
        "\n[t.'u v']\nk = '''\nz=1\n'''\nl = 3\n[[n]]\nk = 1\n[n.m]\nk = 2\n[[n]]\nk = 3\n"
    )
    lines = key_lines(text)
    assert lines["a", "b"] == 2
    assert lines["q.r",] == 5
    assert lines["q.r", 0, "d"] == 6
    assert lines["q.r", 1, "c"] == 7
    assert lines["t", "u v", "l"] == 14
    assert lines["n", 0, "m", "k"] == 18
    assert lines["n", 1, "k"] == 20
    assert ("no",) not in lines and ("z",) not in lines


# ---- what is allowed, in words -----------------------------------------------------------------------------

class Every(UserModel):
    number: float = 0.0
    whole: int = 0
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    table: dict[str, float] = Field(default_factory=dict)
    axis: Axis | None = None
    course: Literal["up", "down"] = "up"
    sign: Literal[1, -1] = 1
    code: str = Field(default="G54", pattern=r"^G5[4-9]$")
    """register of the control: G54 to G59"""
    system: bool | Annotated[str, Field(min_length=1)] = False
    some: tuple[float, ...] = Field(default=(), min_length=0, max_length=2)
    part: float = Field(default=1.0, gt=0.0, le=5.0)


@pytest.mark.parametrize(("text", "said", "hint"), [
    ('number = "5"', 'number = "5": allowed: a number', "without quotes"),
    ('number = "5,25"', "allowed: a number", "with a decimal point"),
    ('number = "five"', "allowed: a number", ""), ("number = true", "number = true: allowed: a number", ""),
    ("number = nan", "allowed: a finite number", ""),
    ("whole = 1.5", "whole = 1.5: allowed: a whole number", ""),
    ("place = 5", "place = 5: allowed: a list in square brackets", ""),
    ("place = [1, 2]", "place = [1, 2]: allowed: 3 elements", ""),
    ("place = [1, 2, 3,5]", "allowed: 3 elements or fewer", "decimal points"),
    ("some = [1.0, 2.5, 3.5]", "allowed: 2 elements or fewer", ""),
    ("table = 5", "table = 5: allowed: a table of keys and values", ""),
    ("axis = 5", "allowed: a table of keys and values", ""),
    ('course = "left"', "course = \"left\": allowed: 'up' or 'down'", ""), ("sign = 2", "sign = 2: allowed: 1 or -1", ""),
    ('code = "G60"', "allowed: text of the form", "register of the control: G54 to G59"),
    ("code = 54", "allowed: text in quotes", "in quotes"),
    ("system = 2", "system = 2: allowed: true or false, or text in quotes", ""),
    ('system = ""', "true or false, or text of length 1 or more", ""),
    ("part = 0", "part = 0: allowed: more than 0", ""), ("part = 5.5", "part = 5.5: allowed: 5 or less", "")])
def test_values_are_reported_with_what_is_allowed(text, said, hint, tmp_path):
    model, found = load_toml(write(tmp_path, text + "\n"), Every)
    assert model is None and len(found) == 1 and said in found[0].message and found[0].lines == (1,)
    assert hint in found[0].hint and bool(hint) == bool(found[0].hint)
    assert "should" not in found[0].message and "valid" not in found[0].message


@pytest.mark.parametrize(("text", "number"), [
    ("velocity = 6,5", "6,5"), ("velocity = -6,5   # fast", "-6,5"), ("velocity = 0,05\nreach = 3", "0,05")])
def test_a_decimal_comma_is_reported_with_its_line(text, number, tmp_path):
    d = only(tmp_path, GOOD.replace("velocity = 500", text))
    assert (d.code, d.lines, d.message) == ("file.syntax", (5,), f"{number} is not a number")
    assert d.hint == f"write a decimal point: {number.replace(',', '.')}"
    assert "number" not in only(tmp_path, GOOD + "velocity 3\n").message


@pytest.mark.parametrize(("value", "said"), [
    ("[-381.,0,0]", "-381.0"), (".5", "0.5"), ("-.5", "-0.5"), ("[1.0, +.5, 007, 2. ]", "+0.5, 7, 2.0"),
    ("05.25 # 3.", "5.25"), ("{ a = 1,5, b = 2 }", "1.5"), ('"1." .5', "0.5"), ("[\n0,\n10. ,\n0]", "10.0")])
def test_a_number_as_programs_have_it_is_said_as_toml_has_it(value, said, tmp_path):
    """`origin = [-381.,0,0]` was "Unclosed array"."""
    d = only(tmp_path, f"x = 1.0\nreach = {value}\n")
    assert d.code == "file.syntax" and d.hint.endswith(f" {said}") and d.lines == ((4,) if "\n" in value else (2,))


def test_a_table_and_its_key_on_one_line_are_parted_as_the_hint_says(tmp_path):
    d = only(tmp_path, "[axes.X] travel = [0, 1]\n")
    assert (d.code, d.lines) == ("file.syntax", (1,)) and "each [table] and each key on a line of its own" in d.hint
    assert "file.syntax" not in {d.code for d in load_toml(_written(tmp_path, "[axes.X]\ntravel = [0, 1]\n"), File)[1]}


def _written(folder, text):
    path = folder / "parted.toml"
    path.write_text(text)
    return path


def test_a_file_may_name_its_schema_for_editors(tmp_path: Path) -> None:
    one = tmp_path / "one.toml"
    one.write_text('#:schema file.json\n"$schema" = "file.json"\n')
    found, _ = read_toml(one)
    assert found is not None and found.values == {}
    one.write_text('"$schema" = 3\n')
    found, _ = read_toml(one)
    assert found is not None and found.values == {"$schema": 3}, "no name: an unknown key, as others"
