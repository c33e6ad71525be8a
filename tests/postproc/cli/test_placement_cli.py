"""postproc place: the file it writes, what it refuses, bodies, figures, chosen axes; its place converts and is proved."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import toolpaths
from postproc.base.options import Options
from postproc.cli.app import app
from postproc.orientation.plans.orient import orient
from postproc.pipeline.convert import convert
from postproc.placement.bodies import RESTS, adjacent
from postproc.placement.figure import margins_at
from postproc.placement.place import place
from postproc.placement.reasons import StandsIn
from postproc.placement.space import ANGLES
from postproc.placement.write import placed_text
from postproc.setup.bodies import BodiesModel
from postproc.setup.model import PartPlacement, Placement, load_setup
from tests.postproc.kit import SAMPLES, machine
from tests.postproc.placement.test_placement import passes, placed, setup_of

PART = SAMPLES / "test_part.cls"
MILL = SAMPLES / "placement" / "mill.setup.toml"


def run(*words: object, code: int = 0) -> str:
    result = CliRunner().invoke(app, ["place", *map(str, words)])
    assert result.exit_code == code, result.output
    return result.output


def small(folder: Path, text: str) -> Path:
    """A set-up file."""
    made = folder / "s.toml"
    made.write_text(text)
    return made


def cl_file(folder: Path) -> Path:
    """One short pass."""
    made = folder / "one.apt"
    made.write_text("\n".join(
        ["UNITS/MM", "CUTTER/16,8", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,60000", "RAPID", "GOTO/0,0,5", "RAPID",
         "GOTO/0,0,0", "GOTO/80,0,0", "RAPID", "GOTO/80,0,5", "FINI"]))
    return made


TEXT = """# our vise
description = "vise"    # keep me
[part]
origin = [0.0, 0.0, -10.0]    # from the corner
[placement]
turns = [0, 30]
[tools.1]
gauge_length = 100.0
"""


def test_the_written_file_loads_and_reproduces_the_seconds(tmp_path: Path) -> None:
    """S2 is S with [part] replaced, comments kept; the planned seconds are those that were said, and it is proved."""
    source, target = small(tmp_path, TEXT), tmp_path / "s2.toml"
    text = run(cl_file(tmp_path), "-m", "mill-3axis", "--setup", source, "-o", target, "--json",
               tmp_path / "f.json")
    assert "planned time saved: " in text
    said = json.loads((tmp_path / "f.json").read_text())
    written = target.read_text()
    for comment in ("# our vise", "# keep me", "# from the corner"):
        assert comment in written
    before, after = tomllib.loads(TEXT), tomllib.loads(written)
    assert after["part"]["x_axis"] == pytest.approx([np.cos(np.pi / 6), 0.5, 0.0])
    assert {k: v for k, v in after.items() if k != "part"} == {k: v for k, v in before.items() if k != "part"}
    setup, found = load_setup(target)
    assert setup is not None and not found
    path, _ = toolpaths.read(cl_file(tmp_path))
    choice, _ = orient(path, machine("mill-3axis"), setup, Options())
    assert choice is not None
    assert choice.plans["keep"].seconds == pytest.approx(said["best"]["time_s"], rel=1e-7)
    result = convert(path, machine("mill-3axis"), setup=setup, options=Options(feed="planned"))
    assert result.ok and result.motion is not None
    assert result.motion.seconds == pytest.approx(said["best"]["cutting_s"], rel=2e-3)
    assert said["best"]["time_s"] < said["now"]["time_s"]


def test_a_base_file_is_still_found(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    (tmp_path / "shop.toml").write_text("[tools.1]\ngauge_length = 77.0\n")
    source = small(tmp_path, 'base = "shop.toml"\n[placement]\nx = [0.0, 10.0]\n')
    target = tmp_path / "other" / "s2.toml"
    target.write_text(placed_text(source, target, PartPlacement(origin=(1.0, 2.0, 3.0))))
    setup, found = load_setup(target)
    assert setup is not None, found
    assert setup.tools["1"].gauge_length == 77.0
    assert setup.part.origin == (1.0, 2.0, 3.0)


def test_meshes_are_still_found(tmp_path: Path) -> None:
    """Written into another folder, every file is named from there; absolute names stay."""
    source = small(tmp_path, TEXT + '''holder_mesh = "meshes/holder.stl"
[bodies]
part = "part.stl"   # finished
table = {file = "table.stl"}
[[bodies.fixtures]]
name = "vise"
file = "/meshes/vise.stl"
''')
    target = tmp_path / "jobs" / "one" / "s2.toml"
    made = tomllib.loads(placed_text(source, target, PartPlacement()))
    assert made["bodies"]["part"] == "../../part.stl"
    assert made["bodies"]["table"]["file"] == "../../table.stl"
    assert made["bodies"]["fixtures"][0]["file"] == "/meshes/vise.stl"
    assert made["tools"]["1"]["holder_mesh"] == "../../meshes/holder.stl"
    assert tomllib.loads(placed_text(source, tmp_path / "s2.toml", PartPlacement()))["bodies"]["part"] == "part.stl"


def test_the_input_is_never_replaced(tmp_path: Path) -> None:
    source = small(tmp_path, TEXT)
    run(cl_file(tmp_path), "-m", "mill-3axis", "--setup", source, "-o", source, code=2)
    assert source.read_text() == TEXT


def test_without_limits_nothing_is_written(tmp_path: Path) -> None:
    source, target = small(tmp_path, "[tools.1]\ngauge_length = 100.0\n"), tmp_path / "s2.toml"
    text = run(cl_file(tmp_path), "-m", "mill-3axis", "--setup", source, "-o", target, code=1)
    assert "place.limits" in text and "[placement] x = [-100, 100]" in text
    assert not target.exists()


@pytest.mark.parametrize(("line", "says"), [
    ("x = [10.0, -10.0]", "the first must not be above the second"),
    ("turn = [0.0, 400.0]", "a full turn is 360 degrees"),
    ("turn = [0.0, 90.0]\nturns = [0.0]", "give one of them"),
    ("step = 5.0", "step needs x or y"),
    ("xx = [0.0, 1.0]", "did you mean 'x'"),
    ("x = 5.0", "placement.x"),
])
def test_limits_that_make_no_sense(line: str, says: str, tmp_path: Path) -> None:
    source = small(tmp_path, f"[placement]\n{line}\n")
    text = run(cl_file(tmp_path), "-m", "mill-3axis", "--setup", source, "-o", tmp_path / "s2.toml", code=1)
    assert says in text
    assert f"{source}:" in text


def test_figure(tmp_path: Path) -> None:
    """The same bytes twice; what is no picture is refused."""
    source, cl = small(tmp_path, TEXT.replace("turns = [0, 30]", "x = [380, 480]\ny = [0, 100]")), cl_file(tmp_path)
    images = []
    for name in ("a.svg", "b.svg", "a.png"):
        run(cl, "-m", "mill-3axis", "--setup", source, "-o", tmp_path / "s2.toml", "--figure",
            tmp_path / name)
        images.append((tmp_path / name).read_bytes())
    assert images[0] == images[1]
    assert [image[:4] for image in images] == [b"<?xm", b"<?xm", b"\x89PNG"]
    run(cl, "-m", "mill-3axis", "--setup", source, "-o", tmp_path / "s2.toml", "--figure",
        tmp_path / "a.pdf", code=2)


def test_the_ground_of_the_figure_is_travel() -> None:
    """X ends at 500; the passes are 80 mm long."""
    choice = placed(passes((1.0, 0.0)), machine("mill-3axis"), setup_of(x=(380.0, 480.0), y=(0.0, 100.0)))
    places = np.tile(choice.best.place, (3, 1))
    places[:, 0] = 400.0, 420.0, 440.0
    assert margins_at(choice, places) == pytest.approx([20.0, 0.0, -20.0], abs=1e-6)


def box(low: tuple[float, ...], high: tuple[float, ...], **more: object) -> dict[str, object]:
    return {"box": {"low": low, "high": high}, **more}


def test_bodies_that_stand_are_kept_clear_of() -> None:
    """A post stands where the part would: it is named, and the part goes next to it; resting on the table is no touch."""
    bodies = BodiesModel.model_validate({
        "table": box((-400.0, -300.0, -120.0), (400.0, 300.0, -50.0)),
        "fixtures": [box((0.0, -10.0, -50.0), (80.0, 20.0, -5.0), name="blank", frame="part"),
                     box((150.0, -80.0, -50.0), (170.0, 80.0, 40.0), name="post")]})
    tool = setup_of().tools["1"].model_copy(update={"flute_length": 40.0})
    setup = setup_of((100.0, 0.0, 0.0), x=(90.0, 300.0)).model_copy(update={"bodies": bodies, "tools": {"1": tool}})
    choice = placed(passes((1.0, 0.0)), machine("mill-3axis"), setup)
    assert choice.found.now.refused == StandsIn("fixture blank", "fixture post")
    assert choice.best.place[0] >= 170.0 - RESTS
    assert any("post" in str(one.refused) for one in choice.known)
    still, found = adjacent(choice.work, "")
    assert still is not None, found
    for z, free in ((0.0, True), (-2 * RESTS, False), (5.0, True)):
        assert (not still.against(Placement(np.eye(3), np.array([250.0, 0.0, z])))) == free
    inside = Placement(np.eye(3), np.array([250.0, 0.0, -60.0]))
    assert str(still.against(inside)) == "fixture blank stands in the table"


def test_tools_keep_clear_of_what_stands() -> None:
    """A clamp higher than the cut next to the part: the cutter must not come near, although the part itself stands free."""
    clamp = box((85.0, -40.0, -50.0), (95.0, 40.0, 30.0), name="clamp")
    bodies = BodiesModel.model_validate({"fixtures": [clamp], "clearance": 2.0})
    tool = setup_of().tools["1"].model_copy(update={"flute_length": 40.0})
    setup = setup_of((0.0, 0.0, 0.0), x=(-60.0, 0.0)).model_copy(update={"bodies": bodies, "tools": {"1": tool}})
    choice = placed(passes((1.0, 0.0)), machine("mill-3axis"), setup)
    assert "cutter of T1" in (refused := str(choice.found.now.refused)) and "clamp" in refused
    assert choice.best.place[0] <= 85.0 - 80.0 - 8.0 - 2.0 + 1e-3


def test_axes_chosen_again_at_each_place() -> None:
    """--orient auto: the seconds are those of orient at the chosen place, and no place is worse than where it stands."""
    path, m = passes((1.0, 0.0), 1), machine("mikron-ucp710")
    setup, options = setup_of((0.0, 0.0, 0.0), turns=[0.0, 20.0]), Options(orient="auto", max_tilt=20.0)
    choice, found = place(path, m, setup, options)
    assert choice is not None, found
    chosen, _ = orient(path, m, setup.model_copy(update={"part": choice.part}), options)
    assert chosen is not None
    assert choice.best.seconds == pytest.approx(chosen.plans["auto"].seconds, rel=1e-9)
    assert choice.best.seconds <= choice.found.now.seconds * 1.0002
    kept = placed(path, m, setup)
    assert choice.best.seconds <= kept.best.seconds * (1.0 + 1e-9)


def test_the_sample(tmp_path: Path) -> None:
    """The sample's set-up on the mill gains what turning the box by 45 degrees gives passes along y: here the first 3."""
    lines, first = PART.read_text().splitlines(), tmp_path / "three.cls"
    first.write_text("\n".join([*lines[:217], lines[-1], ""]))
    text = run(first, "-m", "mill-3axis", "--setup", MILL, "-o", tmp_path / "s2.toml", "--json",
               tmp_path / "f.json")
    said = json.loads((tmp_path / "f.json").read_text())
    assert said["best"]["cutting_s"] / said["now"]["cutting_s"] == pytest.approx(2 ** (-1 / 6), abs=0.01)
    assert said["best"]["turn_deg"] % 90.0 == pytest.approx(45.0, abs=2.0)
    assert said["best"]["travel_margin"]["X"] > 0.0
    assert "margin of travel" in text


