"""Faults planted in the reader, the placement, the kinematics, the set-up and the cycles: the second witness sees each.

The read-back shares all of these with what it proves, so that it agrees with most of them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import machines
import postproc
import postproc.job.job
import postproc.job.places
import postproc.reference.moves
import toolpaths
import toolpaths.cl.assemble
import toolpaths.cl.cycles
import toolpaths.cl.frames
import toolpaths.cl.interpret
import toolpaths.cl.motion
import toolpaths.cl.read
import toolpaths.cl.text.subprograms
from machines.serial_models import SerialModel
from machines.slider_models import SliderModel
from postproc.job.job import Job
from postproc.pipeline.result import PostResult
from postproc.setup.model import Placement, SetupFile
from postproc.verification.second_witness import second_witness
from postproc.witness.machine import rods as rods_of_file
from tests import machines_once
from toolpaths.cl.build import ToolpathBuilder
from toolpaths.cl.feeds import PER_MINUTE
from toolpaths.toolpath import Kind, Toolpath

SAMPLES = Path(__file__).parents[3] / "samples"
Patch = pytest.MonkeyPatch
Plant = Callable[[Patch], None]
HEAD = """TOOL PATH/ONE,TOOL,MILL_10
MSYS/20.0,5.0,3.0,0.0,1.0,0.0,-1.0,0.0,0.0
LOAD/TOOL,1
SPINDL/RPM,3000,CLW
COOLNT/FLOOD
RAPID
GOTO/10,0,50,0,0,1
RAPID
GOTO/10,0,2
FEDRAT/MMPM,250
GOTO/10,0,-3
CIRCLE/0,0,-3,0,0,-1,10,0.03,0.5,10,0
GOTO/0,10,-3
FEDRAT/MMPM,600
GOTO/-20,14,-3
GODLTA/-6,3,0
GOTO/-30,30,-3
RAPID
GOTO/-30,30,50
"""
HOLES = """CYCLE/DRILL,DEEP,FEDTO,-12,RAPTO,3,RTRCTO,20,MANUAL,STEP,4,MMPM,120
GOTO/30,5,0
GOTO/40,5,0
CYCLE/OFF
RAPID
GOTO/40,5,50
"""
NX = HEAD + HOLES + "END-OF-PATH\n"
MILLED = HEAD + "END-OF-PATH\n"
DRILL = HEAD + HOLES.replace("DRILL,DEEP", "DRILL").replace("STEP,4,", "DWELL,0.5,") + "END-OF-PATH\n"
INCH = """UNITS/INCHES
LOADTL/1
SPINDL/RPM,3000,CLW
RAPID
GOTO/1,0,2
FEDRAT/10,IPM
GOTO/1,0,-.1
GOTO/3,1,-.1
RAPID
GOTO/3,1,2
FINI
"""
CREO = """$$-> FEATNO / 1
UNITS / MM
LOADTL / 1
$$-> CSYS / 1.0, 0.0, 0.0, 25.0, $
 0.0, 0.8, -0.6, 4.0, $
 0.0, 0.6, 0.8, 7.0
