"""What conversions of some rooms do not look for, since no test there sees it: each is looked for in all other rooms.

By how much the lengths of tools may differ is a sixth of a conversion. It is looked at where it is made and proved
(`postproc/verification`), in all other rooms (reports, pages), and in what rooms share (`kit.sample`). The second witness
is another sixth. It hears every conversion on every machine and control, of modes and registers of controls, of compiled
and written programs, of jobs, hints and pages, and those that rooms share; not those of rooms which choose axes, places and
times, look at one part of the road by other means, or write reports, nor where LinuxCNC itself reads the program.

Drawings are laid out and have their full number of dots in the tests of drawings; elsewhere panels stay where the grid puts
them, which moves no text, and are rough. What a model of errors does is looked at at few places of the travel.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from machines.geometric_error.exchange import exports, survey
from postproc.pipeline import stages
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
NAME, WITNESS = "length_margins", "second_witness"
DRAWN = frozenset({"test_drawing.py", "test_sheet.py", "test_run.py"})
"""files that look at how drawings are laid out, and at the same bytes of processes of their own"""
ROUGH = 40
"""dots per inch"""
PLACES = 1000
"""at which a model of errors is looked at, 20,000 in use"""


def _none(*given: Any) -> tuple[()]:
    return ()


def _as_put(sheet: Any) -> None:
    """In the place of the layout that gives panels as much room as their texts need."""
    sheet.set_layout_engine("none")


def _silent(*given: Any) -> tuple[Testimony, list[Any]]:
    return Testimony((), ()), []


@pytest.fixture(autouse=True, scope="module")
def lengths_looked_at_where_they_are_seen(request: pytest.FixtureRequest) -> Iterator[None]:
    """For every file of tests; the second witness and drawings too."""
    room, name = request.path.parent, request.path.name
    with pytest.MonkeyPatch.context() as patch:
        if name not in DRAWN:
            patch.setattr(drawing, "_settle", _as_put)
            patch.setattr(drawing, "DOTS", ROUGH)
        patch.setattr(survey, "PLACES", PLACES)
        patch.setattr(exports, "WORST_PLACES", PLACES)
        if room in ROOMS and name not in SEEN:
            patch.setattr(read_back, NAME, _none)
        if room in UNHEARD and name not in HEARD:
            patch.setattr(stages, WITNESS, _silent)
        yield


@contextmanager
def looked_at() -> Iterator[None]:
    """For results that other rooms see too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(read_back, NAME, length_limits.length_margins)
        patch.setattr(stages, WITNESS, second_witness.second_witness)
        yield
