"""Corrected programs of every control, read and put on the machine with errors a second time, against the CL file.

The words are read by `independent_reader`, the machine and its errors come from their files by
`independent_machine`; of the product only the CL points and the bound that it prints are taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

import postproc
from postproc.base.options import Options
from postproc.pipeline.result import PostResult
from postproc.reference.holes import Phase
from postproc.verification.residual_errors import after_formatting
from tests.machines.independent_machine import Errors, Machine
from tests.machines.random_error_files import Draw
from tests.postproc.independent_reader import End, read
from tests.postproc.kit import few_sides
from toolpaths.arrays import Floats, Ints
from toolpaths.toolpath import Kind
from toolpaths.units import DEG

Case = tuple[str, str, str, str, int]
"""sample, machine, controller, output mode, seed of the errors"""
ARCSEC = DEG / 3600.0
SAMPLES = Path(__file__).parents[3] / "samples"
ARM = 30.0
"""mm: how far along the tool a second point is looked at when positions are compared"""
SAME = 2e-6
"""mm: two readings of one program"""

CASES: list[Case] = [
    ("five_faces.cls", "mikron-ucp710", "linuxcnc", "auto", 10),
    ("five_faces.cls", "mikron-ucp710", "fanuc-30i", "auto", 11),
    ("five_tilted.cls", "trunnion-bc", "siemens-840d", "auto", 12),
    ("five_faces.cls", "head-table", "heidenhain-tnc640", "auto", 13),
    ("five_faces.cls", "mikron-ucp710", "haas-ngc", "auto", 11),
    ("tool_axis_tour.apt", "trunnion-bc", "fanuc-30i", "tcp", 14),
    ("tool_axis_tour.apt", "mikron-ucp710", "siemens-840d", "auto", 10),
    ("tool_axis_tour.apt", "linuxcnc-xyzac-trt", "heidenhain-tnc640", "tcp", 12),
    ("tool_axis_tour.apt", "fork-head-ab", "haas-ngc", "auto", 13),
    ("tool_axis_tour.apt", "nutating-head", "linuxcnc", "auto", 12),
    ("indexed_4axis.cls", "mill-4axis", "linuxcnc", "auto", 11),
    ("inch_plate.apt", "mill-3axis", "siemens-840d", "auto", 11),
    ("inch_plate.apt", "uranesx", "linuxcnc", "auto", 11),
    ("h4a_indexed.cls", "h4a-c-table", "linuxcnc", "auto", 12),
    ("h4a_indexed.cls", "h4a-spindle-axis", "generic-iso", "auto", 11),
    ("indexed_4axis.cls", "mill-4axis", "siemens-840d", "tcp", 11),  # holes from below
    ("pocket.cls", "mikron-ucp710", "heidenhain-tnc640", "tcp", 13),  # helices one after the other
    ("tool_axis_tour.apt", "nutating-head", "fanuc-30i", "axes", 11),  # a rewind
    ("pocket.cls", "head-table", "fanuc-30i", "auto", 13),  # holes next to a steep error
    ("pocket.cls", "mill-4axis", "haas-ngc", "auto", 12),  # holes whose levels need unlike corrections
]
AGAIN = (CASES[0], CASES[1], CASES[2], CASES[3], CASES[4], CASES[6], CASES[7], CASES[9], CASES[10], CASES[14], CASES[15])
"""samples, machines and controls that other cases hold: with -m slow"""


HOLES = (2,)
"""operations of the pocket in cases that are about its holes"""
SIDES = {18: HOLES, 19: HOLES, 13: (0, 1, 4)}
"""operations of a case's sample, where fewer show it"""


def each(cases: list[Case]) -> list[Any]:
    return [pytest.param(case, marks=pytest.mark.slow if case in AGAIN else ()) for case in cases]


def name(case: Case) -> str:
    return "-".join(map(str, case))


@dataclass(frozen=True)
class Run:
    """A conversion, its own machine with errors, and at which of the program's ends each CL point is reached.

    Attributes:
        rows: (P,) moves of the CL file whose ends are cut to: ends of feeds, bottoms of holes
        at: (P,) numbers of the ends that are nearest, on the machine with errors
        tip, axis: (P,) mm and rad off
    """

    result: PostResult
    own: Machine
    ends: list[End]
    rows: Ints
    at: Ints
    tip: Floats
    axis: Floats


