"""What is reported of a choice of orientations: reaches, rejected candidates, shares, JSON, text, pictures, the command
line."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import toolpaths
from postproc.base.options import Options, Orientation
from postproc.cli.app import app
from postproc.orientation.candidates import reaches, rejections
from postproc.orientation.candidates.candidate_times import turned
from postproc.orientation.figures import free_rotary, sheet
from postproc.orientation.plans import shares
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.orient import orient
from postproc.orientation.plans.plans import OrientationPlan
from postproc.orientation.report import figures_of_choice as report
from postproc.orientation.report import text
from postproc.setup.model import SetupFile
from tests.postproc.kit import SAMPLES, machine
from tests.postproc.orientation.part_choice import part
from toolpaths import drawing

BALL = ["UNITS/MM", "CUTTER/16,8", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,30000", "MULTAX"]


def written(passes: int, cutter: str = "CUTTER/16,8") -> str:
    """Level passes of 80 mm along x next to each other, rapids between."""
    lines = [cutter if line.startswith("CUTTER") else line for line in BALL]
    for y in range(passes):
        lines += ["RAPID", f"GOTO/0,{y},5,0,0,1", "RAPID", f"GOTO/0,{y},0,0,0,1", f"GOTO/80,{y},0,0,0,1", "RAPID",
                  f"GOTO/80,{y},5,0,0,1"]
    return "\n".join([*lines, "FINI"]) + "\n"


@cache
def of_text(content: str, name: str = "passes.apt") -> OrientationChoice:
    path, found = toolpaths.read_bytes(content.encode(), file=name)
    assert not toolpaths.diagnostics.has_errors(found), found
    choice, found = orient(path, machine("mikron-ucp710"), SetupFile(), Options())
    assert choice is not None, found
    return choice


def repeated(plan: OrientationPlan) -> OrientationPlan:
    links = np.append(np.tile(plan.links[:-1], 16), plan.links[-1])
    cuts, rapids = np.tile(plan.cuts, 16), np.tile(plan.rapids, 16)
    return replace(plan, picked=16 * plan.picked, cuts=cuts, rapids=rapids, links=links,
                   seconds=float(cuts.sum() + rapids.sum() + links.sum()))


def many() -> OrientationChoice:
    """The part sixteen times."""
    one = part()
    plans = {name: repeated(plan) for name, plan in one.plans.items()}
    return replace(one, tried=16 * one.tried, plans=plans, paper=repeated(one.paper))


def run(*arguments: object, code: int = 0, command: str = "orient") -> Result:
    result = CliRunner().invoke(app, [command, *map(str, arguments), "-m", "mikron-ucp710"])
    assert result.exit_code == code, result.output
    return result


@pytest.fixture
def as_laid_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Panels stay where the grid puts them: fitting them moves no text."""
    monkeypatch.setattr(drawing, "_settle", lambda sheet: sheet.set_layout_engine("none"))


def texts(choice: OrientationChoice, plan: Orientation, passes: list[int]) -> list[str]:
    """What a sheet says; it is filled and not drawn."""
    from matplotlib.figure import Figure
    from matplotlib.text import Text

    found: list[str] = []

    def filled(size: tuple[float, float], title: str, fill: Callable[[object], None], ending: str) -> bytes:
        figure = Figure(figsize=size)
        fill(figure)
        found.extend(one.get_text() for one in figure.findobj(Text))
        return b""

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sheet, "image", filled)
        sheet.draw(choice, plan, passes, ".svg")
    return found


def test_reaches_of_a_straight_pass() -> None:
    """Along x with C at 0 every order ends at X's own limit; the jerk's seconds are those of the plan."""
    one = of_text(written(2)).tried[0].own
    found = {each.order: each for each in reaches.reaches(one)}
    limits = one.machine.limits
    assert [(each.order, each.axis) for each in found.values()] == [("velocity", "X"), ("acceleration", "X"), ("jerk", "X")]
    assert [each.rate for each in found.values()] == pytest.approx(
        [limits.velocity[0], limits.acceleration[0], limits.jerk[0]])
    assert found["velocity"].seconds == pytest.approx(80.0 / limits.velocity[0])
    assert found["acceleration"].seconds == pytest.approx(2.0 * math.sqrt(80.0 / limits.acceleration[0]))
    slowest = reaches.binding(tuple(found.values()))
    assert slowest is found["jerk"] and one.seconds == pytest.approx(slowest.seconds, rel=2e-3)


