"""Error models drawn: curves, uncertainty and sections, on serial machines, on rods, of maps."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error import load
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.exchange.figures import _round_part, model_figure
from machines.geometric_error.exchange.volume import ranges, section


def words(svg: bytes) -> str:
    return " ".join(re.findall(r"<!-- (.*?) -->", svg.decode()))


@pytest.fixture(scope="module")
def drawn() -> tuple[ErrorModel, bytes]:
    """The sample of mikron-ucp710 and its figure."""
    machine = machines.load("mikron-ucp710")
    model = load("samples/errors/mikron-ucp710.toml", machine)
    return model, model_figure(model, machine, 100.0, ".svg")


def test_every_component_and_its_ways_are_drawn(drawn: tuple[ErrorModel, bytes]) -> None:
    model, svg = drawn
    noted = words(svg)
    for component in model.axes.components:
        assert str(component.name) in noted
    assert "EXX, backwards" in noted and "EYX, backwards" not in noted and "tip off by, um" in noted


def test_what_a_model_says_of_its_uncertainty_is_seen(drawn: tuple[ErrorModel, bytes]) -> None:
    model, svg = drawn
    bare = model_figure(replace(model, covariance=None), machines.load("mikron-ucp710"), 100.0, ".svg")
    assert svg.count(b"<image") > bare.count(b"<image") == 4  # sections and their scales


def test_an_arrow_is_drawn_with_its_length_and_no_panel_is_empty(drawn: tuple[ErrorModel, bytes],
                                                                 tmp_path: Path) -> None:
    machine = machines.load("mikron-ucp710")

    def seen(svg: bytes) -> tuple[list[str], int]:
        """Lengths of arrows that are named, and panels of turns."""
        return re.findall(r"<!-- (\d+ um) -->", svg.decode()), svg.count(b"<!-- arcsec -->")

    def of_file() -> tuple[list[str], int]:
        return seen(model_figure(load(tmp_path / "e.toml", machine), machine, 100.0, ".svg"))

    assert seen(drawn[1]) == (["20 um", "50 um"], 5)
    (tmp_path / "e.toml").write_text("[components.EXX]\npolynomial = [0, 3]\nscale = 100\nrange = [-300, 300]\n")
    assert of_file() == (["5 um", "5 um"], 0)  # of 9
    (tmp_path / "e.toml").write_text("[components.EAX]\npolynomial = [0]\nrange = [-300, 300]\n")
    assert of_file() == ([], 1)


@pytest.mark.parametrize(("value", "part"),
                         [(9.99, 5.0), (10.0, 10.0), (0.3, 0.2), (0.0, 0.0), (float("nan"), 0.0)])
def test_arrows_that_are_reported_are_round(value: float, part: float) -> None:
    assert _round_part(value) == pytest.approx(part)


@pytest.mark.parametrize("name", ["uranesx", "h4a-c-table"])
def test_machines_on_rods_have_sections_alone(name: str) -> None:
    machine = machines.load(name)
    drawn = model_figure(load(f"samples/errors/{name}.toml", machine), machine, 0.0, ".png")
    assert drawn.startswith(b"\x89PNG")


def test_sections_go_over_the_ends_of_what_is_looked_at() -> None:
    for name in ("mikron-ucp710", "uranesx", "h4a-c-table"):
        machine = machines.load(name)
        model = load(f"samples/errors/{name}.toml", machine)
        q, one, two = section(machine, *ranges(model, machine), 0, 2, 5)
        tip, _ = machine.kinematics.forward(q)
        at = (tip - tip[0]).reshape(5, 5, 3)
        assert q.shape == (25, len(machine.axis_names)) and np.allclose(np.abs(at[0, :, 0]),
                                                                        np.abs(one - one[0]), atol=1e-9)
        assert np.allclose(at[:, 0, 2], two - two[0], atol=1e-9)


def test_a_map_is_drawn(tmp_path: Path) -> None:
    machine = machines.load("mill-3axis")
    rows = "\n".join(f"{x},{y},{z},{0.1 * x},0,{5 + y}" for x in (-100, 100) for y in (-80, 80) for z in (-50, 0))
    (tmp_path / "map.csv").write_text("X [mm], Y [mm], Z [mm], dx [um], dy [um], dz [um]\n" + rows + "\n")
    (tmp_path / "m.toml").write_text('machine = "mill-3axis"\n[map]\ntable = "map.csv"\n')
    noted = words(model_figure(load(tmp_path / "m.toml", machine), machine, 50.0, ".svg"))
    assert "tool of 50 mm" in noted


def test_another_ending_is_refused() -> None:
    machine = machines.load("uranesx")
    with pytest.raises(ValueError, match="figure format"):
        model_figure(load("samples/errors/uranesx.toml", machine), machine, 0.0, ".pdf")
