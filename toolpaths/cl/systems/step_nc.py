"""STEP-NC of ISO 14649 as statements: workplans whose working steps carry explicit tool paths, in Part 21 text.

Source: ISO 14649-10 and -11 as NIST's interpreter of them states them (iso14649.cc, iso14649classes.cc, public domain): the
order of parameters, units (mm, m/s, revolutions per second, negative clockwise), CONNECT as rapid and all else at the feed,
the approach to the first point over the security plane. Paths may stand in the system of the feature or of the workpiece,
and nothing in the file says which (ISO 14649-10, 4.8.4): features must stand at its origin, where both are one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from toolpaths.cl.systems.as_statements import UP, AsStatements, numbers, signed
from toolpaths.cl.systems.curves_of_step import Piece, Unread, backwards, pieces, place, point
from toolpaths.cl.systems.part21 import Instance, Reference, Typed, Value, instances
from toolpaths.cl.text.log import DiagnosticLog

_SAME = 1e-6
"""mm"""
_PER_MINUTE = 60.0
_MM_PER_M = 1000.0
_TYPES = frozenset({".CONNECT.", ".TRAJECTORY_PATH.", ".APPROACH.", ".LIFT.", ".CONTACT.", ".NON_CONTACT.", ".NONCONTACT."})
_STOPS = {"PROGRAM_STOP": "STOP", "OPTIONAL_STOP": "OPSTOP"}
_TOOL_AXES = (None, "TWO_AXES", "THREE_AXES")
_EXPORT = "have the CAM system write explicit tool paths (CUTTER_LOCATION_TRAJECTORY) in mm from the origin, or APT text"


@dataclass
class StepNcReader:
    """Carries out the workplan of one file."""

    text: str
    log: DiagnosticLog
    out: AsStatements = field(default_factory=AsStatements)
    found: dict[int, Instance] = field(default_factory=dict)
    at: tuple[float, ...] = ()
    axis: tuple[float, ...] = UP
    said: dict[str, str] = field(default_factory=dict)
    workpiece: Value = None
    setup: Value = None

    def read(self) -> AsStatements:
        """All working steps in order; an error in the log where one cannot be carried out."""
        self.out.add(1, "UNITS/MM")
        try:
            self.found = instances(self.text)
            projects = [i for i in self.found.values() if i.name == "PROJECT"]
            if len(projects) != 1:
                raise Unread("no PROJECT, or several: one names the workplan", projects[1].line if projects else 1)
            self._units()
            project = projects[0]
            self.out.say(project.line, "PARTNO", str(project.value(0) or ""))
            self._plan(self._of(project.value(1), project), 0)
            self.out.add(project.line, "FINI")
        except Unread as fault:
            self.log.error("cl.step-nc", str(fault), fault.line, _EXPORT)
        except ValueError as fault:
            self.log.error("cl.step-nc", str(fault), 0, "write the file again in the CAM system")
        return self.out

    def _units(self) -> None:
        """Lengths are mm by ISO 14649; a file that states another unit is refused."""
        for one in self.found.values():
            if not one.name and "LENGTH_UNIT" in one.values and not {"SI_UNIT", ".MILLI.", ".METRE."} <= set(one.values):
                raise Unread("a unit of length that is not mm", one.line)

    def _of(self, value: Value, owner: Instance, *names: str) -> Instance:
        """The instance that a parameter of `owner` names, of one of these names where some are given."""
        got = self.found.get(value.number) if isinstance(value, Reference) else None
        if got is None or (names and got.name not in names):
            what = "nothing" if got is None else got.name
            raise Unread(f"{owner.name} names {what}" + (f", read is {' or '.join(names)}" if names else ""), owner.line)
        return got

    def _listed(self, value: Value, owner: Instance) -> list[Instance]:
        if not isinstance(value, tuple):
            raise Unread(f"{owner.name} has no list", owner.line)
        return [self._of(one, owner) for one in value]

    def _plan(self, plan: Instance, deep: int) -> None:
        if plan.name != "WORKPLAN" or deep > 20:
            raise Unread(f"{plan.name} in the place of a workplan", plan.line)
        if plan.value(3) is not None and self.setup not in (None, plan.value(3)):
            raise Unread("workplans of two set-ups: nothing says how they lie to each other", plan.line)
        if plan.value(3) is not None and self.setup is None:
            self._set_up(self._of(plan.value(3), plan, "SETUP"))
        self.setup = plan.value(3) or self.setup
        for one in self._listed(plan.value(1), plan):
            if one.name == "WORKPLAN":
                self._plan(one, deep + 1)
            elif one.name == "MACHINING_WORKINGSTEP":
                self._step(one)
            elif one.name in _STOPS:
                self.out.add(one.line, _STOPS[one.name])
            elif one.name == "DISPLAY_MESSAGE":
                self.out.say(one.line, "PPRINT", str(one.value(1) or ""))
            else:
                raise Unread(f"{one.name} in a workplan is not carried out", one.line)

    def _set_up(self, setup: Instance) -> None:
        """SETUP(id, place, security plane, (WORKPIECE_SETUP(workpiece, place, ...))): all at the origin."""
        for one in (setup, *self._listed(setup.value(3) or (), setup)):
            if one.value(1) is not None:
                self._identity(self._of(one.value(1), one, "AXIS2_PLACEMENT_3D"), only_height=False)

    def _step(self, step: Instance) -> None:
        """MACHINING_WORKINGSTEP(id, security plane, feature, operation, effect)."""
        self.out.say(step.line, "OPNAME", str(step.value(0) or ""))
        secure = self._of(step.value(1), step, "PLANE")
        height = self._identity(self._of(secure.value(1), secure, "AXIS2_PLACEMENT_3D"), only_height=True)
        feature = self._of(step.value(2), step)
        if self.workpiece not in (None, feature.value(1)):
            raise Unread("features of two workpieces: nothing says how their systems lie to each other", feature.line)
        self.workpiece = feature.value(1)
        if feature.value(3) is not None:
            self._identity(self._of(feature.value(3), feature, "AXIS2_PLACEMENT_3D"), only_height=False)
        operation = self._of(step.value(3), step)
        if operation.value(0) is None:
            raise Unread(f"{operation.name} has no explicit path, the control would make one", operation.line)
        self._operation(operation, height)

    def _identity(self, placed: Instance, only_height: bool) -> float:
        """The height of a system upright at the origin, or but for its height."""
        origin, matrix = place(self.found, placed)
        away = float(np.abs(origin[:2] if only_height else origin).max())
        if away > _SAME or abs(matrix[2, 2] - 1.0) > _SAME or (not only_height and abs(matrix[0, 0] - 1.0) > _SAME):
            raise Unread("it is placed away from the origin, or turned: paths may count from either system, nothing says "
                         "from which", placed.line)
        return float(origin[2])

    def _operation(self, operation: Instance, secure: float) -> None:
        """An operation: path list, tool direction, id, retract plane, start, tool, technology, functions first."""
        if operation.value(9) is not None or operation.value(10) is not None:
            raise Unread("strategies of approach and retract are not carried out", operation.line)
        axis = self._tool_axis(operation.value(1), operation)
        self._tool(self._of(operation.value(5), operation, "MILLING_CUTTING_TOOL"))
        first = True
        paths = self._of(operation.value(0), operation, "TOOLPATH_LIST")
        for path in self._listed(paths.value(0), paths):
            self._machine(operation.value(7) if path.value(4) is None else path.value(4), path)
            self._technology(operation.value(6) if path.value(3) is None else path.value(3), path)
            if path.name == "FEEDSTOP":
                self.out.add(path.line, f"DELAY/{signed(_number(path.value(5), path))}")
                continue
            if path.name != "CUTTER_LOCATION_TRAJECTORY":
                raise Unread(f"{path.name} is not carried out", path.line)
            self._trajectory(path, axis, secure if first else math.nan)
            first = False

    def _tool(self, tool: Instance) -> None:
        """MILLING_CUTTING_TOOL(id, body, ...) by its id; the body's dimension has diameter first, edge radius fifth."""
        name = str(tool.value(0) or "").replace(",", " ")
        if self.said.get("tool") == name:
            return
        self.said["tool"] = name
        self.out.say(tool.line, "TPRINT", name)
        size = self._of(self._of(tool.value(1), tool).value(0), tool, "MILLING_TOOL_DIMENSION")
        sizes = numbers([_number(size.value(0), size), _number(size.value(4) or 0.0, size)])
        self.out.add(tool.line, f"CUTTER/{sizes}")

    def _tool_axis(self, value: Value, owner: Instance) -> tuple[float, ...]:
        if value is None:
            return UP
        found = self._of(value, owner)
        if found.name == "THREE_AXES_TILTED_TOOL":
            return tuple(point(self.found, self._of(found.value(0), found, "DIRECTION")).tolist())
        if found.name not in _TOOL_AXES:
            raise Unread(f"{found.name} states no tool axis", found.line)
        return UP

    def _state(self, line: int, what: str, text: str) -> None:
        """A record, where it says something else than the last of its kind."""
        if self.said.get(what) != text:
            self.said[what] = text
            self.out.add(line, text)

    def _technology(self, value: Value, owner: Instance) -> None:
        """MILLING_TECHNOLOGY(feed m/s, its point, cutting speed, spindle 1/s, feed per tooth, ...)."""
        t = self._of(value, owner, "MILLING_TECHNOLOGY")
        if t.value(4) is not None or t.value(5) == ".T.":
            raise Unread("feeds per tooth, and feeds that the spindle drives, are not carried out", t.line)
        if t.value(0) is None or t.value(1) == ".CCP." or (t.value(3) is None and t.value(2) is not None):
            raise Unread("its feed must be that of the tool centre in m/s, its spindle speed in turns per second", t.line)
        self._state(t.line, "feed", f"FEDRAT/{signed(_number(t.value(0), t) * _MM_PER_M)},MMPS")
        if t.value(3) is not None:
            turns = _number(t.value(3), t) * _PER_MINUTE
            sense = "CLW" if turns < 0.0 else "CCLW"
            self._state(t.line, "spindle", f"SPINDL/{signed(abs(turns))},RPM,{sense}" if turns else "SPINDL/OFF")

    def _machine(self, value: Value, owner: Instance) -> None:
        """MILLING_MACHINE_FUNCTIONS(coolant, -, mist, through the tool, ...)."""
        f = self._of(value, owner, "MILLING_MACHINE_FUNCTIONS")
        kinds = [word for word, k in (("FLOOD", 0), ("MIST", 2), ("THRU", 3)) if f.value(k) == ".T."]
        if f.value(5) or f.value(7) is not None or f.value(8) is not None or f.value(9):
            raise Unread("clamps, oriented stops and functions of the shop are not carried out", f.line)
        if len(kinds) > 1:
            raise Unread(f"coolants at a time: {', '.join(kinds)}", f.line)
        self._state(f.line, "coolant", f"COOLNT/{(kinds or ['OFF'])[0]}")

    def _trajectory(self, path: Instance, axis: tuple[float, ...], secure: float) -> None:
        """CUTTER_LOCATION_TRAJECTORY(priority, type, speed, technology, functions, direction, curve, tool axis, normal)."""
        speed = path.value(2)
        name = speed.values[:1] if isinstance(speed, Typed) else (speed,)
        kind = path.value(1)
        if name not in ((None,), (".RAPID.",)) or kind not in _TYPES:
            raise Unread(f"path of type {kind} with the speed {speed}", path.line)
        rapid = kind == ".CONNECT." or name == (".RAPID.",)
        if path.value(8) is not None:
            raise Unread("normals of the surface are not carried out", path.line)
        run = pieces(self.found, self._of(path.value(6), path))
        axes = [axis] * len(run)
        if path.value(7) is not None:
            axes = [p.end for p in pieces(self.found, self._of(path.value(7), path))]
            if len(axes) != len(run) or any(p.centre for p in run):
                raise Unread("its tool axes are not as many as its points, or it has arcs", path.line)
        if path.value(5) == ".F.":
            run, axes = backwards(run), axes[::-1]
        self._begin(path.line, run[0], axes[0], secure)
        for piece, tilt in zip(run[1:], axes[1:], strict=True):
            self._piece(path.line, piece, tilt, rapid)

    def _begin(self, line: int, first: Piece, axis: tuple[float, ...], secure: float) -> None:
        """The first path of a working step is come to over the security plane, others begin where the one before ends."""
        if math.isnan(secure):
            if math.dist(first.end, self.at) > _SAME:
                raise Unread("it begins elsewhere than the path before it ends", line)
            return
        over = (*first.end[:2], max(secure, first.end[2]))
        away = [((*self.at[:2], max(secure, self.at[2])), self.axis)] if self.at else []
        for target, tilt in [*away, (over, axis), (first.end, axis)]:
            self.out.add(line, "RAPID")
            self.out.point(line, target, tilt)
        self.at, self.axis = first.end, axis

    def _piece(self, line: int, piece: Piece, axis: tuple[float, ...], rapid: bool) -> None:
        if rapid:
            if piece.centre:
                raise Unread("an arc as a rapid", line)
            self.out.add(line, "RAPID")
        if piece.centre:
            self.out.arc(line, piece.centre, piece.normal, piece.end, axis)
        else:
            self.out.point(line, piece.end, axis)
        self.at, self.axis = piece.end, axis


def _number(value: Value, owner: Instance) -> float:
    if isinstance(value, Typed) and len(value.values) == 1:
        value = value.values[0]
    if not isinstance(value, float):
        raise Unread(f"{owner.name}: a number is missing", owner.line)
    return value
