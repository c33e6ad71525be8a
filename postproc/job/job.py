"""Everything that stands around one conversion: machine, controller, set-up, tools, the reference moves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from machines.hooks import HooksModel
from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.base.options import Options
from postproc.control.control import Control, InterpolationMode
from postproc.control.modes import OutputModes, Refused, output_modes
from postproc.control.rollover import rollovers
from postproc.control.word_grid import WordGrid, word_grid
from postproc.controllers.fitted import fitted
from postproc.controllers.model import ControllerFile
from postproc.job.held_tools import with_held_tools
from postproc.job.index_moves import indexed, plane_changes
from postproc.job.length_words import words_depend_on_length
from postproc.job.pivots import control_kinematics, errors_of_drives
from postproc.job.places import Place, at_all, modes_at, places_of
from postproc.job.program_names import program_number, work_offset
from postproc.job.rapids import safe_rapids
from postproc.job.records import job_records
from postproc.job.rounding import Rounding, helix_bound, rounding_bound, without_splines
from postproc.job.smoothing import SmoothingPlan, smoothing_plan
from postproc.job.tool_names import called_tools
from postproc.job.units import other_units, scaled_angles
from postproc.path.links import SafeSpace, safe_space
from postproc.reference.cutcom_of_tools import CutcomOfTool
from postproc.reference.events import register_changes, tool_changes
from postproc.reference.hole_depths import unfit_holes
from postproc.reference.largest_feed import limited_feeds
from postproc.reference.moves import Moves, build_moves
from postproc.reference.repeated import Repeated
from postproc.reference.split_operations import cut_operations
from postproc.reference.stated_feeds import without_feed
from postproc.reference.unnumbered_tools import measured_length
from postproc.setup.model import Placement, SetupFile, work_frame
from postproc.setup.system import upside_down
from toolpaths.arrays import Floats, Ints, distinct, repeated, shared, taken
from toolpaths.diagnostics import Diagnostic, Severity, error, info, warning
from toolpaths.toolpath import Frame, Kind, Role, Toolpath
from toolpaths.units import DEG

if TYPE_CHECKING:
    from machines.geometric_error.actual.model import ErrorModel


OF_SETUP = frozenset({"tool.number", "tool.same_number", "tool.length", "feed.missing", "spindle.not_started",
                      "spindle.no_speed", "spindle.surface_speed"})
"""codes of what a set-up answers: where nothing else is wrong all that is missing is reported at once"""


@dataclass(frozen=True)
class Job:
    """One CL file on one machine, ready to be solved or compared with.

    `commanded`: moves of the CL file in the table frame; `moves`: with rapids split that would leave their line.
    """

    toolpath: Toolpath
    machine: Machine
    controller: ControllerFile
    setup: SetupFile
    options: Options
    placement: Placement
    control: Control
    commanded: Moves
    moves: Moves
    space: SafeSpace
    modes: OutputModes
    errors: ErrorModel | None = None
    """geometric errors of the machine"""
    stated: tuple[tuple[int, str], ...] = ()
    """(tool number, what the set-up states of its spindle and coolant), where the CL file states none"""
    cutcom: tuple[CutcomOfTool, ...] = ()
    """the tools of the CL file that cut under CUTCOM"""
    places: tuple[Place, ...] = ()
    """where the part stands, one or several; `placement` and `setup` are those of the first"""
    repeats: Repeated | None = None
    """the rows of the path at each, where there are several"""

    @property
    def hooks(self) -> HooksModel:
        """Blocks of the shop, those of the set-up before those of the machine file."""
        return self.machine.hooks.under(self.setup.hooks)

    @property
    def stock(self) -> Floats:
        """(2, 3) least, greatest X, Y, Z (mm, first work offset, tables at 0) of the stock, else the cuts, 1 mm or more"""
        stated = self.stock_corners
        placed = (self.space.corners if stated is None else stated) - self.control.origin
        low, high = placed.min(axis=0), placed.max(axis=0)
        return np.stack([np.minimum(low, high - 1.0), high])

    @property
    def stock_corners(self) -> Floats | None:
        """(8 P, 3) corners of the set-up's stock in the table frame, at all places; None without."""
        box = self.setup.rewind.stock
        return None if box is None else np.concatenate([place.placement.points(box.corners) for place in self.places])

    @property
    def work_system(self) -> Frame:
        """The system of the CL file that is the work offset."""
        return work_frame(self.setup, self.toolpath)[0] or self.toolpath.frames[0]

    @property
    def axis_tolerance(self) -> float:
        """rad"""
        return self.options.axis_tolerance * DEG

    def gauge_length(self, index: int) -> float:
        """Gauge length of the tool of that index, mm; 0 where the set-up does not say."""
        return self.length_of(self.number_of(index))

    def offset_length(self, index: int) -> float:
        """mm that the length register of the tool of that index holds: its gauge length, 0 where the program calls none."""
        return self.gauge_length(index) if self.setup.output.tool_call else 0.0

    def number_of(self, index: int) -> int:
        """Number of the tool of that index; -1 without one. Where none is called that of the one tool, else 0."""
        return self.toolpath.tools[index].number if index >= 0 else -1

    def length_of(self, number: int) -> float:
        """Gauge length of a tool by its number; where the program calls none, that of the tool in the spindle."""
        if not self.setup.output.tool_call:
            return measured_length(self.toolpath, self.setup)
        tool = self.setup.tools.get(str(number))
        return tool.length if tool else 0.0

    def kinematics(self, index: int) -> Kinematics:
        """The kinematics at the tip of the tool of that index."""
        return self.kinematics_of(self.number_of(index))

    def kinematics_of(self, number: int) -> Kinematics:
        """The kinematics at the tip of a tool by its number."""
        length = self.length_of(number)
        if length not in self._cache:
            self._cache[length] = self.machine.kinematics.with_tool(length)
        return self._cache[length]

    @cached_property
    def _cache(self) -> dict[float, Kinematics]:
        return {}

    def register_lengths(self) -> dict[int, float]:
        """Tool length by length register."""
        result = {}
        for change in (*tool_changes(self.toolpath), *register_changes(self.toolpath)):
            register = change.register if change.register is not None else change.number
            result[register] = self.length_of(change.number)
        return result

    def home_rows(self) -> frozenset[int]:
        """Moves whose link goes by home: the first, those after a tool change or GOHOME, and those whose link
        turns rotary axes where they are to be turned at home."""
        first = np.searchsorted(self.moves.row, [e.index for e in self.toolpath.events if e.word == "GOHOME"]
                                + [c.index for c in tool_changes(self.toolpath)])
        restart = self.operation_starts() if self.setup.output.apart else []
        if self.repeats is not None and self.setup.clearance.between == "home":
            restart = [*restart, *np.searchsorted(self.moves.row, self.repeats.begins).tolist()]
        return frozenset({0, *first.tolist(), *restart, *self.indexed_at_home()})

    @property
    def index_at_home(self) -> bool:
        """True where the retract axis stands at home while a link turns rotary axes."""
        return (self.setup.clearance.index or self.controller.links.index) == "home" and self.machine.retract_axis >= 0

    def indexed_at_home(self) -> list[int]:
        """The linked moves with another tool axis that go by home: all, or from and to planes ([modes.tilted] by_home)."""
        if self.index_at_home:
            return indexed(self.moves, self.axis_tolerance)
        mode = self.controller.modes.tilted
        if self.setup.clearance.index or not (mode and mode.by_home and self.machine.retract_axis >= 0):
            return []
        return plane_changes(self.moves, self.operation, self.modes, self.axis_tolerance)

    @cached_property
    def rounding(self) -> Rounding:
        """What the rounding of the words may cost, with that of the angles of helices."""
        found = rounding_bound(self.control, self.kinematics(int(self.moves.tool[0])), self.moves,
                               self.grid.grain, self.modes.cutting_laws(), self.options.tolerance)
        if not (self.controller.arcs.enabled and self.controller.arcs.helix_by_angle):
            return found
        angle = 10.0 ** -self.controller.format.rotary_decimals
        return replace(found, tip=found.tip + helix_bound(self.moves, self.controller.grain, angle, self.corrects))

    @cached_property
    def smoothing(self) -> SmoothingPlan:
        """The control's own smoothing by operation."""
        return smoothing_plan(self.controller, self.setup, self.options, self.toolpath, self.machine)[0]

    @cached_property
    def grid(self) -> WordGrid:
        """Decimals of the axis words, and the units of lengths."""
        return word_grid(self.control, self.controller)

    @cached_property
    def place(self) -> Ints:
        """(M,) number of the place of each move."""
        return repeated(np.int64(0), len(self.moves)) if self.repeats is None else self.repeats.place[self.moves.row]

    def control_at(self, place: int) -> Control:
        """The control with the work offset of a place."""
        return self.modes.at(place).control

    @property
    def corrects(self) -> bool:
        """True where the program corrects geometric errors."""
        return self.errors is not None and self.errors.corrected_by == "post"

    @cached_property
    def bidirectional(self) -> list[int]:
        """Joints that lose motion, where the program corrects it."""
        if self.errors is None or not self.corrects:
            return []
        return self.errors.axes.bidirectional(self.machine.axis_names)

    @cached_property
    def operation(self) -> Ints:
        """(M,) operation of each move."""
        return shared(taken(self.toolpath.operation, self.moves.row).astype(np.int64))

    def with_moves(self, moves: Moves) -> Job:
        """The job with these moves of the program; itself where they are its own, with all that it knows of them."""
        return self if moves is self.moves else replace(self, moves=moves)

    def operation_starts(self) -> list[int]:
        """The linked moves that operations begin with."""
        begins = np.concatenate([[True], np.diff(self.operation) != 0])
        return [int(k) for k in np.flatnonzero(begins & self.moves.link)]


