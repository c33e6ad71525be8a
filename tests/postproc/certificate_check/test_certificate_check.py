"""The check confirms what is proved and rejects what is not, whatever was changed; it shares no code with the search."""

from __future__ import annotations

import ast
import json
from collections.abc import Callable
from copy import deepcopy
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
from machines.analysis.certificate_figure import _ends
from machines.analysis.certify import Wanted, certify
from machines.certificate.enclosure import columns, enclosed
from machines.certificate.lookup import shipped
from machines.certificate.poses import PosesOfBoxes
from machines.certificate.spans import spanned
from machines.loader import builtin, values_of_machine
from postproc.certificate_check.balls import Ball, ball, cos_sin
from postproc.certificate_check.boxes import Rejected
from postproc.certificate_check.check import confirmed
from postproc.certificate_check.machine_file import about, hash_of
from postproc.cli.app import app
from tests.certificates import LARGE_FILES, of_chains, on_legs

LARGE = ("three-arms-three-slides", "hexapod", "hexaslide-cone", "hexaslide-coplanar", "hexaslide-parallel-z", "h4-rotary",
         "macro-micro", "tricept", "tripod-head")
Content = dict[str, Any]


@cache
def content(name: str = "rotary-delta") -> Content:
    return json.loads(certify(machines.load(name), Wanted()).text)


def sealed(found: Content) -> Content:
    """With digest and least bounds of its boxes, as whoever changes it with care would write them."""
    found["digest"] = sha256("\n".join(found["boxes"]).encode()).hexdigest()
    least = np.array([[float(v) for v in line.split()[1:]] for line in found["boxes"]]).min(axis=0)
    found["proved"] = dict(zip(("direct", "inverse", "held", "parts", "stops"), least.tolist(), strict=False))
    return found


def changed(edit: Callable[[Content], object]) -> Content:
    found = deepcopy(content())
    edit(found)
    return found


def with_bound(k: int, column: int, value: float) -> Callable[[Content], object]:
    def edit(found: Content) -> None:
        words = found["boxes"][k].split()
        words[1 + column] = repr(float(value))
        found["boxes"][k] = " ".join(words)
    return edit


def test_a_certificate_is_confirmed() -> None:
    figures = confirmed(deepcopy(content()))
    assert figures["boxes"] == len(content()["boxes"]) and figures["direct_at_least"] == content()["proved"]["direct"]


@pytest.mark.parametrize("k", [0, 7, -1])
def test_a_box_that_is_missing_leaves_a_gap(k: int) -> None:
    with pytest.raises(Rejected, match="digest"):
        confirmed(changed(lambda found: found["boxes"].pop(k)))
    with pytest.raises(Rejected, match="no box covers"):
        confirmed(sealed(changed(lambda found: found["boxes"].pop(k))))


@pytest.mark.parametrize("column", [0, 1, 2])
@pytest.mark.parametrize("k", [0, 30])
def test_a_bound_that_says_too_much_is_rejected(k: int, column: int) -> None:
    """Hardly more than there is in the middle of the box, by the code of the search."""
    legs = machines.load("rotary-delta").kinematics.leg_geometry
    lower, upper = _ends(content(), [line.split()[0] for line in content()["boxes"]])
    at = enclosed(PosesOfBoxes(legs, np.zeros(3)), spanned(0.5 * (lower + upper)[[k]]))
    free, held = columns(legs)
    there = (np.linalg.svd(at.matrix.lo[0, :3, free].T, compute_uv=False)[-1], at.cosine.lo.min(),
             np.linalg.svd(at.matrix.lo[0][:, held], compute_uv=False)[-1])[column]
    with pytest.raises(Rejected, match="states more"):
        confirmed(sealed(changed(with_bound(k, column, 1.001 * there))))


def test_a_bound_below_the_margin_is_rejected() -> None:
    with pytest.raises(Rejected, match="less than the margin"):
        confirmed(sealed(changed(with_bound(3, 0, 0.5 * content()["margin"]))))
    with pytest.raises(Rejected, match="digest"):
        confirmed(changed(with_bound(3, 0, 0.9999)))


