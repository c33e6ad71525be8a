"""Every sample on every machine: LinuxCNC's interpreter reads from our text what we meant and what we read back."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from postproc.pipeline.result import PostResult
from postproc.readback.comparison.checks import block_seconds
from postproc.setup.model import PartPlacement, SetupFile, ToolSetup, load_setup
from tests.linuxcnc import outputs
from tests.linuxcnc.interpreter import Move
from tests.linuxcnc.outputs import Output
from tests.postproc.kit import few_sides
from toolpaths.arrays import Floats
from toolpaths.toolpath import Toolpath

SAMPLES = Path("samples")
EXACT = 1e-9
"""mm and degrees"""
ROUNDED = 1e-4
"""mm and degrees: half a last decimal of a word, and what the rounding of an angle does to the slides"""
RESIDUE = 2e-4
"""mm: shorter X, Y, Z moves next to a rotary one would set its speed"""
MADE = {"bicubic.cls": ("mill-3axis", "planar-delta-z"), "blade.cls": ("linuxcnc-xyzbc-trt",),
        "five_faces.cls": ("trunnion-bc",), "five_tilted.cls": ("nutating-head",),
        "h4a_dome.cls": ("mikron-ucp710",), "h4a_indexed.cls": ("head-table",),
        "inch_plate.apt": ("rotary-delta", "triaglide", "delta-cone", "delta-hybrid"),
        "indexed_4axis.cls": ("mill-4axis",),
        "pocket.cls": ("uranesx", "linuxcnc-lineardelta", "tilting-arms-c-table"),
        "test_part.cls": ("delta-parallel-x",),
        "tool_axis_tour.apt": ("linuxcnc-xyzac-trt", "fork-head-ab")}
"""machines on which each sample is made: every sample, with MORE every machine whose letters LinuxCNC's interpreter has"""
ORIGINS = {"planar-delta-z": (-41.0, -30.0, -125.0), "rotary-delta": (-40.0, -30.0, -200.0),
           "triaglide": (-40.0, -30.0, -200.0),
           "tilting-arms-c-table": (0.0, 0.0, -270.0), "three-arms-three-slides": (0.0, 0.0, -270.0)}
"""mm, of the part on machines in whose middle it has no room"""
PLATE = (-40.0, -30.0, -230.0)
"""mm, of the plate on Deltas"""
LONG = ("tilting-arms-c-table", "three-arms-three-slides", "linuxcnc-lineardelta")
"""machines that need many blocks: without the helices of the pocket"""
MORE = {"bicubic.cls": ("uranesx",), "blade.cls": ("head-table",),
        "five_faces.cls": ("mikron-ucp710", "linuxcnc-xyzac-trt"),
        "five_tilted.cls": ("fork-head-ab", "linuxcnc-xyzbc-trt"),
        "inch_plate.apt": ("nutating-head", "mill-4axis", "delta-coplanar", "delta-parallel-x-compact", "delta-parallel-z",
                           "delta-parallel-z-compact", "delta-star", "delta-perpendicular", "linear-delta-ac", "tricept"),
        "pocket.cls": ("mill-3axis", "mikron-ucp710", "rotary-delta", "triaglide", "delta-cone", "delta-coplanar",
                       "delta-hybrid", "three-arms-three-slides"),
        "test_part.cls": ("mill-3axis", "trunnion-bc", "delta-parallel-x-compact", "delta-parallel-z",
                          "delta-parallel-z-compact", "delta-star")}
"""further ones, with -m slow"""
CODES = {73, 81, 82, 83, 84, 85, 86, 89}

