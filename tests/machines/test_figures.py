"""Where figures of machine files come from: a document, or assumed; what a file states itself is its own."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.loader import builtin
from machines.machine import Machine
from machines.plausible import implausible
from tests.machine_page import PAGE, page

FIGURES = ("travel", "velocity", "acceleration", "jerk")
TIMES = ("tool_change", "clamp", "unclamp")
DOCUMENTED = 30
"""machines with travel, speed and range of every axis from a document, that the catalogue holds at least"""


def unsaid(machine: Machine) -> list[str]:
    """Figures of a file that are neither assumed nor from a document."""
    values = tomllib.loads(builtin()[machine.name].read_text("utf-8"))
    real = machine.name in machines.catalogued()
    said = set(machine.figures)
    keys = [f"{axis}.{key}" for axis in values["axes"] for key in (*FIGURES, *(("home",) if real else ()))]
    keys += [f"timing.{key}" for key in TIMES]
    if real:
        turns = [axis for axis in values["axes"] if axis in "ABC"]
        keys += [f"{axis}.{key}" for axis in turns for key in ("point", "direction")]
    return [key for key in keys if key not in said]


@pytest.mark.parametrize("name", [*machines.names(), *machines.catalogued()])
def test_every_figure_is_sourced_or_assumed_and_plausible(name: str) -> None:
    machine = machines.load(name)
    assert unsaid(machine) == []
    assert list(implausible(machine)) == []


def test_a_workspace_is_held_against_home_and_travel() -> None:
    """Warned of: it was found where a file was converted, or a proof of the workspace asked for."""
    good = machines.load("delta-star")
    high = good.limits.upper.copy()
    high[1] = good.home[1] + 10.0
    short = replace(good, limits=replace(good.limits, upper=high))
    assert [(p.path, "Y stands at" in p.message) for p in implausible(short)] == [(("axes", "Y", "travel"), True)]
    away = replace(good, home=good.home - 600.0)
    found = [p.path for p in implausible(away) if p.message.startswith("home is outside the workspace")]
    assert found == [("axes", "X", "home")]


@pytest.mark.parametrize("name", machines.catalogued())
def test_a_machine_of_the_catalogue_loads_and_uses_its_documents(name: str) -> None:
    machine, found = machines.load_checked(name)
    assert machine is not None and machine.name == name and not found
    assert np.all(machine.limits.lower < machine.limits.upper)
    for one in machine.documents:
        assert one.address.startswith("https://")
        assert any(text.startswith(f"{one.document}: ") for text in machine.figures.values()), one.document


def test_most_machines_of_the_catalogue_are_documented() -> None:
    full = [name for name in machines.catalogued()
            if not any(machines.load(name).figures[f"{axis}.{key}"] == "assumed"
                       for axis in machines.load(name).axis_names for key in ("travel", "velocity"))]
    assert len(full) >= DOCUMENTED, full


def test_the_page_of_machines_is_written_from_the_files() -> None:
    assert PAGE.read_text("utf-8") == page(), "python tests/machine_page.py"


def test_a_figure_that_a_file_states_is_its_own(tmp_path: Path) -> None:
    """Neither assumed any more, nor that of the document which its base names."""
    path = tmp_path / "ours.toml"
    path.write_text('base = "haas-umc-750"\n[axes.X]\ntravel = [-760, 0]\njerk = 9000\n[axes.B]\nvelocity = 240\n'
                    '[kinematics.axes.B]\npoint = [-390.1, -250.2, -540.3]\n[timing]\nclamp = 0.9\n')
    base, ours = machines.load("haas-umc-750"), machines.load(path)
    gone = {"X.travel", "X.jerk", "B.velocity", "B.point", "timing.clamp"}
    assert set(base.figures) - set(ours.figures) == gone
    assert "X.jerk" in base.limits.assumed and "X.jerk" not in ours.limits.assumed
    assert "clamp" in base.timing.assumed and "clamp" not in ours.timing.assumed


def test_a_source_of_ones_own_takes_the_place_of_assumed(tmp_path: Path) -> None:
    path = tmp_path / "ours.toml"
    path.write_text('base = "haas-umc-1000"\n[sources.sheet]\ndocument = "our data sheet"\nby = "maker"\n'
                    '[axes.X]\ntravel = [-1020, 0]\nsource.travel = "sheet: p. 3"\n')
    ours, found = machines.load_checked(path)
    assert ours is not None, found
    assert ours.figures["X.travel"] == "our data sheet: p. 3" and "X.travel" not in ours.limits.assumed


@pytest.mark.parametrize(("old", "new", "says"), [
    ('source.travel = "list: ', 'source.travel = "lost: ', "'lost'"),
    ('assumed = ["acceleration", ', 'assumed = ["travel", "acceleration", ', "assumed and has a source"),
])
def test_a_source_that_does_not_hold_is_refused(tmp_path: Path, old: str, new: str, says: str) -> None:
    text = builtin()["haas-umc-750"].read_text("utf-8")
    assert old in text
    path = tmp_path / "shop.toml"
    path.write_text(text.replace(old, new, 1))
    machine, found = machines.load_checked(path)
    assert machine is None and [d.code for d in found] == ["machine.source"] and says in found[0].message
    assert found[0].lines and found[0].hint