def test_a_place_that_cannot_be_converted_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """The proof has the last word: what it refuses is reported and the next place taken."""
    from postproc.pipeline import convert as pipeline
    from toolpaths.diagnostics import error

    real, asked = pipeline.convert, []

    def convert_but_first(*args: object, **kwargs: object) -> object:
        result = real(*args, **kwargs)
        asked.append(args[3])
        return result.with_found([error("test.no", "not there")]) if len(asked) == 1 else result

    monkeypatch.setattr(pipeline, "convert", convert_but_first)
    choice, found = place(passes((1.0, 0.0)), machine("mill-3axis"),
                          setup_of(x=(-50.0, 50.0), turns=[0.0, 30.0]))
    assert choice is not None and 2 <= len(asked) <= 4
    assert any(d.code == "place.passed_over" and "not there" in d.message for d in found)
    assert choice.part in [one.part for one in asked[1:]] and choice.part != asked[0].part
    assert choice.best.place[ANGLES] in (0.0, 30.0 * np.pi / 180.0)


def test_a_lift_off_the_table_is_reported(tmp_path: Path) -> None:
    """Where z is free and the part is out of travel below, it stands higher; where z is not, nothing is said."""
    path = passes((1.0, 0.0))
    m = machine("mill-3axis")
    for z, noted in (((-440.0, -200.0), True), (None, False)):
        limits: dict[str, object] = {"x": (-50.0, 50.0)} | ({} if z is None else {"z": z})
        choice, found = place(path, m, setup_of((0.0, 0.0, -440.0 if noted else -200.0), **limits), Options())
        assert choice is not None, [str(d) for d in found]
        lifts = [d for d in found if d.code == "place.lifted"]
        assert bool(lifts) == noted
        if noted:
            rise = choice.best.place[2] + 440.0
            assert rise > 0.0 and f"stands {rise:.3f} mm higher than [part] has it: it needs a support" in lifts[0].message