def with_shop(controller: ControllerFile, machine: Machine, setup: SetupFile) -> ControllerFile:
    """The controller with its options, the codes of the shop's own blocks, the number of the program and its units."""
    passive = machine.hooks.under(setup.hooks).passive
    shop = fitted(controller, machine.options).with_shop(passive, setup.output.program_number)
    shop = shop.with_names({int(n): tool.called for n, tool in setup.tools.items() if tool.called})
    return shop.in_units(setup.output.units)


def prepare(toolpath: Toolpath, machine: Machine, controller: ControllerFile, setup: SetupFile,
            options: Options, refused: Refused = frozenset()) -> tuple[Job | None, list[Diagnostic]]:
    """The job (its path has plain records, see `plain_records`), or None and why there is none; `refused`:
    output modes that "auto" passes over. What arcs and chords in the place of splines take is off its tolerance."""
    options, found = without_splines(options, toolpath)
    machine = machine.on_control() if controller.kinematics.modules else machine
    records, diagnostics = job_records(toolpath, machine, controller, setup, options.setup)
    toolpath = records.toolpath
    diagnostics += [*found, *work_offset(controller, setup, options), *called_tools(controller, options.setup),
                    *other_units(controller, options.setup), *scaled_angles(controller, machine, options.setup),
                    *smoothing_plan(controller, setup, options, toolpath, machine)[1]]
    toolpath, found = cut_operations(toolpath, setup.output.longest)
    diagnostics += [*found, *program_number(toolpath, controller, setup, options)]
    diagnostics += [*unfit_holes(toolpath, controller), *_refused(toolpath), *_no_inverse_time(controller, options)]
    places, found = places_of(setup, toolpath, machine, options)
    diagnostics += found
    frame, found = work_frame(setup, toolpath, options.setup)
    diagnostics += found
    errors = {d.code for d in diagnostics if d.severity is Severity.ERROR}
    if not places or frame is None or not errors <= OF_SETUP | {"tool.not_loaded"}:
        return None, diagnostics
    toolpath, repeats = at_all(toolpath, places, setup.order)
    setup, placement = places[0].setup, places[0].placement
    axis_tolerance = options.axis_tolerance * DEG
    moves, found = build_moves(toolpath, setup, axis_tolerance, repeats, controller.cycles)
    found = [d for d in found if not (errors and d.code == "feed.no_speed")]  # follows from the speed that is missing
    diagnostics += [*found, *_default_feed(toolpath, setup)]
    moves, found = limited_feeds(moves, toolpath, machine.largest_feed)
    moves, diagnostics = with_held_tools(moves.placed(placement), toolpath, machine, setup), diagnostics + found
    largest = controller.arcs.largest_radius if controller.arcs.enabled and machine.by_drives is None else 0.0
    law: InterpolationMode = "tcp" if machine.control_kinematics and controller.kinematics.modules else "axes"
    own, pivots = control_kinematics(machine, setup, options)
    geometric, found = _error_model(machine, options)
    diagnostics += [*pivots, *found]
    rolls, found = rollovers(machine, controller)
    diagnostics += found
    corrects = geometric is not None and geometric.corrected_by == "post"  # tables that are corrected do not stand at zero
    entry = "table" if corrects or controller.modes.tcp is None else controller.modes.tcp.frame
    control = Control(machine, law, placement.points(np.array([frame.origin]))[0], largest, law, entry_frame=entry,
                      own_kinematics=own, rapids=machine.rapids or controller.kinematics.rapids,
                      feed_rule=controller.feed.length, degree_is_inch=controller.degree_is_inch,
                      helix_planes=controller.arcs.helix_planes, rolls=rolls, standing=places[0].standing,
                      measured=0.0 if setup.output.tool_call else measured_length(toolpath, setup))
    diagnostics += [*_measured(control, controller, moves.axis, setup, options), *upside_down(
        moves.axis[moves.kind != Kind.RAPID], machine.home_axis, placement, options.setup)]
    decimals = word_grid(control, controller).places
    modes, found = output_modes(control, controller, setup, options, toolpath, decimals, refused)
    modes, more = modes_at(places, modes, frame, options.setup)
    diagnostics += [*found, *more]
    job = Job(toolpath, machine, controller, setup, options, placement, control, moves, moves,
              safe_space(moves, setup, placement, None if repeats is None else repeats.place[moves.row]), modes, geometric,
              tuple(records.stated), records.cutcom, places, repeats)
    return None if errors else _with_rapids(job), diagnostics + _tool_lengths(job) + _unused_tools(job)