def test_reach_of_an_axis_is_that_of_its_pass() -> None:
    """The ground of the map at axes that are turned to."""
    own = part().tried[3].own
    axes = np.array([[0.3, 0.2, 1.0], [0.4, -0.57, 0.71], [-0.1, 0.6, 0.8]])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    slowest = [reaches.binding(reaches.reaches(turned(own.one, axis, own.machine))) for axis in axes]
    assert reaches.least_under(own, axes) == pytest.approx([one.seconds for one in slowest if one is not None], rel=1e-9)


def test_every_rejected_candidate_is_counted_once() -> None:
    for choice in (part(), of_text(written(2))):
        for tried in choice.tried:
            noted = rejections.grouped([tried])
            assert sum(noted.values()) == len([lost for lost in tried.rejected if lost.made is not tried.own])
            assert tried.pruned - 1 <= noted.get("bound", 0) <= tried.pruned, "all but one next to the best"
            after = rejections.runner_up(tried)
            assert after is not None and after.seconds >= tried.best.seconds
            assert after.seconds == min(lost.made.seconds for lost in tried.rejected if np.isfinite(lost.made.seconds))
        assert sum(rejections.grouped(choice.tried).values()) == sum(sum(rejections.grouped([one]).values())
                                                                     for one in choice.tried)


def test_no_rejected_candidate_is_reported_as_faster_than_the_best_or_where_it_stands() -> None:
    """Candidates are ranked on knots that all share, the best is planned on its own: both times are reported on one
    scale."""
    for tried in (*part().tried, *of_text(written(2)).tried, *of_text(written(2, "CUTTER/16,0")).tried):
        for lost in tried.rejected:
            if lost.kind == "slower":
                assert lost.made.seconds >= tried.best.seconds
                planned = f"takes {lost.made.seconds:.4f} s"
                about = planned if lost.made is tried.own else planned.replace("takes", "takes about")
                assert str(lost.why) in (planned, about)
                assert lost.made is tried.own or not lost.made.same(tried.best.axis, tried.best.held, np.radians(0.1))


def test_seconds_of_a_plan_add_up() -> None:
    choice = part()
    for plan in (*choice.plans.values(), choice.paper):
        parts = shares.shares_of(plan)
        assert parts.cutting + parts.turning + parts.other == pytest.approx(plan.seconds)
        angles = [(0.0, 0.0), *(tuple(made.rotary().values()) for made in plan.picked), (0.0, 0.0)]
        apart = [max(abs(x - y) for x, y in zip(a, b, strict=True)) > 0.01 for a, b in pairwise(angles)]
        assert parts.turns == sum(apart) and (parts.turning > 0.0) == any(apart)
        assert parts.other > 0.0
    clamped = shares.shares_of(choice.plans["per-pass"])
    timing = choice.work.machine.timing
    assert clamped.turning > clamped.turns * (timing.clamp + timing.unclamp) > 0.0


def test_a_tool_change_turns_home_and_back() -> None:
    """Two tools, one leaning axis: out, home and out again for the other tool, home."""
    one = written(1).replace(",0,0,1", ",0,0.6,0.8")
    both = one.replace("FINI\n", "LOADTL/2\nCUTTER/16,8\n" + one.split("MULTAX\n")[1])
    plan = of_text(both).plans["keep"]
    parts = shares.shares_of(plan)
    assert len(plan.picked) == 2 and parts.turns == 3
    assert parts.turning == pytest.approx(plan.links.sum()) and parts.other == pytest.approx(plan.rapids.sum())


def test_json_has_the_keys_that_others_read() -> None:
    values = report.as_dict(part(), "per-pass")
    json.dumps(values, allow_nan=False)
    assert {"machine", "passes", "plans"} <= set(values)
    for one in values["passes"]:
        assert {"pass", "orientation_deg", "time_s", "reference_time_s", "limiting_axis", "rejected"} <= set(one)
        assert one["gain_percent"] == pytest.approx(100.0 * (1.0 - one["time_s"] / one["reference_time_s"]))
        assert sum(one["lost"].values()) >= one["planned"] + one["pruned"] - 2
        assert one["reach"]["own"]["slowest"] == "jerk" and one["next_best"]["time_s"] >= one["best"]["time_s"]
        assert {it["kind"] for it in one["rejected"]} <= set(rejections.KINDS)
    assert {"keep", "per_pass", "whole_part", "auto"} <= set(values["plans"])
    for plan in values["plans"].values():
        assert plan["time_s"] == pytest.approx(plan["cutting_s"] + plan["turning_s"] + plan["other_s"])
    assert values["plan"] == "per-pass" and values["passes"][4]["turned_deg"] == pytest.approx(45.0, abs=2.0)