@pytest.mark.parametrize("edit", [
    lambda found: found["region"].update(x_mm=[-400.0, 400.0]),
    lambda found: found["geometry"]["legs"][0].update(rod=found["geometry"]["legs"][0]["rod"] - 150.0),
    lambda found: found["geometry"]["legs"][1].update(travel=[-0.1, 0.1]),
    lambda found: found.update(margin=0.9),
    lambda found: found["boxes"].append(found["boxes"][0]),
    lambda found: found["boxes"].append("xx" + found["boxes"][0]),
    lambda found: found["boxes"].append("q 1 1 1"),
    lambda found: found["boxes"].append("x nan nan nan"),
    lambda found: found["region"].update(z_mm=[1.0, -1.0]),
    lambda found: found["region"].update(z_mm="tall"),
    lambda found: found["region"].update(of="flange"),
    lambda found: found.pop("geometry"),
    lambda found: found.update(boxes=[]),
    lambda found: found["geometry"]["legs"].clear(),
], ids=range(14))
def test_other_changes_are_rejected(edit: Callable[[Content], object]) -> None:
    found = changed(edit)
    if found.get("boxes") and all("nan" not in line and not line.startswith("q") for line in found["boxes"]):
        found = sealed(found)
    else:
        found["digest"] = sha256("\n".join(found["boxes"]).encode()).hexdigest()
    with pytest.raises(Rejected):
        confirmed(found)


@pytest.mark.parametrize("name", [name for name in on_legs() if name not in LARGE]
                         + [pytest.param(name, marks=pytest.mark.slow) for name in LARGE])
def test_shipped_certificates_are_confirmed_and_about_their_machine(name: str) -> None:
    table = values_of_machine(machines.load(name))
    found = json.loads(shipped()[hash_of(table)].read_text("utf-8"))
    about(found, json.loads(json.dumps(table)))
    assert found["covers"] == "workspace" and confirmed(found)["boxes"] == len(found["boxes"])


def test_no_certificate_is_shipped_for_nothing() -> None:
    assert set(shipped()) == {hash_of(values_of_machine(machines.load(name))) for name in (*on_legs(), *of_chains())}
    assert set(builtin()) - set(LARGE_FILES) == {*on_legs(), *of_chains()}


def test_a_certificate_of_another_machine_is_rejected(tmp_path: Path) -> None:
    run, file = CliRunner(), tmp_path / "c.json"
    file.write_text(json.dumps(content()), encoding="utf-8")
    good = run.invoke(app, ["machine", "certify", "--check", str(file), "--json", "-"])
    assert good.exit_code == 0 and json.loads(good.stdout)["confirmed"] is True
    other = run.invoke(app, ["machine", "certify", "uranesx", "--check", str(file)])
    assert other.exit_code == 1 and "certificate.rejected" in other.stderr
    file.write_text("{}", encoding="utf-8")
    assert "certificate.file" in run.invoke(app, ["machine", "certify", "--check", str(file)]).stderr
    file.write_text(json.dumps(content() | {"machine": "no-such"}), encoding="utf-8")
    assert "certificate.machine" in run.invoke(app, ["machine", "certify", "--check", str(file)]).stderr


def test_a_machine_that_has_changed_is_noticed() -> None:
    table = json.loads(json.dumps(values_of_machine(machines.load("rotary-delta"))))
    about(content(), table)
    for edit in (lambda t: t["kinematics"]["layout"].update(rod=700), lambda t: t["axes"]["A"].update(travel=[-50, 80])):
        other = deepcopy(table)
        edit(other)
        with pytest.raises(Rejected):
            about(content() | {"key": hash_of(other)}, other)


def _all_bounds(value: float) -> Callable[[Content], object]:
    return lambda found: found.update(boxes=[f"{line.split()[0]} {value} {value} {value}" for line in found["boxes"]])