def _with_rapids(job: Job) -> Job:
    """With rapids split where the control would leave their line, but where they are fed instead."""
    if job.setup.output.rapids_as_feed:
        return job
    return replace(job, moves=safe_rapids(job.moves, job.modes, job.kinematics, job.operation, job.space, job.stock_corners,
                                          (job.options.tolerance, job.axis_tolerance)))


def _measured(control: Control, controller: ControllerFile, axis: Floats, setup: SetupFile,
              options: Options) -> list[Diagnostic]:
    """Where a tool cannot be measured into the work offset: its length stands along Z of the words only where
    every rotary axis carries the part and the words are machine coordinates, and where the control adds none of its own."""
    if setup.output.tool_call:
        return []
    name = control.machine.name
    if control.base == "tcp":
        why = f"the control runs the kinematics of {name} and needs the length of the tool"
    elif words_depend_on_length(control, control.machine.kinematics, axis) or not control.length_on_z:
        why = f"on {name} the machine coordinates depend on the tool's length in other directions than Z"
    elif controller.keeps_length:
        why = "this control adds the length of the tool in the spindle by itself"
    else:
        return []
    return [error("tool.measured", f"[output] tool_call = false: the tool cannot be measured into the work offset, {why}",
                  file=options.setup, hint="take tool_call out of the set-up, number the tool under [tool_numbers] and "
                  "state its gauge_length under [tools.N]")]