def test_text_says_why_others_lost() -> None:
    noted = text.as_text(part(), "per-pass", [4])
    table = noted.splitlines()
    assert len([line for line in table if line.split()[:1] and line.split()[0].isdigit()]) == 8  # 7 passes, "N orientations"
    assert "limits" in noted and "slower" in noted and "bound" in noted
    assert "slowest alone: jerk" in noted and "feed 1000 mm/s" in noted
    assert "lost, slower: A45.000 C" in noted and "takes about 0.61" in noted
    assert any(line.startswith("vertex-aligned per pass") for line in table)


def test_text_of_many_passes_is_short_and_shows_those_that_gain() -> None:
    noted = text.as_text(many(), "per-pass")
    assert f"and {16 * 7 - text.SHOWN} passes that gain less" in noted and len(noted.splitlines()) < text.SHOWN + 15
    saved = [one.own.seconds - one.best.seconds for one in part().tried]
    shown = [row.split()[0] for row in noted.splitlines()[2:] if re.match(r" *\d+ +\d+ ", row)]
    assert shown.count(str(np.argmax(saved))) == 16 and shown.count(str(np.argmin(saved))) == 0


def test_fixed_passes_say_why() -> None:
    turning = ["RAPID", "GOTO/0,0,9,0,0,1", "GOTO/0,0,0,0,0,1", "GOTO/80,0,0,0,0.6,0.8", "RAPID", "GOTO/80,0,9,0,0.6,0.8"]
    choice = of_text("\n".join([*BALL, *turning, "FINI"]))
    noted = text.as_text(choice, "auto", [0])
    assert noted.count("axis kept: the tool axis turns within the pass") == 2
    assert report.as_dict(choice)["passes"][0]["paper"] is None
    assert sheet.most_gaining(choice) == []
    assert any("axis kept, the tool axis turns" in one for one in texts(choice, "auto", [0]))


@pytest.mark.usefixtures("as_laid_out")
def test_held_angles_are_reported_and_drawn() -> None:
    """A flat cutter keeps its axis; the table turns under it."""
    choice = of_text(written(2, "CUTTER/16,0"))
    tried = choice.tried[0]
    assert abs(abs(tried.best.rotary()["C"]) % 90.0 - 45.0) < 0.5
    ball = part().tried[0]
    assert free_rotary.is_held(tried) and not free_rotary.is_held(ball)
    assert free_rotary.is_held(replace(ball, best=replace(ball.best, held=0.3)))
    noted = text.as_text(choice, "per-pass", [0])
    assert noted.count("axis kept: the cutter is not a ball") == 3 and "; axis kept" in noted
    one = report.as_dict(choice, "per-pass")["passes"][0]
    assert abs(abs(one["held_deg"]) % 90.0 - 45.0) < 0.5 and one["turned_deg"] == 0.0
    angle = np.array([0.3, tried.best.held])
    slowest = [reaches.binding(reaches.reaches(turned(tried.own.one, tried.own.axis, tried.own.machine, held=float(x))))
               for x in angle]
    assert reaches.least_held(tried.best, 4, angle) == pytest.approx([it.seconds for it in slowest if it is not None])
    assert sheet.most_gaining(choice) in ([0], [1])
    assert b"angles at which C is held" in sheet.draw(choice, "per-pass", [0], ".svg")


def test_axes_that_cannot_be_run_are_reported() -> None:
    """The CL's axis needs A at 127 degrees, travel ends at 120: no seconds before, none saved, and no figure fails."""
    lean = written(2).replace(",0,0,1", ",0,0.79863551,-0.601815023")
    choice = of_text(lean)
    assert not math.isfinite(choice.tried[0].own.seconds) and sheet.most_gaining(choice) in ([0], [1])
    values = report.as_dict(choice)
    json.dumps(values, allow_nan=False)
    reasons = {lost["kind"]: lost["reason"] for lost in values["passes"][0]["rejected"]}
    assert reasons["travel"].startswith("travel: axis A at 1")
    assert values["passes"][0]["reference_time_s"] is None and values["passes"][0]["gain_percent"] is None
    assert values["plans"]["keep"]["time_s"] is None and values["plans"]["auto"]["time_s"] > 0.0
    noted = text.as_text(choice, "auto", [1])
    assert "travel: axis A at 127.000 degrees" in noted and re.search(r"(?m)^keep +-", noted)
    drawn = texts(choice, "auto", [1])
    assert "cannot be run" in drawn and any("the CL file's own cannot be run" in one for one in drawn)
    assert report.slower(choice, "auto") == [] and text.header(choice, "auto")[1].endswith("of the CL file - s")