CYCLES = """PARTNO CYCLES
UNITS/MM
LOADTL/1
SPINDL/RPM,900,CLW
COOLNT/FLOOD
RAPID
GOTO/0,0,30,0,0,1
CYCLE/DRILL,DEPTH,8,CLEAR,2,MMPM,100
GOTO/0,0,0
GOTO/10,0,0
CYCLE/DRILL,DEPTH,8,CLEAR,2,MMPM,100,DWELL,0.5
GOTO/20,0,0
GOTO/20,10,-3
CYCLE/DEEP,DEPTH,9,STEP,2,CLEAR,2,MMPM,80
GOTO/10,10,0
GOTO/0,10,0
CYCLE/BRKCHP,DEPTH,7,STEP,3,CLEAR,2,MMPM,80
GOTO/0,20,0
CYCLE/BORE,DEPTH,8,CLEAR,2,MMPM,60
GOTO/10,20,0
CYCLE/OFF
FEDRAT/200,MMPM
GOTO/20,20,5
GOTO/30,20,5
RAPID
GOTO/30,20,50
SPINDL/OFF
FINI
"""


def samples() -> list[str]:
    return sorted(p.name for p in SAMPLES.iterdir() if p.suffix in (".cls", ".apt"))


def setup_file() -> SetupFile:
    setup, _ = load_setup(SAMPLES / "tools.setup.toml")
    assert setup is not None
    return setup


def convert(path: Toolpath, found: list, machine: str, setup: SetupFile | None = None,
            feed_mode: str = "auto") -> PostResult:
    return postproc.convert(path, machines.load(machine), "linuxcnc", setup or setup_file(),
                            postproc.Options(feed_mode=feed_mode), found)


def all_outputs(interpret, sample: str, names: tuple[str, ...]) -> list[Output]:
    """The sample on each of the machines."""
    found: list[Any] = []
    plate = sample == "inch_plate.apt"
    made = [convert(few_sides(sample, (1, 2) if sample == "pocket.cls" and name in LONG else None), found, name,
                    setup_file().model_copy(update={"part": PartPlacement(
                        origin=PLATE if plate and name.startswith("delta") else ORIGINS.get(name, (0.0, 0.0, 0.0)))}))
            for name in names]
    assert all(r.ok for r in made), [(r.machine.name, [str(d) for d in r.diagnostics]) for r in made if not r.ok]
    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(lambda r: outputs.output(r, interpret), made))


def check(o: Output) -> None:
    """Everything that the three readings share."""
    assert o.canonical.error == ""
    check_motion(o)
    check_feeds(o)
    check_program(o)
    check_states(o)
    check_text(o)


def check_motion(o: Output) -> None:
    c, m, rows = o.canonical, o.motion, o.moves
    np.testing.assert_array_equal(c.line[rows], m.line)
    np.testing.assert_array_equal(c.kind[rows], m.code)
    sure = outputs.known(o)
    off = np.abs(c.machine[rows][:, o.columns] - m.end)
    assert off[sure].max() < EXACT
    assert sure.mean() > 0.9 and sure[:, o.machine.rotary].all()
    arcs, ours, theirs = outputs.centers(o)
    assert np.abs(ours - theirs).max(initial=0.0) < EXACT
    np.testing.assert_array_equal(c.turn[rows[arcs]] > 0, m.ccw[arcs])
    np.testing.assert_array_equal(c.plane[rows[arcs]], m.plane[arcs])


def check_feeds(o: Output) -> None:
    """F words, and the time that LinuxCNC gives each block: tiny residues of X, Y, Z would spoil it under G93."""
    c, m, rows = o.canonical, o.motion, o.moves
    cut = m.code > 0
    np.testing.assert_array_equal(c.inverse[rows[cut]], m.inverse[cut])
    minute = cut & ~m.inverse
    np.testing.assert_allclose(c.feed[rows[minute]], m.feed[minute], rtol=1e-12)
    assert o.result.job is not None
    ours = block_seconds(m, o.result.job.control)[cut]
    theirs = c.seconds[rows[cut]]
    moved = np.isfinite(theirs) & (ours > 0.0)
    np.testing.assert_allclose(theirs[moved], ours[moved], rtol=1e-7, atol=1e-9)