def _error_model(machine: Machine, options: Options) -> tuple[ErrorModel | None, list[Diagnostic]]:
    if not options.error_model:
        return None, []
    from machines.geometric_error.files.loader import load_checked

    model, found = load_checked(options.error_model, machine.by_drives or machine)
    if model is not None and model.corrected_by == "control":
        found = [*found, info("compensation.control", f'the geometric errors {model.name} are left to the control, as their '
                              'file says (corrected_by = "control"): the program does not correct them, and is proved on '
                              "the machine without them", file=options.error_model,
                              hint='corrected_by = "post", if the control has no such model in force')]
    refused = errors_of_drives(machine, model is not None and model.corrected_by == "post", options)
    return None if refused else model, [*found, *refused]


def _refused(toolpath: Toolpath) -> list[Diagnostic]:
    result = []
    turning = [op for op in toolpath.operations if op.turning]
    if turning:
        named = ", ".join(op.name or (f"the operation in line {op.line}" if op.line else "all of it") for op in turning[:3])
        whole = "this is a turning file" if len(turning) == len(toolpath.operations) else "turning stands between milling"
        result.append(error("convert.turning", f"{whole} ({named}): milling alone is converted", file=toolpath.file,
                            lines=[op.line for op in turning][:6], count=len(turning), hint="take turning operations out of "
                            "the CL file; inspect reads them; a surface speed (SFM, SMM) of a mill is stated by RPM"))
    if not bool((toolpath.role != Role.START).any()):
        result.append(error("convert.no_motion", "the file commands no motion", file=toolpath.file,
                            hint="it needs GOTO records"))
    return result


