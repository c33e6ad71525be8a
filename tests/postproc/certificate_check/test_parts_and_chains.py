"""Certificates with parts held apart, of bars, and of chains of axes: confirmed as they are, rejected when anything is
changed."""

from __future__ import annotations

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
from machines.analysis.certify import Wanted, certify
from machines.analysis.certify_chain import WantedOfChain, certify_chain
from machines.certificate.lookup import key_of, shipped
from machines.loader import values_of_machine
from postproc.certificate_check.boxes import Rejected
from postproc.certificate_check.chains import chain_confirmed
from postproc.certificate_check.check import confirmed
from postproc.certificate_check.machine_file import about, hash_of
from postproc.cli.app import app
from tests.certificates import of_chains
from tests.postproc.certificate_check.test_certificate_check import sealed

Content = dict[str, Any]


def table_of(name: str) -> Content:
    return json.loads(json.dumps(values_of_machine(machines.load(name))))


def some_boxes(name: str, lower: list[float], upper: list[float]) -> Content:
    return json.loads(certify(machines.load(name), Wanted((np.array(lower), np.array(upper)), 0.0)).text)


@cache
def made(which: str) -> Content:
    """A certificate, which nobody changes."""
    if which == "uranesx":
        return json.loads(certify(machines.load("uranesx"), Wanted()).text)
    if which == "bars":
        return some_boxes("h4-rotary", [-8.0, -8.0, -66.0], [8.0, 8.0, -60.0])
    wanted = WantedOfChain(tool=100.0) if which == "mikron" else WantedOfChain(turns={"A": (0.2, 0.9)})
    return json.loads(certify_chain(machines.load("mikron-ucp710"), wanted).text)


def test_parts_bars_and_chains_are_confirmed_and_about_their_machines() -> None:
    for name, found in (("uranesx", made("uranesx")), ("h4-rotary", made("bars"))):
        about(deepcopy(found), table_of(name))
        said = confirmed(deepcopy(found))
        assert said["boxes"] == len(found["boxes"])
        assert name != "uranesx" or said["parts_at_least"] == found["proved"]["parts"] > 60.0
    for found in (made("mikron"), made("tilted")):
        about(deepcopy(found), table_of("mikron-ucp710"))
        assert chain_confirmed(deepcopy(found))["travel_at_least"] == found["proved"]["travel"]


@pytest.mark.parametrize(("column", "more"), [(3, 8.0), (4, 0.05)])
def test_a_distance_that_says_too_much_is_rejected(column: int, more: float) -> None:
    """The box of the least one: its bound is within that of what there is in its middle."""
    found = deepcopy(made("uranesx"))
    rows = [line.split() for line in found["boxes"]]
    row = min(rows, key=lambda r: float(r[1 + column]))
    row[1 + column] = repr(float(row[1 + column]) * 2.0 + more)
    found["boxes"] = [" ".join(r) for r in rows]
    with pytest.raises(Rejected, match="states more"):
        confirmed(sealed(found))
    row[1 + column] = "-0.001"
    found["boxes"] = [" ".join(r) for r in rows]
    with pytest.raises(Rejected, match="touch"):
        confirmed(sealed(found))


@pytest.mark.parametrize("edit", [
    lambda parts: parts.update(rod_radius=20.0), lambda parts: parts.update(spindle_radius=None),
    lambda parts: parts["rods"].pop(), lambda parts: parts["middle"].__setitem__(0, [0.0, 0.0, 1.0]),
    lambda parts: parts.update(carriage_angle=1.0), lambda parts: parts["rods"][0].update(shift=[0.0, 300.0, 0.0]),
    lambda parts: parts.update(rail_ends=[[0.0, 1.0]] * 3)], ids=range(7))
def test_parts_of_another_machine_are_rejected(edit: Callable[[Content], object]) -> None:
    found = deepcopy(made("uranesx"))
    edit(found["geometry"]["parts"])
    with pytest.raises(Rejected, match="machine file"):
        about(found, table_of("uranesx"))


@pytest.mark.parametrize("edit", [{"bar": -1}, {"kept": [0.0, 0.0, 0.0]}, {"joint": [0.0, 0.0, 0.0]}], ids=str)
def test_a_platform_with_other_bars_is_rejected(edit: Content) -> None:
    found = deepcopy(made("bars"))
    found["geometry"]["legs"][1].update(edit)
    with pytest.raises(Rejected, match="machine file"):
        about(found, table_of("h4-rotary"))


def resealed(found: Content) -> Content:
    found["digest"] = sha256("\n".join(found["boxes"]).encode()).hexdigest()
    least = np.array([[float(v) for v in line.split()[1:]] for line in found["boxes"]]).min(axis=0)
    found["proved"] = dict(zip(("pole", "slides", "travel"), least.tolist(), strict=True))
    return found