@pytest.mark.usefixtures("as_laid_out")
def test_pictures_repeat_and_show_names_as_they_stand() -> None:
    drawn = [sheet.draw(of_text(written(1), "a$x$ <b> & c\n.apt"), "auto", [], ".svg") for _ in range(2)]
    assert drawn[0] == drawn[1]
    whole = ElementTree.fromstring(drawn[0])
    assert whole.tag.endswith("svg") and b"<dc:date>" not in drawn[0]
    assert b"a$x$ &lt;b&gt; &amp; c\xef\xbf\xbd.apt" in drawn[0]


@pytest.mark.usefixtures("as_laid_out")
def test_many_passes_are_one_summary_and_one_pass_in_full(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = []
    kept: Callable[..., bytes] = sheet.image
    monkeypatch.setattr(sheet, "image", lambda size, *rest: (sizes.append(size), kept(size, *rest))[1])
    drawn = sheet.draw(many(), "auto", [], ".svg")
    assert sizes == [(sheet.WIDTH, pytest.approx(sum(sheet.PART + sheet.PASS) + 0.4))] and len(drawn) < 600_000


def test_command_writes_figure_and_json(tmp_path: Path) -> None:
    file, figure, out = tmp_path / "p.apt", tmp_path / "p.png", tmp_path / "p.json"
    file.write_text(written(2))
    result = run(file, "--figure", figure, "--json", out, "--pass", 1, "--orient", "per-pass", "--error-model",
                 SAMPLES / "errors" / "mikron-ucp710.toml")
    assert figure.read_bytes().startswith(b"\x89PNG") and "pass 1, line 18" in result.output
    values = json.loads(out.read_text())
    assert values["plan"] == "per-pass"
    assert "orient.error_model" in [d["code"] for d in values["diagnostics"]]


def test_command_refuses_what_it_cannot_show(tmp_path: Path) -> None:
    file = tmp_path / "p.apt"
    file.write_text(written(2))
    wrong = run(file, "--pass", 7, "--figure", tmp_path / "p.svg", code=1).output
    assert "there is no pass 7" in wrong and "numbered 0 to 1" in wrong and not (tmp_path / "p.svg").exists()
    assert "not a .png or .svg" in run(file, "--figure", tmp_path / "p.pdf", code=2).output
    assert "at most 6" in run(file, *(word for k in range(7) for word in ("--pass", k)), code=2).output
    assert "choose from" in run(file, "--orient", "best", code=2).output
    both = tmp_path / "p.svg"
    assert "would replace" in run(file, "--figure", both, "--json", both, code=2).output
    missing = run(file, "--error-model", tmp_path / "none.toml", code=1).output
    assert "none.toml" in missing and "Traceback" not in missing


def test_converted_program_says_which_axes_were_chosen(tmp_path: Path) -> None:
    """Head and JSON: each pass with its orientation and seconds; what takes longer is reported."""
    file, out, figures = tmp_path / "p.apt", tmp_path / "p.ngc", tmp_path / "p.json"
    file.write_text(written(3))
    result = run(file, "-c", "linuxcnc", "-o", out, "--orient", "per-pass", "--json", figures, command="convert")
    noted = json.loads(figures.read_text())["orientation"]
    assert noted["plan"] == "per-pass" and noted["turned"] == 3
    assert [one["pass"] for one in noted["passes"]] == [0, 1, 2]
    assert all(one["time_s"] < one["reference_time_s"] for one in noted["passes"])
    angles = noted["passes"][0]["orientation_deg"]
    head = [line for line in out.read_text().splitlines() if line.startswith("(pass ")]
    assert head[0].startswith(f"(pass 0 to 2: A{angles['A']:.3f} C{angles['C']:.3f}, cuts ")
    assert "3 of 3 passes turned" in result.output
    assert ("orient.slower" in result.output) == (noted["time_s"] > noted["reference_time_s"])


def test_what_takes_longer_is_reported() -> None:
    slow, quick = report.slower(part(), "per-pass"), report.slower(part(), "auto")
    assert [d.code for d in slow] == ["orient.slower"] and not quick
    assert f"{part().plans['per-pass'].seconds:.3f} s" in slow[0].message


def test_kept_axes_are_no_orientation(tmp_path: Path) -> None:
    file, figures = tmp_path / "p.apt", tmp_path / "p.json"
    file.write_text(written(1))
    run(file, "-c", "linuxcnc", "-o", tmp_path / "p.ngc", "--json", figures, command="convert")
    assert json.loads(figures.read_text())["orientation"] is None


def test_trace_shows_the_point_of_the_file_and_its_pass(tmp_path: Path) -> None:
    file, figures = tmp_path / "p.apt", tmp_path / "p.json"
    file.write_text(written(3))
    result = run(file, "--line", 18, "-c", "linuxcnc", "--orient", "per-pass", "--json", figures, command="trace")
    point = json.loads(figures.read_text())["points"][0]
    was, now = point["orientation"], point["toolpath"]
    assert was["tip_mm"] == [80.0, 1.0, 0.0] and was["axis"] == [0.0, 0.0, 1.0] and was["pass"] == 1
    centre = [np.array(at["tip_mm"]) + 8.0 * np.array(at["axis"]) for at in (was, now)]
    assert centre[0] == pytest.approx(centre[1], abs=1e-7) and now["axis"] != was["axis"]
    assert "CL file      tip (80.000000, 1.000000, 0.000000)" in result.output


def test_head_of_many_turns_is_short() -> None:
    lines = text.header(many(), "per-pass")
    assert len(lines) == text.RUNS + 3 and lines[-1].startswith("and ") and lines[-1].endswith("more turns")


def test_nothing_chosen_is_faster_than_the_best_alone() -> None:
    """The best is that of all that was planned in full, in whatever plan: here passes of a surface where ranks are close."""
    lines = (SAMPLES / "bicubic.cls").read_text().splitlines()
    starts = [k for k, line in enumerate(lines) if line == "RAPID"][2::3]
    few = [line for k in range(0, len(starts) - 1, 20) for line in lines[starts[k]:starts[k + 1]]]
    choice = of_text("\n".join([*lines[:starts[0]], *few, "FINI"]), "bicubic.cls")
    assert len(choice.tried) >= 4
    for k, tried in enumerate(choice.tried):
        every = [plan.picked[k].seconds for plan in [*choice.plans.values(), choice.paper]]
        assert tried.best.seconds <= min(every)
        assert not any(lost.made.same(tried.best.axis, tried.best.held) for lost in tried.rejected
                       if lost.made is not tried.own)


def narrow(path: str, degrees: float = 30.0) -> OrientationChoice:
    """On a table that tilts less far than a vertex wants."""
    m = machine("mikron-ucp710")
    upper = np.where([name == "A" for name in m.axis_names], np.radians(degrees), m.limits.upper)
    read, _ = toolpaths.read_bytes(path.encode(), file="passes.apt")
    choice, found = orient(read, replace(m, limits=replace(m.limits, upper=upper)), SetupFile(), Options())
    assert choice is not None, found
    return choice


def test_why_the_paper_chooses_nothing_is_reported() -> None:
    choice = narrow(written(2))
    assert all(one.aimed is None for one in choice.tried)
    assert {str(one.unaimed) for one in choice.tried} == {
        "of the axes that aim a vertex 4 are outside the allowed angles, 4 are outside travel"}
    noted = text.as_text(choice, "auto", [1])
    assert "\n  paper: none, of the axes that aim a vertex 4 are" in noted
    assert ("\nvertex-aligned per pass keeps the CL axis in 2 of 2 passes: "
            "of the axes that aim a vertex 4 are outside") in noted
    assert report.as_dict(choice)["passes"][0]["paper_missing"].endswith("4 are outside travel")
    assert {one["paper_missing"] for one in report.as_dict(part())["passes"]} == {""}
    assert "vertex-aligned per pass keeps" not in text.as_text(part())


def test_a_steep_way_has_no_vertex() -> None:
    lines = [*BALL, "RAPID", "GOTO/0,0,80,0.6,0,0.8", "RAPID", "GOTO/0,0,60,0.6,0,0.8", "GOTO/5,0,0,0.6,0,0.8", "RAPID",
             "GOTO/0,0,80,0.6,0,0.8", "FINI"]
    (one,) = of_text("\n".join(lines), "steep.apt").tried
    assert one.aimed is None and str(one.unaimed) == "no vertex can be turned into the mean direction"


@pytest.mark.parametrize(("plan", "cutter", "said"), [
    ("per-pass", "CUTTER/16,8", "with these axes, its tips moved to keep the ball's contact"),
    ("per-pass", "CUTTER/16,1", "as it is, rotary axes held that the tool axis leaves free"),
    ("keep", "CUTTER/16,8", "as it is: no tool axis was turned")])
def test_the_head_says_what_was_moved(plan: Orientation, cutter: str, said: str) -> None:
    """A flat cutter is held and not turned."""
    lines = text.header(of_text(written(2, cutter)), plan)
    assert lines[0] == f"proved against the CL file {said}"