def _default_feed(toolpath: Toolpath, setup: SetupFile) -> list[Diagnostic]:
    """Cuts that run at the feed of the set-up, since the CL file states none."""
    rows = np.flatnonzero(without_feed(toolpath))
    if setup.output.feed is None or not len(rows):
        return []
    return [info("feed.of_setup", f"no feed is stated: {setup.output.feed:g} mm/min of the set-up is taken",
                 file=toolpath.file, lines=toolpath.line[rows[:6]].tolist(), count=len(rows))]


def _no_inverse_time(controller: ControllerFile, options: Options) -> list[Diagnostic]:
    if controller.feed.inverse_time or options.feed_mode != "inverse-time":
        return []
    return [error("feed.no_inverse_time", "the controller has no inverse-time feed", hint="--feed-mode auto or per-minute")]


def _tool_lengths(job: Job) -> list[Diagnostic]:
    """A missing gauge length is an error where program words depend on it, else a warning: travel leaves it out."""
    used = sorted({int(t) for t in distinct(job.moves.tool)})
    missing = sorted({max(job.number_of(t), 0) for t in used if job.gauge_length(t) == 0.0})
    missing = [n for n in missing if n > 0 or not job.setup.output.tool_call]
    if not missing:
        return []
    if not job.setup.output.tool_call:
        return [warning("tool.length", "no gauge length for the tool that is measured into the work offset: its travel is "
                        "not checked, and the header names the work offset without it", file=job.toolpath.file,
                        hint=f"add to the set-up: [tools.{missing[0]}] gauge_length = ...")]
    names = ", ".join(f"T{n}" for n in missing)
    hint = "add to the set-up: " + ", ".join(f"[tools.{n}] gauge_length = ..." for n in missing[:6])
    if words_depend_on_length(job.control, job.machine.kinematics, job.moves.axis):
        return [error("tool.length", f"no gauge length for {names}: on {job.machine.name} the machine coordinates depend on "
                      "it", file=job.toolpath.file, hint=hint)]
    return [warning("tool.length", f"no gauge length for {names}: travel is checked as if it were 0", hint=hint,
                    file=job.toolpath.file)]


def _unused_tools(job: Job) -> list[Diagnostic]:
    """Tools of the set-up that the CL file never loads."""
    used = {str(t.number) for t in job.toolpath.tools} | {str(c.number) for c in tool_changes(job.toolpath)}
    unused = [f"T{number}" for number in job.setup.tools if number not in used]
    said = f"the CL file does not use {', '.join(unused)} of the set-up"
    return [info("setup.tool_unused", said, file=job.options.setup)] if unused else []
