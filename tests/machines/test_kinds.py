"""Kinds of machines: what is registered, what a machine file may name, what a kind of others must keep."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import pytest

import machines
from machines import kinds
from machines.kind_check import contract_faults
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.taylor import TaylorVector
from samples.my_machine import Scissors
from tests.machines.own_kinds import OWN, SAMPLE, Polar, Tilting, own_machine
from toolpaths.diagnostics import DiagnosticError

GOOD = OWN["scissors"]


def only(tmp_path: Path, text: str = GOOD) -> object:
    """The one fault of a machine file."""
    file = tmp_path / "m.toml"
    file.write_text(text)
    machine, (fault,) = machines.load_checked(file)
    assert machine is None and fault.lines, fault
    return fault


def test_an_unknown_kind_lists_what_is_registered(tmp_path, monkeypatch) -> None:
    monkeypatch.delenv(kinds.FILES, raising=False)
    fault = only(tmp_path)
    assert fault.code == "machine.kind" and f"registered are {', '.join(kinds.BUILT_IN)}" in fault.message
    assert kinds.GROUP in fault.hint and kinds.FILES in fault.hint
    monkeypatch.setenv(kinds.FILES, str(SAMPLE))  # what the hint says
    assert machines.load(tmp_path / "m.toml").structure == "scissors"
    misspelt = only(tmp_path, GOOD.replace('"scissors"', '"scisors"'))
    assert f"{', '.join(kinds.BUILT_IN)}, scissors" in misspelt.message and "did you mean 'scissors'?" in misspelt.hint


@dataclass(frozen=True, eq=False)
class Halved(OnLegs):
    """A redundant machine that says half of where its carriers stand."""

    def parameters_at(self, q: np.ndarray) -> np.ndarray:
        return 0.5 * super().parameters_at(q)


def test_a_redundant_kind_keeps_what_it_leaves_open() -> None:
    machine = machines.load("macro-micro")
    own = machine.kinematics
    places = machine.home + 40.0
    assert list(contract_faults(own, machine.limits, places)) == []
    lying = Halved(**{one.name: getattr(own, one.name) for one in fields(own)})
    faults = [one.message for one in contract_faults(lying, machine.limits, places)]
    assert any("off the pose and the parameters" in one for one in faults), faults


def test_the_schema_has_the_registered_kinds(monkeypatch) -> None:
    monkeypatch.setenv(kinds.FILES, str(SAMPLE))
    text = json.dumps(machines.schema())
    assert all(f'"{kind}"' in text for kind in [*kinds.BUILT_IN, "scissors"])
    monkeypatch.delenv(kinds.FILES)
    assert "scissors" not in json.dumps(machines.schema())


def test_keys_of_the_kind_are_checked_by_its_own_model(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv(kinds.FILES, str(SAMPLE))
    assert only(tmp_path, GOOD.replace("arm = 500", "arm = -5")).code == "file.range"
    unknown = only(tmp_path, GOOD.replace("rail = 400", "rail = 400\narms = 3"))
    assert unknown.code == "file.unknown-key" and "did you mean 'arm'?" in unknown.hint


def test_a_package_registers_a_kind_by_its_metadata(tmp_path, monkeypatch) -> None:
    """As an installed package does: a module and its `dist-info` on the path."""
    monkeypatch.delenv(kinds.FILES, raising=False)
    package = tmp_path / "site"
    package.mkdir()
    (package / "shop_machine.py").write_text(SAMPLE.read_text())
    info = package / "shop_machine-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: shop-machine\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{kinds.GROUP}]\nscissors = shop_machine:ScissorsModel\n")
    monkeypatch.syspath_prepend(str(package))
    file = tmp_path / "m.toml"
    file.write_text(GOOD)
    machine = machines.load(file)
    assert type(machine.kinematics).__module__ == "shop_machine" and "scissors" in kinds.known()
    assert kinds.code_file("scissors") == package / "shop_machine.py" and kinds.code_file("serial") is None
    (info / "entry_points.txt").write_text(f"[{kinds.GROUP}]\nscissors = shop_machine:Scissors\nserial = no_module:X\n")
    os.utime(package)  # as an installer does, which puts another folder there
    fault = only(tmp_path)
    assert "is not a KinematicsModel" in fault.message and "register the model" in fault.hint
    assert machines.load("mill-3axis").kinematics.straight_slides  # a built-in kind stays what it is
    (info / "entry_points.txt").write_text(f"[{kinds.GROUP}]\nscissors = gone_module:Model\n")
    os.utime(package)  # as an installer does, which puts another folder there
    fault = only(tmp_path)
    assert "shop-machine) is not imported: ModuleNotFoundError" in fault.message and "reinstall or" in fault.hint


def test_files_that_are_no_kinds_are_refused_with_what_is_wrong(tmp_path, monkeypatch) -> None:
    broken = tmp_path / "broken.py"
    for text, words in (("1 / 0", "is not run: ZeroDivisionError"), ("import sys; sys.exit(0)", "is not run: SystemExit"),
                        ("nothing = 1", "holds no kind of machine")):
        broken.write_text(text)
        kinds._of_file.cache_clear()
        monkeypatch.setenv(kinds.FILES, str(broken))
        fault = only(tmp_path)
        assert fault.code == "machine.kind" and words in fault.message and str(broken) in fault.message
    assert machines.load("mill-3axis").name == "mill-3axis"
    kinds._of_file.cache_clear()


def test_one_kind_in_two_files_is_refused(tmp_path, monkeypatch) -> None:
    second = tmp_path / "second.py"
    second.write_text(SAMPLE.read_text())
    monkeypatch.setenv(kinds.FILES, os.pathsep.join([str(SAMPLE), str(second)]))
    fault = only(tmp_path)
    assert fault.code == "machine.kind" and f"defined twice: in {SAMPLE.resolve()} and in {second}" in fault.message
    assert "name one of them" in fault.hint and machines.load("mill-3axis").name == "mill-3axis"
    monkeypatch.setenv(kinds.FILES, os.pathsep.join([str(second), str(second)]))  # one of them, as the hint says
    assert machines.load(tmp_path / "m.toml").structure == "scissors"
    second.write_text(SAMPLE.read_text().replace('"scissors"', '"shears"'))
    kinds._of_file.cache_clear()
    monkeypatch.setenv(kinds.FILES, os.pathsep.join([str(SAMPLE), str(second)]))  # another word, as it says too
    assert {"scissors", "shears"} <= set(kinds.known())
    kinds._of_file.cache_clear()


def test_a_file_that_nobody_names_is_not_run(tmp_path, monkeypatch) -> None:
    monkeypatch.delenv(kinds.FILES, raising=False)
    (tmp_path / "my_machine.py").write_text("raise SystemExit(99)")
    assert only(tmp_path).code == "machine.kind"


def test_the_older_word_for_kind_still_holds(tmp_path) -> None:
    file = tmp_path / "m.toml"
    text = (Path(machines.__file__).parent / "data/mill-3axis.toml").read_text()
    file.write_text(text.replace('kind = "serial"', 'family = "serial"'))
    assert machines.load(file).structure == machines.load("mill-3axis").structure
    file.write_text('base = "mill-3axis"\n[kinematics]\nfamily = "serial"\n')
    assert machines.load(file).structure == machines.load("mill-3axis").structure
    both = only(tmp_path, 'base = "mill-3axis"\n[kinematics]\nfamily = "linear-delta"\n')
    assert both.code == "machine.kind" and both.lines == (3,) and "keep one of them" in both.hint


class ForgetsTool(Scissors):
    def with_tool(self, length):
        return self


class WrongInverse(Scissors):
    def inverse(self, tip, axis, spin=0.0, near=None):
        return super().inverse(tip, axis) + 1e-3


class WrongShape(Scissors):
    def inverse(self, tip, axis, spin=0.0, near=None):
        return super().inverse(tip, axis)[0]


class StandsStill(Tilting):
    turns_tool = (False, False, False, False)


class SaysProved(Tilting):
    jets_proved = True

    def jets(self, q0, q1):
        return tuple(TaylorVector(jet.value, jet.first, jet.second, 0.0) for jet in super().jets(q0, q1))


class SaysStraight(Scissors):
    straight_slides = True


class WrongRates(Scissors):
    def jacobian(self, q, near=None):
        return 1.01 * super().jacobian(q, near)


class Raises(Scissors):
    def inverse(self, tip, axis, spin=0.0, near=None):
        raise KeyError("arm")


@pytest.mark.parametrize(("kind", "words"), [
    (ForgetsTool, "forward has to use tool_length"), (WrongInverse, "off the pose that was asked for"),
    (WrongShape, "expected (branches, N, J)"), (StandsStill, "turns_tool is False of a joint that turns the tool axis"),
    (SaysProved, "poses leave the bound"), (SaysStraight, "straight_slides is True"),
    (WrongRates, "jacobian is not what forward changes by"), (Raises, "its code fails near home: KeyError: 'arm'")])
def test_a_kind_that_breaks_the_contract_is_refused(kind: type, words: str) -> None:
    machine = own_machine("tilting" if issubclass(kind, Tilting) else "scissors")
    broken = kind(200.0, 60.0) if issubclass(kind, Tilting) else kind(500.0, 400.0)
    found = [p.message for p in contract_faults(broken, machine.limits, machine.home)]
    assert found and words in found[0], found


@pytest.mark.parametrize("name", machines.names())
def test_the_built_in_kinds_keep_the_contract(name: str) -> None:
    machine = machines.load(name)
    assert [p.message for p in contract_faults(machine.kinematics, machine.limits, machine.home)] == []


def test_the_contract_is_held_against_a_file_that_is_loaded(tmp_path, monkeypatch) -> None:
    wrong = tmp_path / "wrong.py"
    wrong.write_text(SAMPLE.read_text().replace("tip[:, 2] + self.tool_length", "tip[:, 2]"))
    monkeypatch.setenv(kinds.FILES, str(wrong))
    fault = only(tmp_path)
    assert fault.code == "machine.contract" and "tool of 50 mm" in fault.message
    assert "base.py says what it promises" in fault.hint


@pytest.mark.parametrize(("old", "new", "words"), [
    ("return Scissors(self.arm, self.rail)", "return 7", "build gives a int, expected a Kinematics"),
    ("return Scissors(self.arm, self.rail)", "raise OSError('no')", "builds no kinematics: OSError: no"),
    ("def forward(", "def forwards(", "builds no kinematics: TypeError: Can't instantiate abstract class"),
    ('axis_names = ("X", "Y", "Z")', 'axis_names = ("X", "Y", "D")', "'D' is not a letter of a linear axis"),
    ('    axis_names = ("X", "Y", "Z")', "    names = ()", "has no attribute 'axis_names'")])
def test_a_model_that_gives_no_kinematics_is_refused(tmp_path, monkeypatch, old: str, new: str,
                                                     words: str) -> None:
    wrong = tmp_path / "wrong.py"
    assert old in SAMPLE.read_text()
    wrong.write_text(SAMPLE.read_text().replace(old, new))
    monkeypatch.setenv(kinds.FILES, str(wrong))
    fault = only(tmp_path)
    assert fault.code == "machine.contract" and words in fault.message, fault.message


def test_a_schema_of_a_file_that_is_not_run_says_so(tmp_path, monkeypatch) -> None:
    wrong = tmp_path / "wrong.py"
    wrong.write_text("import no_such_module")
    monkeypatch.setenv(kinds.FILES, str(wrong))
    with pytest.raises(DiagnosticError, match="No module named"):
        machines.schema()
    wrong.unlink()  # what the hint says
    monkeypatch.delenv(kinds.FILES)
    assert machines.schema()


def test_a_polar_mill_has_no_place_where_the_table_is_free_but_its_middle() -> None:
    kin = Polar()
    q = np.array([[0.0, 10.0, 0.3], [1e-3, 10.0, 0.3], [100.0, 10.0, 2.0]])
    assert kin.singular(q).tolist() == [True, False, False]
