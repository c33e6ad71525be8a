"""From an error model file (TOML with CSV tables next to it) to an ErrorModel in mm and rad, or what is wrong with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from machines.geometric_error.actual.actual_map import part_side
from machines.geometric_error.actual.axis_motion import effect
from machines.geometric_error.actual.leg_frame import LegFrame, frame_of
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.rods import RodErrors, gives_rods, rod_frame, rod_names
from machines.geometric_error.actual.serial_errors import Component, ErrorFrame, SerialErrors
from machines.geometric_error.files.covariance import angular, covariance_of
from machines.geometric_error.files.file_models import CurveModel, ErrorFileModel, LegErrorModel
from machines.geometric_error.files.implausible_errors import too_large
from machines.geometric_error.tables.csv_table import UNITS, CsvTable, read_csv
from machines.geometric_error.tables.curves import EVERYWHERE, Curve, Fourier, Polynomial
from machines.geometric_error.tables.lattice import ErrorMap
from machines.geometric_error.tables.lattice_file import map_from_csv, zeroed, zeroed_covariance
from machines.geometric_error.tables.names import SPINDLE, ErrorName, parse
from machines.geometric_error.tables.table_curves import Fault, table_curve
from machines.kinematics.chain import ROTARY
from machines.machine import Machine
from machines.user_file import UserFile, read_toml, validate
from machines.user_model import schema
from machines.value_words import nearest
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, Severity, has_errors, read_value, warning
from toolpaths.units import DEG

KIND = "error model"
BEARINGS = frozenset(("hinge", "hinge_turn", "ring", "point", "joint", "line_turn", "square"))
"""keys of what holds a platform besides its rods"""
DIMENSIONS = ("rail", "guide", "carriage", "platform", "length")
"""of legs and rods, in the order of their parameters"""


def load(source: str | Path, machine: Machine) -> ErrorModel:
    """The error model of a file.

    Raises:
        DiagnosticError: where the file has errors or is not for this machine; carries all of them.
    """
    return read_value(load_checked(source, machine))


def load_checked(source: str | Path, machine: Machine) -> tuple[ErrorModel | None, list[Diagnostic]]:
    """The error model of a file, or None and every fault of it and of its tables."""
    file, diagnostics = read_toml(source, None, KIND)
    if file is None:
        return None, diagnostics
    checked, diagnostics = validate(file, ErrorFileModel)
    if checked is None:
        return None, diagnostics
    return _Loader(file, checked, machine).model()


def error_model_schema() -> dict[str, object]:
    """The JSON schema of an error model file."""
    return schema("error-model", ErrorFileModel)


class _Loader:
    """One file being made a model; collects what is wrong."""

    def __init__(self, file: UserFile, checked: ErrorFileModel, machine: Machine) -> None:
        self.file, self.checked, self.machine = file, checked, machine
        self.found: list[Diagnostic] = []
        self.tables: dict[str, CsvTable | None] = {}
        self.length, self.angle = UNITS[checked.length_unit], UNITS[checked.angle_unit]

    def model(self) -> tuple[ErrorModel | None, list[Diagnostic]]:
        """The model, or None and the faults."""
        self._check_machine()
        if self.found:
            return None, self.found
        self._check_letters()
        axes, rods, error_map = self._axes(), self._rods(), self._map()
        if has_errors(self.found):
            return None, self.found
        model = ErrorModel(axes, rods, error_map, None, self.checked.corrected_by, self.file.name, self.checked.machine,
                           self.checked.large)
        try:
            model.on(self.machine.kinematics)
        except ValueError as fault:
            self._problem("error-model.machine", (), str(fault), f"this machine is {self.machine.name}")
            return None, self.found
        self._check_effects()
        self._check_sizes(model)
        model, faults = covariance_of(model, self.file, self.checked)
        self.found += faults
        if model.map is not None and model.covariance is not None and self._zero():
            model = replace(model, covariance=zeroed_covariance(model.covariance, model.map, self._zero()))
        return (None if has_errors(self.found) else model), self.found

    def _problem(self, code: str, path: tuple[str | int, ...], message: str, hint: str = "") -> None:
        self.found.append(self.file.problem(code, path, message, hint))

    def _check_machine(self) -> None:
        wanted = self.checked.machine
        if wanted and wanted != self.machine.name:
            self._problem("error-model.machine", ("machine",), f"the model was made for machine {wanted!r}, this is "
                          f"{self.machine.name!r}", "take the right file, or the key out where the machine is a copy")

    def _check_letters(self) -> None:
        """Errors of axes that the machine has not, or whose errors are those of its legs."""
        known = self.machine.kinematics.axes_with_errors
        whole = known == self.machine.axis_names
        for table, names in (("components", self.checked.components), ("location", self.checked.location)):
            for text in names:
                if (name := parse(text)) and name.axis not in (*known, SPINDLE):
                    if not whole and name.axis in self.machine.axis_names:
                        self._problem("error-model.axis", (table, text), f"{name.axis} moves a leg of {self.machine.name}",
                                      f"slides and arms are in [legs], here as [legs.{name.axis}]")
                        continue
                    kind = "axis" if whole else "rotary axis"
                    self._problem("error-model.axis", (table, text), f"{self.machine.name} has no {kind} {name.axis!r}",
                                  f"it has {', '.join(known) or 'none'}" + ("" if whole else "; slides are in [legs]"))

    def _check_sizes(self, model: ErrorModel) -> None:
        """Errors too large to be any: a wrong unit, most likely; none at all."""
        given = self.checked
        if not (given.components or given.location or given.legs or given.map):
            self.found.append(warning("error-model.empty", "the file holds no errors: the machine is taken as nominal",
                                      file=self.file.file, hint="write [components], [location], [legs] or [map]"))
        for one in too_large(model):
            found = self.file.problem("error-model.large", one.path, one.message(given.large), one.hint(
                given.large, "length_unit, angle_unit, headers of tables", "large = true in this file"))
            self.found.append(found if one.refused(given.large) else replace(found, severity=Severity.WARNING))

    # ---- axes ----------------------------------------------------------------------------------------------

    def _axes(self) -> SerialErrors:
        components = tuple(Component(name, curve) for text, given in self.checked.components.items()
                           if (name := parse(text)) and (curve := self._curve(name, given)) is not None)
        constants = {text: value * self._unit(parse(text)) for text, value in self.checked.location.items()}
        reference = {k: np.array(v.point) for k, v in self.checked.reference.items() if v.point is not None}
        for letter, given in self.checked.reference.items():
            if letter not in self.machine.axis_names:
                self._problem("error-model.axis", ("reference", letter), f"{self.machine.name} has no axis {letter!r}",
                              nearest(letter, self.machine.axis_names))
            elif letter not in ROTARY and "frame" in given.model_fields_set:
                self._problem("error-model.axis", ("reference", letter, "frame"), f"{letter} is a slide, its frame does "
                              "not turn", "take frame out")
        turning = {c.name.axis for c in components} | set(self.checked.reference)
        return SerialErrors(components, constants, reference,
                            {k: self._frame(k) for k in sorted(turning) if k in ROTARY})

    def _frame(self, letter: str) -> ErrorFrame:
        """The directions of an axis's errors; those of the bed are on the side that the axis does not carry."""
        given = self.checked.reference.get(letter)
        if given is not None and given.frame != "bed":
            return given.frame
        part = f"{letter}'" in self.machine.structure or self.machine.kinematics.carries_part(letter)
        return "moving" if part else "fixed"

    def _unit(self, name: ErrorName | None) -> float:
        return self.angle if name is not None and name.angular else self.length

    def _curve(self, name: ErrorName, given: CurveModel) -> Curve | None:
        position, unit = (DEG if name.axis in ROTARY else 1.0), self._unit(name) * given.sign
        span = EVERYWHERE if given.range is None else (given.range[0] * position, given.range[1] * position)
        if given.kind == "table":
            return self._table(name, given, position)
        if given.kind == "polynomial":
            return Polynomial(np.array(given.polynomial) * unit, span, given.origin * position,
                              given.scale * position)
        if name.axis not in ROTARY and (given.repeats is None or given.range is None):
            self._problem("error-model.series", ("components", str(name)), f"a series of slide {name.axis} needs repeats "
                          "and range", "write repeats = pitch in mm and range = [lower, upper]")
            return None
        count = max(len(given.cosine), len(given.sine))
        waves = [np.array(part or (0.0,) * count) for part in (given.cosine, given.sine)]
        period = 2.0 * np.pi if given.repeats is None else given.repeats * position
        return Fourier(np.concatenate([[given.mean or 0.0], *waves]) * unit, period,
                       given.origin * position, span)

    def _table(self, name: ErrorName, given: CurveModel, position: float) -> Curve | None:
        path = ("components", str(name), "table")
        table = self._csv(str(given.table), path)
        if table is None:
            return None
        period = 0.0 if given.repeats is None else given.repeats * position
        found = table_curve(name, table, given.interpolation, period, given.sign)
        if isinstance(found, Fault):
            if found.line:
                self.found.append(found.at(table))
            else:
                self._problem(found.code, path, found.message, found.hint)
            return None
        return found

    def _csv(self, name: str, path: tuple[str, ...]) -> CsvTable | None:
        if name not in self.tables:
            origin = self.file.origin(path)
            self.tables[name], found = read_csv(Path(origin.file).parent / name, (origin.file, origin.line))
            self.found += found
        return self.tables[name]

    def _check_effects(self) -> None:
        """Location errors that move nothing: a shift of a slide, a shift along or turn about an axis's own line."""
        for text, value in self.checked.location.items():
            name = parse(text)
            if name is not None and not effect(name, self.machine.kinematics):
                component = text.replace("0", "", 1)
                constant = f"mean = {value:g}" if name.axis in ROTARY else f"polynomial = [{value:g}] and its range"
                instead = "a tool held turned about itself does nothing: take it out" if name.axis == SPINDLE else \
                    f"a constant error belongs into [components.{component}]: {constant}"
                self._problem("error-model.no-effect", ("location", text), f"{text} moves nothing: the line of a slide "
                              "shifted, or of an axis shifted or turned along itself, is the same line", instead)

    # ---- parallel machines, maps ---------------------------------------------------------------------------

    def _rods(self) -> RodErrors | None:
        kinematics, own = self.machine.kinematics.on_rods, frame_of(self.machine.kinematics)
        if own is not None:
            return self._legs(own)
        for table in ("bars", "passive"):
            for name in getattr(self.checked, table):
                self._problem("error-model.legs", (table, name), f"{self.machine.name} has no {table} that could be off",
                              f"take [{table}] out")
        if kinematics is None:
            for letter in self.checked.legs:
                self._problem("error-model.legs", ("legs", letter), f"{self.machine.name} has no legs",
                              "take [legs] out")
            return None
        slides = kinematics.axis_names[: len(kinematics.legs.points)]
        pairs = self._pairs(slides, gives_rods(kinematics))
        if pairs is None:
            return None
        frame = rod_frame(kinematics, pairs)
        zero = RodErrors.none(slides, rod_names(frame, slides), pairs)
        parts: dict[str, Any] = {what: np.array(getattr(zero, what)) for what in DIMENSIONS}
        self._dimensions(parts, slides, frame.leg)
        for letter, given in self.checked.legs.items():
            if given.drive:
                self._problem("error-model.legs", ("legs", letter, "drive"), f"{self.machine.name} is of no kind \"legs\"",
                              "write it as the carriage's third number, along the slide, of every rod")
        return RodErrors(**parts, legs=slides, rods=zero.rods, pairs=pairs)

    def _pairs(self, slides: tuple[str, ...], given: bool) -> tuple[float, ...] | None:
        """Half distances of the pairs of rods that the machine file does not give; None where no errors ask for them."""
        stated = {letter: leg.pair for letter, leg in self.checked.legs.items() if leg.pair is not None}
        if given:
            for letter in stated:
                self._problem("error-model.legs", ("legs", letter, "pair"), f"the file of {self.machine.name} says where "
                              "its rods are", "take pair out")
            return ()
        missing = [letter for letter in slides if letter not in stated]
        if not self.checked.legs or missing:
            if self.checked.legs:
                self._problem("error-model.legs", ("legs",), f"the file of {self.machine.name} gives no rods, and legs "
                              f"{', '.join(missing)} no pair", "write pair = half the distance of the two rods in mm in "
                              "every [legs] table, or rods in the machine file")
            return None
        return tuple(stated[letter] for letter in slides)

    def _legs(self, frame: LegFrame) -> RodErrors:
        """Of a machine of kind "legs"."""
        zero, drives = frame.zero, frame.machine.legs
        parts: dict[str, Any] = {what: np.array(getattr(zero, what)) for what in (*DIMENSIONS, "drive")}
        self._pairs(zero.legs, True)
        self._dimensions(parts, zero.legs, frame.leg)
        for k, letter in enumerate(zero.legs):
            given = self.checked.legs.get(letter, LegErrorModel())
            parts["drive"][k] = given.drive * (self.angle if drives.arm[k] else self.length)
            if drives.stretch[k] and any(given.guide):
                self._problem("error-model.legs", ("legs", letter, "guide"), f"leg {letter} changes its length: it has no "
                              "guide to be turned", "take guide out; its foot is moved by rail")
        return replace(zero, **parts, bearings=self._bearings(zero))

    def _bearings(self, zero: RodErrors) -> Floats:
        """Of the hinges of bars and legs, rings and passive legs, in the order of `zero.bearing_names`."""
        found = np.zeros(len(zero.bearing_names))
        for table, prefix in (("legs", ""), ("bars", "bars."), ("passive", "passive.")):
            for name, given in getattr(self.checked, table).items():
                for key in BEARINGS & given.model_fields_set:
                    mine = [k for k, one in enumerate(zero.bearing_names)
                            if f"{prefix}{name}.{key}" in (one, one.rpartition(".")[0])]
                    value = np.atleast_1d(getattr(given, key))
                    if mine:
                        found[mine] = value * (self.angle if angular(zero.bearing_names[mine[0]]) else self.length)
                    elif value.any():
                        self._no_bearing((table, name, key), zero.bearing_names)
        return found

    def _no_bearing(self, path: tuple[str, str, str], names: tuple[str, ...]) -> None:
        """An error of a hinge, ring or passive leg that the machine has not."""
        known = list(dict.fromkeys(name.rpartition(".")[0] if name[-2:] in (".x", ".y", ".z") else name for name in names))
        self._problem("error-model.legs", path, f"{self.machine.name} has no {path[2]} of {path[1]!r} that could be off",
                      f"it has {', '.join(known)}" if known else f"take {path[2]} out")

    def _dimensions(self, parts: dict[str, Floats], legs: tuple[str, ...], leg_of: Ints) -> None:
        """The `[legs]` tables into arrays by DIMENSIONS, of rods by their legs (R,)."""
        for letter, given in self.checked.legs.items():
            if letter not in legs:
                self._problem("error-model.legs", ("legs", letter), f"{self.machine.name} has no leg {letter!r}",
                              "its legs are " + ", ".join(legs))
                continue
            leg = legs.index(letter)
            parts["rail"][leg] = np.multiply(given.rail, self.length)
            parts["guide"][leg] = np.multiply(given.guide, self.angle)
            for what in ("carriage", "platform", "length"):
                self._per_rod(letter, what, getattr(given, what), parts[what], np.flatnonzero(leg_of == leg))

    def _per_rod(self, letter: str, what: str, given: tuple[object, ...], into: Floats, rods: Ints) -> None:
        if given and len(given) != len(rods):
            self._problem("error-model.legs", ("legs", letter, what), f"{len(given)} entries for {len(rods)} rods",
                          "write one per rod, in the order of the machine file")
        elif given:
            into[rods] = np.array(given) * self.length

    def _map(self) -> ErrorMap | None:
        if self.checked.map is None:
            return None
        given, table = self.checked.map, self._csv(self.checked.map.table, ("map", "table"))
        if table is None:
            return None
        periods = {k: v * (DEG if k in ROTARY else 1.0) for k, v in given.repeats.items()}
        result, found = map_from_csv(table, periods)
        self.found += found
        if result is None:
            return None
        bed = part_side(self.machine.kinematics, self.machine.structure) if given.directions == "machine" else ()
        result = replace(result, length=given.tool_length, bed=bed, table=given.sign * result.table)
        if not given.zero:
            return result
        made = zeroed(result, self._zero())
        if isinstance(made, tuple):
            self._problem("error-map.zero", ("map", "zero"), *made)
            return None
        return made

    def _zero(self) -> dict[str, float]:
        """Stated zero of the map, mm and rad."""
        given = {} if self.checked.map is None else self.checked.map.zero
        return {letter: value * (DEG if letter in ROTARY else 1.0) for letter, value in given.items()}