SPINDL / RPM, 3000, CLW
COOLNT / ON
RAPID
GOTO / 10, 0, 30
FEDRAT / 250, MMPM
GOTO / 10, 0, -3
DEFSUB / 1
GOTO / 20, 4, -3
GOTO / 24, 8, -3
ENDSUB
CALSUB / 1
GOTO / 10, 9, -3
RAPID
GOTO / 10, 9, 30
FINI
"""
FIVE = """UNITS/MM
LOADTL/1
SPINDL/RPM,3000,CLW
MULTAX/ON
RAPID
GOTO/10,3,40,0,0,1
FEDRAT/400,MMPM
GOTO/10,3,0,0,0,1
GOTO/20,5,2,0.0995037,0.0995037,0.9900496
GOTO/30,12,4,0.1960784,0.0980392,0.9756747
GOTO/35,20,4,0.28,0.0,0.96
RAPID
GOTO/35,20,40,0.28,0.0,0.96
FINI
"""
SMALL = """UNITS/MM
LOADTL/1
SPINDL/RPM,3000,CLW
MULTAX/ON
RAPID
GOTO/8,0,10,0,0,1
FEDRAT/400,MMPM
GOTO/8,0,8,0,0,1
GOTO/-8,0,8,0,0,1
RAPID
GOTO/8,0,8,0.6,0,0.8
GOTO/8,0,-8,0.6,0,0.8
GOTO/8,4,-8,0.6,0,0.8
FINI
"""
FLAT = INCH.replace("UNITS/INCHES", "UNITS/MM").replace("10,IPM", "250,MMPM")
SETUPS: dict[str, SetupFile | str] = {
    "plain": SetupFile(),
    "turned": SetupFile.model_validate({
        "tools": {"1": {"gauge_length": 120.0}, "2": {"gauge_length": 90.0}},
        "part": {"origin": (3.0, -20.0, 5.0), "x_axis": (0.6, 0.8, 0.0), "y_axis": (-0.8, 0.6, 0.0)}}),
    "delta": str(SAMPLES / "delta.setup.toml"), "h4a": str(SAMPLES / "h4a.setup.toml"),
}


def converted(cl: str, machine: str, controller: str, setup: str) -> PostResult:
    path, found = toolpaths.read_bytes(cl, file="part.cls")
    return postproc.convert(path, machines.load(machine), controller, SETUPS[setup], diagnostics=found)


def codes(result: PostResult) -> set[str]:
    """What the second witness finds, whether or not the read-back has found something before."""
    assert result.comparison is not None and result.job is not None, [str(d) for d in result.diagnostics]
    assert result.asked is not None
    return {d.code for d in second_witness(result.source, result.asked, result.options, result.job, result.comparison)[1]}


@cache
def unspoilt(cl: str, machine: str, controller: str, setup: str) -> None:
    """Without a fault both witnesses agree."""
    result = converted(cl, machine, controller, setup)
    assert result.ok, [str(d) for d in result.diagnostics]
    assert result.witness is not None and result.witness.not_compared == ()


def wrapped(target: Any, name: str, change: Callable[..., Any]) -> Plant:
    """The function replaced by `change`, which gets it as its first argument."""
    def plant(patch: Patch) -> None:
        old = getattr(target, name)
        patch.setattr(target, name, lambda *a, **k: change(old, *a, **k))
    return plant


def path_changed(change: Callable[[Toolpath], Toolpath]) -> Plant:
    return wrapped(toolpaths.cl.read, "assemble", lambda old, b: change(old(b)))


def events(change: Callable[[str, tuple[Any, ...]], tuple[str, tuple[Any, ...]] | None]) -> Plant:
    def event(old: Any, self: ToolpathBuilder, word: str, values: tuple[Any, ...]) -> None:
        found = change(word, values)
        if found is not None:
            old(self, *found)
    return wrapped(ToolpathBuilder, "event", event)


def moved(rows: dict[int, int | tuple[int, int]]) -> Callable[[Toolpath], Toolpath]:
    """Rows put where other rows are, or half path between two."""
    def change(path: Toolpath) -> Toolpath:
        tip = path.tip.copy()
        for row, at in rows.items():
            tip[row] = path.tip[at] if isinstance(at, int) else 0.5 * (path.tip[at[0]] + path.tip[at[1]])
        return replace(path, tip=tip)
    return change


def kinds(row: int, kind: Kind) -> Callable[[Toolpath], Toolpath]:
    def change(path: Toolpath) -> Toolpath:
        kind_, feed = path.kind.copy(), path.feed.copy()
        kind_[row], feed[row] = kind, np.nan if kind == Kind.RAPID else 10.0
        return replace(path, kind=kind_, feed=feed)
    return change


def frame(matrix: Callable[[Any], Any], origin: Callable[[Any], Any] = lambda o: o) -> Plant:
    return wrapped(toolpaths.cl.frames, "set_system", lambda old, b, name, m, o: old(b, name, matrix(m), origin(o)))


def arcs(**change: Callable[[Any], Any]) -> Plant:
    def spoilt(old: Any, *given: Any) -> Any:
        found = old(*given)
        return replace(found, **{name: of(getattr(found, name)) for name, of in change.items()})
    return wrapped(toolpaths.cl.assemble, "arcs_of", spoilt)


def joint(change: Callable[[Any], Any]) -> Plant:
    return wrapped(SerialModel, "_joint", lambda old, self, name: change(old(self, name)))


def feeds(factor: float) -> Plant:
    def spoilt(old: Any, *given: Any) -> Any:
        feed, seconds, found = old(*given)
        return feed * factor, seconds, found
    return wrapped(postproc.reference.moves, "feeds_of", spoilt)


def turned_back(j: Any) -> Any:
    return replace(j, direction=-j.direction) if j.rotary and j.name == "C" else j


def adjacent(j: Any) -> Any:
    return replace(j, point=j.point + np.array([0.1, 0.0, 0.0])) if j.rotary else j


def transposed(old: Any, *given: Any) -> Any:
    placement, found = old(*given)
    return Placement(placement.rotation.T, placement.origin), found


def no_kind(old: Any, words: Any) -> Any:
    kind, rest = old(words)
    return ("DRILL" if kind == "DEEP" else "DEEP" if kind == "DRILL" else kind), rest


def units_dropped(patch: Patch) -> None:
    patch.setattr(toolpaths.cl.read, "_units", lambda *_: "mm")


def subroutine_skipped(patch: Patch) -> None:
    """A call that carries nothing out and counts as made."""
    patch.setitem(toolpaths.cl.interpret.HANDLERS, "CALSUB", lambda b, s: b.called.add(
        toolpaths.cl.interpret._subprograms(b).place(toolpaths.cl.text.subprograms.called(s), b.index)))


def next_tools(p: Toolpath) -> Toolpath:
    """Every number one more, of the tools and of the records that load them."""
    events = tuple(replace(e, values=(float(e.values[0]) + 1.0, *e.values[1:])) if e.word == "LOADTL" else e
                   for e in p.events)
    return replace(p, tools=tuple(replace(t, number=t.number + 1) for t in p.tools), events=events)


def delta_turned(old: Any, b: ToolpathBuilder, rows: Any) -> None:
    b.deltas[:] = [(row, tuple(-v for v in step)) for row, step in b.deltas]
    old(b, rows)


def cycle(**change: Callable[[Any], Any]) -> Plant:
    def spoilt(old: Any, b: Any, v: Any) -> Any:
        made = old(b, v)
        return replace(made, **{name: of(getattr(made, name)) for name, of in change.items()})
    return wrapped(toolpaths.cl.cycles, "_made", spoilt)


def other_direction(word: str, values: tuple[Any, ...]) -> tuple[str, tuple[Any, ...]]:
    return word, tuple({"CLW": "CCLW"}.get(v, v) for v in values) if word == "SPINDL" else values


def flooded(old: Any, self: ToolpathBuilder, word: str, values: tuple[Any, ...]) -> None:
    old(self, word, values)
    if word == "SPINDL":
        old(self, "COOLNT", ("FLOOD",))


def of_word(word: str, make: Callable[[tuple[Any, ...]], tuple[Any, ...] | None]) -> Plant:
    def change(name: str, values: tuple[Any, ...]) -> tuple[str, tuple[Any, ...]] | None:
        made = make(values) if name == word else values
        return None if made is None else (name, made)
    return events(change)


def rods(old: Any, self: Any) -> Any:
    legs = old(self)
    return replace(legs, lengths=legs.lengths * 1.0002)


EYE = np.eye(3)
FAULTS: dict[str, tuple[str, str, str, str, Plant]] = {
    "MSYS ignored": (NX, "mill-3axis", "linuxcnc", "plain", frame(lambda m: EYE, lambda o: 0.0 * o)),
    "MSYS transposed": (NX, "mill-3axis", "linuxcnc", "plain", frame(lambda m: m.T)),
    "MSYS without its origin": (NX, "mill-3axis", "linuxcnc", "plain", frame(lambda m: m, lambda o: 0.0 * o)),
    "CSYS ignored": (CREO, "mikron-ucp710", "fanuc-30i", "turned", frame(lambda m: EYE)),
    "CSYS transposed": (CREO, "mikron-ucp710", "fanuc-30i", "turned", frame(lambda m: m.T)),
    "subroutine skipped": (CREO, "mikron-ucp710", "fanuc-30i", "turned", subroutine_skipped),
    "arcs in the other direction": (NX, "mill-3axis", "linuxcnc", "plain",
                           arcs(normal=lambda n: -n, sweep=lambda s: 2.0 * np.pi - s)),
    "arcs in the other direction, as lines": (MILLED, "uranesx", "linuxcnc", "delta",
                                     arcs(normal=lambda n: -n, sweep=lambda s: 2.0 * np.pi - s)),
    "centre of arcs shifted": (NX, "mill-3axis", "linuxcnc", "plain",
                                arcs(center=lambda c: c + np.array([-0.05, 0.05, 0.0]))),
    "depth of cycles + 1 mm": (NX, "mill-3axis", "siemens-840d", "plain", cycle(depth=lambda d: d + 1.0)),
    "depth of cycles - 1 mm": (NX, "mill-3axis", "fanuc-30i", "plain", cycle(depth=lambda d: d - 1.0)),
    "depth of cycles turned": (NX, "mill-3axis", "generic-iso", "plain", cycle(depth=lambda d: d * 0.5)),
    "start plane of cycles": (NX, "mill-3axis", "linuxcnc", "plain", cycle(clearance=lambda c: c - 1.0)),
    "deep drilling as drilling": (NX, "mill-3axis", "linuxcnc", "plain",
                                  wrapped(toolpaths.cl.cycles, "kind_of", no_kind)),
    "pecks of twice the depth": (NX, "mill-3axis", "heidenhain-tnc640", "plain",
                                 cycle(steps=lambda s: tuple(2.0 * v for v in s))),
    "dwell dropped": (DRILL, "mill-3axis", "fanuc-30i", "plain", cycle(dwell=lambda d: 0.0)),
    "feed of cycles x 1.1": (NX, "mill-3axis", "linuxcnc", "plain", cycle(feed=lambda f: 1.1 * f)),
    "inch lengths as mm": (INCH, "mill-3axis", "linuxcnc", "plain", units_dropped),
    "inch feeds as mm": (INCH, "mill-3axis", "linuxcnc", "plain", lambda p: p.setitem(PER_MINUTE, "IPM", 1.0)),
    "feed x 1.1": (NX, "mill-3axis", "haas-ngc", "plain", feeds(1.1)),
    "feed x 0.9": (NX, "mill-3axis", "linuxcnc", "plain", feeds(0.9)),
    "feed x 1.1, five axes": (FIVE, "mikron-ucp710", "linuxcnc", "turned", feeds(1.1)),
    "feed x 0.9, five axes": (FIVE, "mikron-ucp710", "fanuc-30i", "turned", feeds(0.9)),
    "safe margin 0": (SMALL, "mikron-ucp710", "linuxcnc", "turned",
                      wrapped(postproc.job.job, "safe_space", lambda old, *a: replace(old(*a), margin=0.0))),
    "gauge length x 1.001": (FIVE, "head-table", "linuxcnc", "turned",
                             wrapped(Job, "length_of", lambda old, self, n: 1.001 * old(self, n))),
    "gauge length x 1.001, rods": (MILLED, "h4a-c-table", "linuxcnc", "h4a",
                                   wrapped(Job, "length_of", lambda old, self, n: 1.001 * old(self, n))),
    "rods x 1.0002": (MILLED, "uranesx", "linuxcnc", "delta", wrapped(SliderModel, "build_legs", rods)),
    "lines of the rotary axes off by 0.1 mm": (FIVE, "mikron-ucp710", "linuxcnc", "turned", joint(adjacent)),
    "lines of the rotary axes off, tip modes": (FIVE, "mikron-ucp710", "siemens-840d", "turned", joint(adjacent)),
    "C in the other direction": (FIVE, "mikron-ucp710", "linuxcnc", "turned", joint(turned_back)),
    "part placement transposed": (NX, "mill-3axis", "linuxcnc", "turned",
                                  wrapped(postproc.job.places, "part_placement", transposed)),
    "wrong tool number": (NX, "mill-3axis", "linuxcnc", "turned",
                          path_changed(next_tools)),
    "spindle in the other direction": (NX, "mill-3axis", "linuxcnc", "plain", events(other_direction)),
    "spindle speed": (NX, "mill-3axis", "linuxcnc", "plain",
                      of_word("SPINDL", lambda v: tuple(2000.0 if x == 3000.0 else x for x in v))),
    "coolant dropped": (NX, "mill-3axis", "linuxcnc", "plain", of_word("COOLNT", lambda v: None)),
    "mist for flood": (NX, "mill-3axis", "linuxcnc", "plain", of_word("COOLNT", lambda v: ("MIST",))),
    "coolant that nobody asks for": (FLAT, "mill-3axis", "linuxcnc", "plain", wrapped(ToolpathBuilder, "event", flooded)),
    "point dropped": (NX, "mill-3axis", "linuxcnc", "plain", path_changed(moved({5: (4, 6)}))),
    "points exchanged": (NX, "mill-3axis", "linuxcnc", "plain", path_changed(moved({4: 5, 5: 4}))),
    "point moved by 0.02 mm": (NX, "mill-3axis", "linuxcnc", "plain",
                               path_changed(lambda p: replace(p, tip=p.tip + np.array([0.0, 0.02, 0.0])))),
    "cut as rapid": (NX, "mill-3axis", "linuxcnc", "plain", path_changed(kinds(6, Kind.RAPID))),
    "rapid as cut": (NX, "mill-3axis", "linuxcnc", "plain", path_changed(kinds(7, Kind.FEED))),
    "GODLTA in the other direction": (NX, "mill-3axis", "linuxcnc", "plain",
                             wrapped(toolpaths.cl.assemble, "_add_deltas", delta_turned)),
    "tool axis of all points as the first": (FIVE, "mikron-ucp710", "linuxcnc", "turned", path_changed(
        lambda p: replace(p, axis=np.tile([0.0, 0.0, 1.0], (len(p), 1))))),
    "tool axis mirrored": (FIVE, "mikron-ucp710", "linuxcnc", "turned",
                           path_changed(lambda p: replace(p, axis=p.axis * [1.0, -1.0, 1.0]))),
}


@pytest.fixture
def loaded_anew() -> Iterator[None]:
    """No machine that was loaded with a fault is kept for other tests."""
    yield
    machines_once.forget()


@pytest.mark.parametrize("name", FAULTS)
def test_a_planted_fault_is_found(name: str, loaded_anew: None, monkeypatch: Patch) -> None:
    *case, plant = FAULTS[name]
    unspoilt(*case)
    plant(monkeypatch)
    machines_once.forget()
    assert codes(converted(*case)), f"{name}: the second witness agrees with the fault"


def test_a_head_past_a_quarter_turn_is_no_fault() -> None:
    """The tool points down past the level there; the platform tilts as little as before."""
    kin, length = machines.load("h4a-spindle-axis").kinematics.with_tool(60.0), np.full(40, 60.0)
    rng = np.random.default_rng(3)
    space = kin.workspace
    pose = np.column_stack([rng.uniform(space.lower, space.upper, (40, 3)), rng.uniform(*space.tilt, 40)])
    q = kin.joints_at(pose, rng.uniform(1.7, 2.8, (40, 1)) * rng.choice([-1.0, 1.0], (40, 1)))
    tip, axis, _ = kin.pose(q)
    file = Path(machines.__file__).parent / "data" / "h4a-spindle-axis.toml"
    witness = rods_of_file(tomllib.loads(file.read_text("utf-8")))
    assert witness.misfit(q, kin.axis_names, tip, axis, length).max() < 1e-6
    assert witness.misfit(q, kin.axis_names, tip, axis + np.array([0.0, 1e-4, 0.0]), length).min() > 1e-3