def check_program(o: Output) -> None:
    """The canonical Program block for block; canned cycles by their bottoms and by where they leave the tool."""
    p, c = o.result.program, o.canonical
    assert p is not None
    cycle_lines = np.unique(o.motion.line[o.motion.hole])
    assert len(cycle_lines) == len(p.holes)
    single = np.ones(len(p), dtype=bool)
    for hole in p.holes:
        single[hole.first:hole.last + 1] = False
    alone = ~o.motion.hole
    rows = o.moves[alone]
    assert len(rows) == single.sum()
    theirs = np.where(p.home[single][:, None], c.machine[rows][:, o.columns], c.pos[rows][:, o.columns])
    noted = outputs.known(o)[alone] & (p.write[single] | ~p.home[single][:, None])
    assert np.abs(theirs - p.words[single])[noted].max() < EXACT
    np.testing.assert_array_equal(c.kind[rows], p.code[single])
    z = int(o.result.job.control.xyz[2]) if o.result.job else 2
    for line, hole in zip(cycle_lines, p.holes, strict=True):
        legs = c.pos[o.moves[o.motion.line == line]][:, o.columns]
        assert legs[:, z].min() == pytest.approx(hole.bottom, abs=EXACT)
        np.testing.assert_allclose(legs[-1], p.words[hole.last], rtol=0, atol=EXACT)


def check_states(o: Output) -> None:
    c, m, rows, p = o.canonical, o.motion, o.moves, o.result.program
    assert p is not None
    theirs = outputs.states(c)
    np.testing.assert_array_equal(c.tool[rows], np.maximum(m.tool, 0))
    for name, ours in (("spindle", m.spindle), ("flood", m.flood), ("mist", m.mist)):
        np.testing.assert_array_equal(theirs[name][rows], ours)
    turning = m.spindle != 0
    np.testing.assert_allclose(theirs["rpm"][rows][turning], m.rpm[turning], rtol=0, atol=1e-4)
    ours_in_order = [x.name for k in sorted(p.commands) for x in p.commands[k]]
    called = outputs.commands(o)
    assert called == [name for name in ours_in_order if name in set(called)]
    dwells = [x.args[0] for k in sorted(p.commands) for x in p.commands[k] if x.name == "DWELL"]
    inside = np.isin(c.line, m.line[m.hole])
    assert c.seconds[(c.kind == Move.DWELL) & ~inside].tolist() == pytest.approx(dwells)


def check_text(o: Output) -> None:
    """What LinuxCNC punishes: long lines, G93 without F or with a cycle, a cycle's code changed without its words."""
    lines, w = o.lines, o.words
    assert max(map(len, lines)) <= 252
    assert lines[-2:] == ["M2", "%"] and lines[1] == "%"
    m = o.motion
    cutting = np.unique(m.line[(m.code > 0) & m.inverse])
    assert np.isin(cutting, w.line[w.letter == ord("F")]).all()
    assert not m.inverse[m.hole].any()
    code = 0
    for line in np.unique(m.line[m.hole]).tolist():
        stated = {(chr(k), float(v)) for k, v in zip(w.letter[w.line == line], w.value[w.line == line], strict=True)}
        cycle = next((int(v) for k, v in stated if k == "G" and v in CODES), code)
        if cycle != code:
            assert {"Z", "R", "F"} <= {k for k, _ in stated} and (cycle not in (73, 83) or "Q" in {k for k, _ in stated})
        code = cycle


@pytest.mark.parametrize(("sample", "names"), [
    *MADE.items(), *(pytest.param(*pair, marks=pytest.mark.slow) for pair in MORE.items())],
    ids=lambda v: v if isinstance(v, str) else f"{len(v)} machines")
def test_linuxcnc_reads_what_we_meant(interpret, sample: str, names: tuple[str, ...]) -> None:
    for o in all_outputs(interpret, sample, names):
        try:
            check(o)
        except AssertionError as fault:
            raise AssertionError(f"{sample} on {o.machine.name}: {fault}") from fault