@pytest.mark.parametrize("margin", [0.0, -1.0, float("nan"), float("inf"), 10**400])
def test_a_margin_that_lets_any_bound_pass_is_rejected(margin: float) -> None:
    """A singular position inside has bounds of 0 or less."""
    found = changed(_all_bounds(-0.5 if margin else 0.0))
    found["margin"] = margin
    with pytest.raises(Rejected, match=r"margin|no certificate"):
        confirmed(sealed(found))


@pytest.mark.parametrize("edit", [
    {"travel_margin": -1000.0}, {"travel_margin": float("nan")}, {"travel_proved": "yes"}, {"certificate": 99},
    {"covers": "all"}, {"covers": ["workspace"]}], ids=str)
def test_words_that_the_check_does_not_know_are_rejected(edit: Content) -> None:
    with pytest.raises(Rejected):
        confirmed(deepcopy(content()) | edit)


def test_carriers_that_the_machine_has_not_are_rejected() -> None:
    """They would take a part of each place on themselves: the legs were looked at in a smaller workspace."""
    found = deepcopy(content())
    found["geometry"]["carriers"] = [{"letter": name, "direction": row, "travel": [None, None]} for name, row in zip(
        "UVW", np.eye(3).tolist(), strict=True)]
    with pytest.raises(Rejected, match="carriers"):
        about(found, json.loads(json.dumps(values_of_machine(machines.load("rotary-delta")))))


def test_a_box_of_tips_behind_an_axis_at_the_spindle_is_rejected() -> None:
    table = json.loads(json.dumps(values_of_machine(machines.load("h4a-spindle-axis"))))
    found = json.loads(shipped()[hash_of(table)].read_text("utf-8"))
    found["region"]["of"], found["covers"] = "tip", "region"
    with pytest.raises(Rejected, match="moves the tip about"):
        about(found, table)


def test_the_check_says_of_what_the_region_is() -> None:
    region = confirmed(deepcopy(content()))["region"]
    assert region["of"] == "platform" and region["x_mm"] == content()["region"]["x_mm"] and region["tilt_deg"] == [0.0, 0.0]


def test_balls_hold_what_they_stand_for() -> None:
    """Products, quotients, roots, angles of random numbers inside, taken in more digits than a float has."""
    rng = np.random.default_rng(0)
    a, b = (Ball(rng.uniform(1.0, 3.0, 1000), rng.uniform(0.0, 0.5, 1000)) for _ in range(2))
    x, y = (one.m.astype(np.longdouble) + one.r * rng.uniform(-1.0, 1.0, 1000) for one in (a, b))
    cos, sin = cos_sin(a)
    for found, true in ((a * b, x * y), (a - b, x - y), (a.inverse(), 1 / x), (a.root(), np.sqrt(x)), (cos, np.cos(x)),
                        (sin, np.sin(x))):
        assert (found.least() <= true).all() and (true <= found.most()).all()
    third = ball(1.0) * ball(np.array([3.0])).inverse()
    assert third.r[0] > 0.0 and third.least()[0] < np.longdouble(1) / 3 < third.most()[0]


def test_the_check_imports_nothing_of_the_search() -> None:
    """Standard library, numpy, itself and the second witness, which shares no code with the rest either."""
    room = Path(builtin()["uranesx"]).parents[2] / "postproc" / "certificate_check"
    found = {name for file in (
        "balls", "chains", "legs", "check", "machine_file", "parts") for node in ast.walk(ast.parse(
        (room / f"{file}.py").read_text("utf-8"))) for name in (
            [node.module] if isinstance(node, ast.ImportFrom) else [one.name for one in node.names]
            if isinstance(node, ast.Import) else [])}
    assert {name for name in found if name.split(".")[0] in ("toolpaths", "machines", "postproc")
            and not name.startswith(("postproc.certificate_check.", "postproc.witness."))} == set()
    assert "postproc.witness.machine" in found