@pytest.mark.parametrize("k", [0, 30, -1])
def test_a_chain_with_a_box_removed_is_rejected(k: int) -> None:
    found = deepcopy(made("mikron"))
    found["boxes"].pop(k)
    with pytest.raises(Rejected, match="digest"):
        chain_confirmed(found)
    with pytest.raises(Rejected, match="no box covers"):
        chain_confirmed(resealed(found))


@pytest.mark.parametrize(("column", "by"), [(0, 0.6), (1, 1.06), (2, 200.0)])
def test_a_chain_with_a_bound_loosened_is_rejected(column: int, by: float) -> None:
    found = deepcopy(made("tilted"))
    rows = [line.split() for line in found["boxes"]]
    row = min(rows, key=lambda r: float(r[1 + column]))
    row[1 + column] = repr(float(row[1 + column]) * by if column == 1 else float(row[1 + column]) + by)
    found["boxes"] = [" ".join(r) for r in rows]
    with pytest.raises(Rejected, match="states more"):
        chain_confirmed(resealed(found))
    with pytest.raises(Rejected, match="digest"):
        chain_confirmed(found | {"digest": made("mikron")["digest"]})


@pytest.mark.parametrize("edit", [
    lambda f: f["region"].update(x_mm=[-900.0, 900.0]), lambda f: f["region"].update(tool_mm=900.0),
    lambda f: f["region"]["turns_rad"].update(A=[-3.0, 3.0]), lambda f: f["region"]["turns_rad"].pop("A"),
    lambda f: f.update(margin=0.9), lambda f: f.update(margin=-1.0), lambda f: f.update(slides_margin=float("nan")),
    lambda f: f.update(covers="workspace"), lambda f: f["boxes"].append(f["boxes"][0]),
    lambda f: f["boxes"].append("bbbbbbbbbbbbbbb 1 1 1"), lambda f: f["boxes"].append("a nan 1 1"),
    lambda f: f["chain"]["axes"][0].update(point=[0.0, 0.0, 900.0])], ids=range(12))
def test_other_changes_of_a_chain_are_rejected(edit: Callable[[Content], object]) -> None:
    """By the proof where the geometry is that of the file, else by comparing with the machine file."""
    found = deepcopy(made("mikron"))
    edit(found)
    with pytest.raises((Rejected, KeyError)):
        about(deepcopy(found), table_of("mikron-ucp710"))
        chain_confirmed(resealed(found))


@pytest.mark.parametrize("edit", [
    lambda t: t["axes"]["X"].update(travel=[-10, 10]), lambda t: t["kinematics"]["axes"]["A"].update(point=[0, 0, 9]),
    lambda t: t["kinematics"]["axes"]["C"].update(positive=-1), lambda t: t["axes"]["A"].update(travel=[-1, 1])],
    ids=range(4))
def test_a_chain_of_a_changed_machine_is_rejected(edit: Callable[[Content], object]) -> None:
    table = table_of("mikron-ucp710")
    edit(table)
    with pytest.raises(Rejected, match="key"):
        about(deepcopy(made("mikron")), table)
    with pytest.raises(Rejected, match=r"machine file|outside its travel"):
        about(deepcopy(made("mikron")) | {"key": hash_of(table)}, table)


@pytest.mark.parametrize("name", sorted({hash_of(table_of(n)): n for n in of_chains()}.values())[::4])
def test_shipped_certificates_of_chains_are_confirmed(name: str) -> None:
    table = table_of(name)
    assert hash_of(table) == key_of(table)
    found = json.loads(shipped()[hash_of(table)].read_text("utf-8"))
    about(found, table)
    assert chain_confirmed(found)["boxes"] == len(found["boxes"])


def test_a_chain_is_certified_and_checked_from_the_command_line(tmp_path: Path) -> None:
    run, file = CliRunner(), tmp_path / "m.json"
    done = run.invoke(app, ["machine", "certify", "mikron-ucp710", "--tool", "100", "--box", "100x80x60", "--turn",
                            "A=-10:40",
                            "-o", str(file), "--figure", str(tmp_path / "m.png"), "--json", "-"])
    assert done.exit_code == 0, done.output
    figures = json.loads(done.stdout)
    assert figures["region"]["turns_deg"]["A"] == [-10.0, 40.0] and (tmp_path / "m.png").stat().st_size > 1000
    assert np.diff(figures["region"]["x_mm"]) == pytest.approx([100.0])
    assert run.invoke(app, ["machine", "certify", "--check", str(file)]).exit_code == 0
    for words in (["--turn", "A=5"], ["--turn", "X=0:1"], ["--turn", "A=20:10"], ["--clearance"], ["--travel"]):
        assert run.invoke(app, ["machine", "certify", "mikron-ucp710", *words]).exit_code == 2
    assert run.invoke(app, ["machine", "certify", "uranesx", "--turn", "A=0:1"]).exit_code == 2