def test_every_machine_that_the_interpreter_can_be_makes_a_sample() -> None:
    readable = {name for name in machines.names() if outputs.has_letters(machines.load(name))
                and machines.load(name).kinematics.plane is None}  # no sample stays in a plane
    made = {name for names in (*MADE.values(), *MORE.values()) for name in names}
    assert set(MADE) == set(samples()) and made == readable


@pytest.mark.parametrize("machine", ["mill-3axis", "mikron-ucp710", "linuxcnc-xyzac-trt"])
def test_every_cycle(interpret, tmp_path: Path, machine: str) -> None:
    (tmp_path / "cycles.apt").write_text(CYCLES)
    result = convert(*toolpaths.read(tmp_path / "cycles.apt"), machine)
    assert result.ok, result.diagnostics
    o = outputs.output(result, interpret)
    check(o)
    said = set(o.words.value[(o.words.letter == ord("G")) & np.isin(o.words.value, list(CODES))].astype(int).tolist())
    assert said == {81, 82, 83, 73, 85}


@pytest.mark.covering
@pytest.mark.parametrize("machine", ["mikron-ucp710", "linuxcnc-xyzac-trt"])
@pytest.mark.parametrize("sample", ["tool_axis_tour.apt", "five_tilted.cls", "blade.cls"])
def test_inverse_time_everywhere(interpret, machine: str, sample: str) -> None:
    """Every feed block by its time; LinuxCNC's least rate of 0.1 mm/min and tiny residues show in its times."""
    result = convert(*toolpaths.read(SAMPLES / sample), machine, feed_mode="inverse-time")
    assert result.ok, result.diagnostics
    o = outputs.output(result, interpret)
    assert o.motion.inverse[(o.motion.code > 0) & ~o.motion.hole].mean() > 0.9
    check(o)


def test_no_tiny_residues_next_to_a_turn(interpret, tmp_path: Path) -> None:
    """The tool turns about a point 2 um off the C axis: X and Y would move by tenths of a micron with C."""
    turn = np.radians(np.arange(0, 121, 4))
    points = [f"GOTO/0.002,0,0,{0.5 * np.cos(a):.9f},{0.5 * np.sin(a):.9f},{np.sqrt(0.75):.9f}" for a in turn]
    (tmp_path / "turn.apt").write_text("\n".join(["PARTNO TURN", "UNITS/MM", "LOADTL/1", "SPINDL/RPM,900,CLW", "MULTAX/ON",
                                                  "RAPID", points[0], "FEDRAT/500,MMPM", *points[1:], "FINI", ""]))
    result = convert(*toolpaths.read(tmp_path / "turn.apt"), "mikron-ucp710")
    assert result.ok, result.diagnostics
    o = outputs.output(result, interpret)
    check(o)
    step = np.abs(np.diff(o.motion.end, axis=0))[o.motion.inverse[1:] & (o.motion.code[1:] > 0)]
    linear = step[:, ~np.array(o.machine.rotary)].max(axis=1)
    assert len(step) >= len(turn) - 1
    assert ((linear == 0.0) | (linear > RESIDUE)).all()


SHORT = {str(k): ToolSetup(gauge_length=v) for k, v in ((1, 41.25), (2, 35.5), (3, 50.0))}
"""Tools with which the raised part stays inside the travel of every machine."""
TURNED = PartPlacement(origin=(30.0, -20.0, 40.0), x_axis=(np.cos(np.pi / 6), 0.5, 0.0),
                       y_axis=(-0.5, np.cos(np.pi / 6), 0.0))


@pytest.mark.covering
@pytest.mark.parametrize("machine", ["mikron-ucp710", "linuxcnc-xyzac-trt", "trunnion-bc", "fork-head-ab", "head-table"])
@pytest.mark.parametrize("system", [0, 1])
def test_machine_coordinates_are_our_joints(interpret, machine: str, system: int) -> None:
    """A placed and turned part under a work offset of its own: LinuxCNC's machine coordinates are the planned joints."""
    path, found = toolpaths.read(SAMPLES / "five_tilted.cls")
    name = path.frames[system].name
    setup = setup_file().model_copy(update={"part": TURNED, "work_offset": name, "tools": SHORT})
    result = convert(path, found, machine, setup)
    assert result.ok, result.diagnostics
    o = outputs.output(result, interpret)
    check(o)
    check_joints(o)