def run_of(result: PostResult, own: Machine, errors: Errors, controller: str) -> Run:
    assert result.ok and result.job is not None, [str(d) for d in result.diagnostics]
    lengths = {int(k): v.gauge_length for k, v in result.setup.tools.items()}
    ends = [end for end in read(result.text, controller, own, lengths) if end.tool > 0.0 and end.cuts]
    moves = result.job.moves.without_pecks()
    rows = np.flatnonzero((moves.kind != Kind.RAPID) & ((moves.hole < 0) | (moves.phase == Phase.DRILL)))
    wanted, nominal = np.hstack([moves.tip[rows], ARM * moves.axis[rows]]), np.empty((len(ends), 6))
    for tool in {end.tool for end in ends}:
        k = [k for k, end in enumerate(ends) if end.tool == tool]
        nominal[k] = np.hstack(result.machine.kinematics.with_tool(tool).forward(np.array([ends[i].q for i in k])))
    arm = np.repeat([1.0, ARM], 3)
    away, few = cKDTree(nominal * arm).query(wanted, k=3)  # the machine with errors is not far from there
    real = np.full((len(ends), 6), np.inf)

    def posed(which: Ints) -> None:
        for k in np.unique(which).tolist():
            real[k] = np.concatenate(own.pose(ends[k].q, ends[k].tool, errors, near=nominal[k]))

    posed(few[:, 0])
    reached = np.unique(few[:, 0])
    moved = np.linalg.norm((real[reached] - nominal[reached]) * arm, axis=1).max()
    posed(np.setdiff1d(few[away <= away[:, :1] + 4.0 * moved], reached))  # farther ones cannot be the nearest
    off = np.linalg.norm(real[few] * np.repeat([1.0, ARM], 3) - wanted[:, None], axis=2)
    at = few[np.arange(len(few)), off.argmin(axis=1)]
    return Run(result, own, ends, rows, at, np.linalg.norm(real[at, :3] - moves.tip[rows], axis=1),
               np.linalg.norm(real[at, 3:] - moves.axis[rows], axis=1))


@cache
def converted(case: Case, corrected: bool = True) -> Run:
    sample, machine, controller, mode, seed = case
    own = Machine(machine)
    setup = "h4a" if machine.startswith("h4a") else "delta" if machine == "uranesx" else "tools"
    with TemporaryDirectory() as folder:
        file = Draw(Path(folder), own, seed).write()
        shop = Path(folder) / "shop.toml"
        usual = (SAMPLES / f"{setup}.setup.toml").read_text("utf-8")
        shop.write_text(f"{usual}\n[output]\nrapids_as_feed = true\n", "utf-8")
        options = Options(setup=str(shop), output=mode,
                          error_model=str(file) if corrected else "")
        result = postproc.convert(few_sides(sample, SIDES.get(CASES.index(case))), machine, controller, options=options)
        return run_of(result, own, Errors(file), controller)


@pytest.mark.parametrize("case", each(CASES), ids=name)
def test_the_second_reading_finds_the_points_inside_the_printed_bound(case: Case) -> None:
    """What the product's own read-back finds is what this one finds."""
    run = converted(case)
    noted = after_formatting(run.result)
    assert noted is not None and len(run.tip) == len(noted.tip)
    assert run.tip.max() <= noted.tip_bound + SAME and run.tip.max() == pytest.approx(noted.tip.max(), abs=SAME)
    assert run.axis.max() <= noted.axis_bound + 0.01 * ARCSEC


@pytest.mark.parametrize("case", [CASES[0], CASES[3], *(case for case in CASES if case[1] == "uranesx")], ids=name)
def test_without_correction_the_points_are_as_far_off_as_is_reported(case: Case) -> None:
    found, bare = converted(case).result.compensation, converted(case, corrected=False)
    assert found is not None and 0.01 < bare.tip.max() <= found.tip_before + 1e-3


@pytest.mark.parametrize("case", each([c for c in CASES if c[0].startswith(("five", "h4a_indexed"))]), ids=name)
def test_rotary_axes_stand_still_where_the_tool_axis_does(case: Case) -> None:
    """At neighbouring CL points of one orientation the words of the rotary axes are the same, to the last decimal."""
    run = converted(case)
    assert run.result.job is not None
    axis = run.result.job.moves.without_pecks().axis[run.rows]
    turning = [k for k, letter in enumerate(run.own.letters) if letter in "ABC"]
    rotary = np.array([run.ends[k].q[turning] for k in run.at])
    same = (axis[1:] == axis[:-1]).all(axis=1)
    assert same.sum() > 8 and np.array_equal(rotary[1:][same], rotary[:-1][same])
