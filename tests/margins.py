"""What conversions of some rooms do not look for, since no test there sees it: each is looked for in all other rooms.

By how much the lengths of tools may differ is a sixth of a conversion. It is looked at where it is made and proved
(`postproc/verification`), in all other rooms (reports, pages), and in what rooms share (`kit.sample`). The second witness
is another sixth. It hears every conversion on every machine and control, of modes and registers of controls, of compiled
and written programs, of jobs, hints and pages, and those that rooms share; not those of rooms which choose axes, places and
times, look at one part of the road by other means, or write reports, nor where LinuxCNC itself reads the program. The bound
between the places at which blocks are held to the file is a sixth of a small conversion too. It is proved on every machine
and control, in the rooms of read-back, verification, proof and witness where tests are about it, and in what rooms share; in
the others blocks are held to the file at places alone.

Drawings are laid out and have their full number of dots in the tests of drawings; elsewhere panels stay where the grid puts
them, which moves no text, and are rough. What a model of errors does is looked at at few places of the travel.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from machines.geometric_error.exchange import exports, survey
from postproc.pipeline import stages
from postproc.readback.comparison import compare
from postproc.readback.comparison.bound_search import DeviationBound
from postproc.readback.comparison.compare import bound_of_blocks
from postproc.verification import length_limits, read_back, second_witness
from postproc.witness.evidence import Testimony
from toolpaths import drawing

TESTS = Path(__file__).parent
ROOMS = frozenset({TESTS / "hints", TESTS / "linuxcnc", *(TESTS / "postproc" / room for room in (
    "alignment", "batch", "cli", "collision", "compile", "control", "controllers", "correction", "cycle_time", "differences",
    "job", "joints", "orientation", "path", "pipeline", "placement", "planning", "readback", "reference", "report",
    "setup_sheet", "time_study", "witness", "writing"))})
SEEN = frozenset({"test_golden_programs.py", "test_next_modes.py"})
"""files of these rooms that show them"""
UNHEARD = frozenset({TESTS / "hints", TESTS / "linuxcnc", *(TESTS / "postproc" / room for room in (
    "alignment", "batch", "cli", "collision", "controllers", "correction", "cycle_time", "differences", "dossier", "joints",
    "orientation", "path", "placement", "planning", "readback", "reference", "report", "setup_sheet", "time_fit",
    "time_study"))})
"""rooms whose conversions the second witness does not hear"""
HEARD = frozenset({"test_compensation_points.py", "test_corrected_legs.py", "test_deviation_bound.py",
                   "test_fed_retracts.py", "test_links_in_plane.py", "test_program_mutation.py",
                   "test_retract_levels_of_holes.py", "test_shared_tables.py", "test_spin_plan.py", "test_split_plan.py",
                   "test_turning_axes.py", "test_turning_corners.py"})
"""files of these rooms that show what it says"""
UNBOUNDED = UNHEARD | {TESTS / "postproc" / room for room in (
    "compile", "control", "feedrate", "job", "joints", "page", "pipeline", "python", "setup", "writing")}
"""rooms whose conversions are held to the tolerance at places alone: no test there looks at the bound between them"""
BOUNDED = HEARD | {"test_align.py", "test_cheap_bounds_read_back.py", "test_cli.py", "test_compensation.py",
                   "test_controller_rules.py", "test_deviation_bound.py", "test_deviations_and_rewinds.py",
                   "test_every_machine_and_control.py", "test_golden_programs.py", "test_joint_samples.py",
                   "test_machines_of_the_catalogue.py", "test_optimised.py", "test_orientation_proved.py",
                   "test_own_kinds.py", "test_report_command.py", "test_residuals.py", "test_tip_programs_of_legs.py",
                   "test_whole_conversions.py", "test_worst_place.py"}
"""files of these rooms that show it"""
NAME, WITNESS, BOUND = "length_margins", "second_witness", "bound_of_blocks"
DRAWN = frozenset({"test_drawing.py", "test_sheet.py", "test_run.py"})
"""files that look at how drawings are laid out, and at the same bytes of processes of their own"""
UNDRAWN = frozenset({TESTS / "hints", TESTS / "docs", TESTS / "postproc" / "dossier"})
"""rooms that look at no picture: sheets are filled and written with their titles, panels are left out"""
ROUGH = 40
"""dots per inch"""
PLACES = 1000
"""at which a model of errors is looked at, 20,000 in use"""


def _none(*given: Any) -> tuple[()]:
    return ()


def _as_put(sheet: Any) -> None:
    """In the place of the layout that gives panels as much room as their texts need."""
    sheet.set_layout_engine("none")


def _without_panels(sheet: Any) -> None:
    """A sheet whose panels are not drawn."""
    _as_put(sheet)
    for panel in sheet.axes:
        panel.set_visible(False)


def _silent(*given: Any) -> tuple[Testimony, list[Any]]:
    return Testimony((), ()), []


def _no_bound(motion: Any, executed: Any, moves: Any, owner: Any, *given: Any, **named: Any) -> DeviationBound:
    """Of no block is anything found; none is said to have no bound."""
    return DeviationBound(0.0, 0.0, -1, -1, 0, whole=np.full((2, int(moves.run_by(owner).sum())), np.inf))


@pytest.fixture(autouse=True, scope="module")
def lengths_looked_at_where_they_are_seen(request: pytest.FixtureRequest) -> Iterator[None]:
    """For every file of tests; the second witness and drawings too."""
    room, name = request.path.parent, request.path.name
    with pytest.MonkeyPatch.context() as patch:
        if name not in DRAWN:
            patch.setattr(drawing, "_settle", _without_panels if room in UNDRAWN else _as_put)
            patch.setattr(drawing, "DOTS", ROUGH)
        patch.setattr(survey, "PLACES", PLACES)
        patch.setattr(exports, "WORST_PLACES", PLACES)
        if room in ROOMS and name not in SEEN:
            patch.setattr(read_back, NAME, _none)
        if room in UNHEARD and name not in HEARD:
            patch.setattr(stages, WITNESS, _silent)
        if room in UNBOUNDED and name not in BOUNDED:
            patch.setattr(compare, BOUND, _no_bound)
        yield


@contextmanager
def looked_at() -> Iterator[None]:
    """For results that other rooms see too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(read_back, NAME, length_limits.length_margins)
        patch.setattr(stages, WITNESS, second_witness.second_witness)
        patch.setattr(compare, BOUND, bound_of_blocks)
        yield