def check_joints(o: Output) -> None:
    """Machine coordinates of LinuxCNC against the joints of the Path, through our kinematics with the tool."""
    path, job, c = o.result.path, o.result.job, o.canonical
    assert path is not None and job is not None and o.result.program is not None
    assert np.any(np.abs(job.control.work_offset[job.control.xyz]) > 1.0)
    alone = np.flatnonzero(~o.motion.hole & outputs.known(o).all(axis=1))
    rows = o.moves[alone]
    joints = c.machine[rows][:, o.columns]
    for h in np.unique(o.motion.register[alone]) if job.control.tip_law else ():
        k = np.flatnonzero(o.motion.register[alone] == h)
        joints[k] = slides_at(joints[k], o, job.register_lengths().get(int(h), 0.0))
    planned = path.q * job.control.unit
    nearest = np.min(np.abs(joints[:, None, :] - planned[None, :, :]).max(axis=2), axis=1)
    assert nearest.max() < ROUNDED


def slides_at(world: Floats, o: Output, length: float) -> Floats:
    """Joints (N, J) at which the tool's tip stands at world - length on Z, rotary words as they are."""
    assert o.result.job is not None
    control, kin = o.result.job.control, o.machine.kinematics.with_tool(length)
    q = world / control.unit
    q[:, control.slides] = 0.0
    tip = world[:, control.xyz] - np.array([0.0, 0.0, length])
    columns = kin.jacobian(q)[:, :3][:, :, control.slides]
    q[:, control.slides] = np.linalg.solve(columns, (tip - kin.forward(q)[0])[..., None])[..., 0]
    return np.asarray(q * control.unit)


def test_offset_in_the_header_is_the_one_used() -> None:
    path, found = toolpaths.read(SAMPLES / "five_tilted.cls")
    result = convert(path, found, "mikron-ucp710",
                     setup_file().model_copy(update={"part": TURNED, "tools": SHORT}))
    line = next(line for line in result.text.splitlines() if line.startswith("(work offset G54"))
    stated = [float(word[1:]) for word in line.strip("()").split()[-5:]]
    assert result.job is not None
    np.testing.assert_allclose(stated, result.job.control.work_offset, atol=5e-5)


@pytest.mark.parametrize("machine", ["mill-3axis", "mikron-ucp710"])
def test_a_program_in_inches_is_the_motion_that_we_meant(interpret, tmp_path: Path, machine: str) -> None:
    """Every cycle, and a blade by inverse time: the interpreter goes where our reader does, at the feeds that we meant."""
    (tmp_path / "cycles.apt").write_text(CYCLES)
    setup = setup_file()
    setup = setup.model_copy(update={"output": setup.output.model_copy(update={"units": "inch"})})
    for file in (tmp_path / "cycles.apt", SAMPLES / ("pocket.cls" if machine == "mill-3axis" else "blade.cls")):
        path, found = toolpaths.read(file)
        result = postproc.convert(path, machines.load(machine), "linuxcnc", setup, diagnostics=found)
        assert result.ok and "G20 " in result.text, result.diagnostics
        o = outputs.output(result, interpret)
        c, m = o.canonical, o.motion
        theirs = c.machine[o.moves][:, o.columns]
        assert len(theirs) == len(m.end) and np.abs(theirs - m.end)[outputs.known(o)].max() < ROUNDED
        cut = m.code > 0
        assert o.result.job is not None
        ours = block_seconds(m, o.result.job.control)[cut]
        seconds = c.seconds[o.moves[cut]]
        timed = np.isfinite(seconds) & (ours > 0.0)
        np.testing.assert_allclose(seconds[timed], ours[timed], rtol=1e-5, atol=1e-7)
        assert timed.sum() > 10
