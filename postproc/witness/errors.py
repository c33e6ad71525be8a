"""A serial machine with its geometric errors, from the error model file: products of 4 x 4 matrices.

Written from the description of the file (`docs/reference/error-models.md`). Oueslati 2004, 1.1 to 1.20: with M the
nominal motion of an axis, L the error of its line, E its component errors as they stand at its position,

    T = E L M L^-1 (turning axes whose errors are in the directions of the part's side), T = L M L^-1 E (all others).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from postproc.witness.commanded import unit
from postproc.witness.held import Bars, wrongly_held
from postproc.witness.machine import Chain, Rods, apply, chain, legs_of, rods, rotations
from postproc.witness.text import Array

ComponentError = Callable[[Array, Array], Array]
"""of positions (N,) and approach directions (N,), mm and rad, to errors (N,)"""
_PARTS = "XYZABC"
_OWN = dict(zip("XYZUVWABC", "XYZXYZABC", strict=True))
_ARCSEC = math.pi / 648000.0
_UNITS = {"mm": 1.0, "um": 1e-3, "m": 1e3, "in": 25.4, "inch": 25.4, "deg": math.pi / 180.0, "\u00b0": math.pi / 180.0,
          "arcsec": _ARCSEC, "arcmin": 60.0 * _ARCSEC, "urad": 1e-6, "um/m": 1e-6, "mrad": 1e-3, "rad": 1.0}
_PLACE = 1e-6
"""share of a period that counts as nothing, and mm or rad by which levels of a map differ at least"""


def _position(letter: str) -> float:
    return math.pi / 180.0 if letter in "ABC" else 1.0


def columns_of(data: bytes) -> dict[str, Array]:
    """Columns of a CSV table in mm and rad: name with its unit in brackets, or a row of units below."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = data.decode("utf-16")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252")
    lines = [x for x in text.splitlines() if x.strip(' \t;,"') and not x.lstrip().startswith("#")
             and not x.startswith("sep=")]
    rows = [_cells(x) for x in lines]
    numbers = [[_is_number(cell) for cell in row] for row in rows]
    head = next(k for k, row in enumerate(numbers[:-1]) if not any(row) and (numbers[k + 1][0] or _all_units(rows[k + 1])))
    below = head + 1
    names, units = [], []
    for cell in rows[head]:
        name, _, rest = cell.replace("(", "[").partition("[")
        names.append(name.strip())
        units.append(_unit(rest))
    if not numbers[below][0]:
        units, below = [_unit(cell) for cell in rows[below]], below + 1
    comma = "," not in _mark(lines[head]) and not any("." in x for x in lines[below:])
    values = np.array([[float(cell.replace(",", ".") if comma else cell) for cell in row[:len(names)]]
                       for row in rows[below:]])
    return {name: values[:, k] * _UNITS[units[k]] for k, name in enumerate(names)}


def _mark(line: str) -> str:
    return next((mark for mark in ";\t" if mark in line), ",")


def _cells(line: str) -> list[str]:
    cells = [cell.strip().strip('"').strip() for cell in line.split(_mark(line))]
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    return cells


def _unit(text: str) -> str:
    return text.strip(" []()").replace("\u00b5", "u").replace("\u03bc", "u")


def _all_units(cells: list[str]) -> bool:
    return {_unit(cell) for cell in cells} <= set(_UNITS)


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def curve_of(name: str, given: dict[str, Any], unit: float, files: dict[str, bytes]) -> ComponentError:
    """One component error of a `[components]` table; `unit` of the numbers in the file."""
    own, sign = _position(name[-1]), float(given.get("sign", 1))
    low, high = (own * x for x in given.get("range") or (-math.inf, math.inf))
    origin = own * float(given.get("origin", 0.0))
    repeats = own * float(given["repeats"]) if given.get("repeats") else 0.0
    if "table" in given:
        return _table(name, columns_of(files[given["table"]]), repeats, sign, given.get("interpolation") == "spline")
    if given.get("polynomial"):
        c, scale = sign * unit * np.array(given["polynomial"]), own * float(given.get("scale", 1.0))
        return lambda x, _: np.polynomial.polynomial.polyval((np.clip(x, low, high) - origin) / scale, c)
    waves = [[sign * unit * v for v in given.get(key) or ()] for key in ("cosine", "sine")]
    mean, turn = sign * unit * float(given.get("mean") or 0.0), 2.0 * math.pi / (repeats or 2.0 * math.pi)

    def series(x: Array, _: Array) -> Array:
        phase = turn * (np.clip(x, low, high) - origin)
        return np.asarray(mean + sum(a * np.cos((k + 1) * phase) for k, a in enumerate(waves[0]))
                          + sum(a * np.sin((k + 1) * phase) for k, a in enumerate(waves[1])) + 0.0 * x)

    return series


def _table(name: str, columns: dict[str, Array], period: float, sign: float, spline: bool) -> ComponentError:
    both = f"{name}+" in columns
    x, order = columns[name[-1]], np.argsort(columns[name[-1]], kind="stable")
    x, values = x[order], [sign * columns[n][order] for n in ((f"{name}+", f"{name}-") if both else (name,))]
    if period:
        inside = x < x[0] + period * (1.0 - _PLACE)
        values = [np.append(v[inside], v[0]) for v in values]
        x = np.append(x[inside], x[0] + period)
    bends = [_bends(x, v, bool(period)) if spline else None for v in values]

    def at(where: Array, approach: Array) -> Array:
        there = x[0] + np.mod(where - x[0], period) if period else np.clip(where, x[0], x[-1])
        found = [_between(x, v, bend, there) for v, bend in zip(values, bends, strict=True)]
        if not both:
            return found[0]
        forward = np.clip(0.5 + 0.5 * approach, 0.0, 1.0)
        return np.asarray(forward * found[0] + (1.0 - forward) * found[1])

    return at


def _bends(x: Array, y: Array, closed: bool) -> Array:
    """Second derivatives (M,) of the cubic spline through points, at them: periodic, or not-a-knot at its ends."""
    n, h = len(x), np.diff(x)
    slope = np.diff(y) / h
    m, right = np.zeros((n, n)), np.zeros(n)
    for k in range(1, n - 1):
        m[k, k - 1:k + 2] = h[k - 1], 2.0 * (h[k - 1] + h[k]), h[k]
        right[k] = 6.0 * (slope[k] - slope[k - 1])
    if closed:
        m[0, 0], m[0, -1] = 1.0, -1.0
        m[-1, [0, 1]] = 2.0 * h[0], h[0]
        m[-1, [n - 2, n - 1]] += h[-1], 2.0 * h[-1]
        right[-1] = 6.0 * (slope[0] - slope[-1])
    else:
        m[0, :3] = h[1], -(h[0] + h[1]), h[0]
        m[-1, -3:] = h[-1], -(h[-2] + h[-1]), h[-2]
    return np.linalg.solve(m, right)


def _between(x: Array, y: Array, bend: Array | None, there: Array) -> Array:
    if bend is None:
        return np.asarray(np.interp(there, x, y))
    k = np.clip(np.searchsorted(x, there, side="right") - 1, 0, len(x) - 2)
    h, b = x[k + 1] - x[k], (there - x[k]) / (x[k + 1] - x[k])
    a = 1.0 - b
    return np.asarray(a * y[k] + b * y[k + 1] + ((a**3 - a) * bend[k] + (b**3 - b) * bend[k + 1]) * h * h / 6.0)


def _displaced(parts: Array, about: Array) -> Array:
    """(N, 4, 4) of (N, 6): displaced, then turned about x, y, z (1.12) about a point."""
    result = np.tile(np.eye(4), (len(parts), 1, 1))
    turn = np.eye(3)[None]
    for k in range(3):
        if parts[:, 3 + k].any():
            turn = turn @ rotations(np.eye(3)[k], parts[:, 3 + k])
    result[:, :3, :3] = turn
    result[:, :3, 3] = parts[:, :3] + about - apply(result[:, :3, :3], np.broadcast_to(about, (len(parts), 3)))
    return result


@dataclass(frozen=True)
class ErrorChain:
    """A serial machine with errors: component errors by letter, those of its lines, zero positions, spindle (6,), a map."""

    chain: Chain
    components: dict[str, list[tuple[int, ComponentError]]]
    location: dict[str, Array]
    zero: dict[str, float]
    reference: dict[str, Array]
    before: frozenset[str]
    """letters of turning axes whose component errors are in the directions of the part's side"""
    error_map: ErrorNodes | None

    def pose(self, q: Array, letters: tuple[str, ...], length: Array, approach: Array) -> tuple[Array, Array]:
        """(tip, axis) (N, 3) in the table frame at joints q (N, J), each reached from `approach` (N, J): 1 forwards, -1."""
        spindle = _displaced(self.location.get("S", np.zeros(6))[None], np.zeros(3))[0]
        point = -length[:, None] * (spindle[:3, :3] @ self.chain.tool) + spindle[:3, 3]
        axis = np.broadcast_to(spindle[:3, :3] @ self.chain.tool, (len(q), 3))
        for name in reversed(self.chain.letters):
            k = letters.index(name)
            for matrix in self._motions(name, q[:, k], approach[:, k])[::-1]:
                point = apply(matrix[:, :3, :3], point) + matrix[:, :3, 3]
                axis = apply(matrix[:, :3, :3], axis)
        if self.error_map is None:
            return point, axis
        return self.error_map.moved(self.chain, q, letters, length, point, axis)

    def _motions(self, name: str, x: Array, approach: Array) -> list[Array]:
        """Matrices (N, 4, 4) of one axis, from the part's side."""
        along, turning = self.chain.direction[name], name in "ABC"
        point = self.chain.point[name] if turning else self.reference[name]
        motion = np.tile(np.eye(4), (len(x), 1, 1))
        if turning:
            motion[:, :3, :3] = rotations(along, x + self.zero.get(name, 0.0))
            motion[:, :3, 3] = point - apply(motion[:, :3, :3], np.broadcast_to(point, (len(x), 3)))
        else:
            motion[:, :3, 3] = (x + self.zero.get(name, 0.0))[:, None] * along
        if name in self.location:
            line = _displaced(self.location[name][None], point)[0]
            motion = line @ motion @ np.linalg.inv(line)
        parts = np.zeros((len(x), 6))
        for part, curve in self.components.get(name, ()):
            parts[:, part] += curve(x, approach)
        if not parts.any():
            return [motion]
        error = _displaced(parts, self.reference[name])
        return [error, motion] if name in self.before else [motion, error]


@dataclass(frozen=True)
class ErrorNodes:
    """Displacements and turns (n1, ..., 6) at nodes, linear between; see `[map]` of an error model file."""

    letters: tuple[str, ...]
    nodes: list[Array]
    values: Array
    length: float
    bed: tuple[str, ...]
    periods: list[float]

    def at(self, places: Array) -> Array:
        """(N, 6) at places (N, D)."""
        cell, share = [], []
        for x, nodes, period in zip(places.T, self.nodes, self.periods, strict=True):
            there = nodes[0] + np.mod(x - nodes[0], period) if period else np.clip(x, nodes[0], nodes[-1])
            k = np.clip(np.searchsorted(nodes, there, side="right") - 1, 0, max(len(nodes) - 2, 0))
            cell.append(k)
            share.append((there - nodes[k]) / (nodes[k + 1] - nodes[k]) if len(nodes) > 1 else 0.0 * there)
        result = np.zeros((len(places), 6))
        for corner in product((0, 1), repeat=len(cell)):
            weight = np.prod([b if up else 1.0 - b for b, up in zip(share, corner, strict=True)], axis=0)
            node = tuple(np.minimum(k + up, len(n) - 1) for k, up, n in zip(cell, corner, self.nodes, strict=True))
            result += weight[:, None] * self.values[node]
        return result

    def moved(self, machine: Chain, q: Array, letters: tuple[str, ...], length: Array, tip: Array,
              axis: Array) -> tuple[Array, Array]:
        """(tip, axis) displaced and turned."""
        arm = (length - self.length)[:, None] * axis
        point = tip + arm
        error = self.at(np.stack([point[:, "xyz".index(n)] if n in "xyz" else q[:, letters.index(n)]
                                  for n in self.letters], axis=1))
        shift, turn = error[:, :3], error[:, 3:]
        for name in reversed(self.bed):
            matrix = rotations(machine.direction[name], q[:, letters.index(name)])
            shift, turn = apply(matrix, shift), apply(matrix, turn)
        size = np.sqrt((turn * turn).sum(axis=1))
        about = turn / np.where(size > 0.0, size, 1.0)[:, None]

        def spun(v: Array) -> Array:
            s, c = np.sin(size)[:, None], np.cos(size)[:, None]
            return np.asarray(c * v + s * np.cross(about, v) + (1.0 - c) * (about * v).sum(axis=1)[:, None] * about)

        return point + shift - spun(arm), spun(axis)


def _map(given: dict[str, Any], structure: str, letters: tuple[str, ...], files: dict[str, bytes]) -> ErrorNodes:
    columns = columns_of(files[given["table"]])
    names = tuple(name for name in columns if name in (*"XYZUVWABC", *"xyz"))
    nodes, index = [], []
    for name in names:
        order = np.argsort(columns[name], kind="stable")
        new = np.concatenate(([True], np.diff(columns[name][order]) > _PLACE))
        own = np.empty(len(order), dtype=np.int64)
        own[order] = np.cumsum(new) - 1
        nodes.append(columns[name][order][new])
        index.append(own)
    values = np.zeros((*map(len, nodes), 6))
    at = np.ravel_multi_index(index, values.shape[:-1])
    for k, name in enumerate(("dx", "dy", "dz", "rx", "ry", "rz")):
        if name in columns:
            values.reshape(-1, 6)[at, k] = float(given.get("sign", 1)) * columns[name]
    periods = [_position(n) * float((given.get("repeats") or {}).get(n, 0.0)) for n in names]
    for d, period in enumerate(periods):
        if period and nodes[d][-1] - nodes[d][0] <= period - _PLACE:
            nodes[d] = np.append(nodes[d], nodes[d][0] + period)
            values = np.concatenate([values, np.take(values, [0], axis=d)], axis=d)
    bed = tuple(n for n in letters if n in "ABC" and f"{n}'" in structure) if given.get("directions") == "machine" else ()
    made = ErrorNodes(names, nodes, values, float(given.get("tool_length", 0.0)), bed, periods)
    if given.get("zero"):
        there = made.at(np.array([[_position(n) * float(given["zero"][n]) for n in names]]))[0]
        made = ErrorNodes(names, nodes, values - there, made.length, bed, periods)
    return made


def error_rods(table: dict[str, Any], model: dict[str, Any]) -> Rods | None:
    """The rods of a machine file with the errors of a model file; None but of six, of two pairs in a plane, or of one a leg
    that holds a platform with bars, wrong alone."""
    nominal, legs = rods(table), legs_of(table["kinematics"])
    if any(model.get(key) for key in ("components", "location", "map")) or any(
            leg.get("pair") for leg in model.get("legs", {}).values()):
        return None
    kinematics = table["kinematics"]
    names, count = list(kinematics.get("bars", {})), sum(len(leg.get("rods") or [0]) for leg in legs.values())
    exact = bool(names) and count == 6 + len(names)
    bars, swung = bool(names) and not exact, list[tuple[int, Array, Array]]()
    mm, rad, found = _UNITS[model.get("length_unit", "um")], _UNITS[model.get("angle_unit", "arcsec")], []
    middle = np.array([np.mean(table["kinematics"]["workspace"][k]) for k in "xyz"])
    for (name, drive, (foot, along, joint, arm, kept), size, root), leg in zip(nominal.legs, legs.values(), strict=True):
        given, offset = model.get("legs", {}).get(name, {}), np.array(leg.get("rail_offset", (0.0, 0.0, 0.0)))
        turn = _displaced(rad * np.array([[0.0] * 3 + list(given.get("guide", (0.0, 0.0, 0.0)))]), np.zeros(3))[0, :3, :3]
        sides = (drive == "arm") * arm, -offset, middle - foot - offset, np.eye(3)[np.abs(along).argmin()]
        x = unit(next(x for v in sides if (x := v - v @ along * along) @ x > 1e-18))
        guide = np.eye(3) if drive == "length" else np.stack([x, np.cross(along, x), along], axis=1)
        hinge = unit(np.array(leg.get("hinge") or (0.0, 0.0, 1.0), np.float64))
        plane = [turn @ _turned(given.get("hinge_turn"), rad) @ hinge] if leg.get("hinge") else []
        hung = names.index(leg["bar"]) if exact and leg.get("bar") else -1
        own_bar = model.get("bars", {}).get(leg.get("bar"), {})
        more, u = (rad if drive == "arm" else mm) * given.get("drive", 0.0), turn @ along
        for k, shift in enumerate(np.array((not bars and leg.get("rods")) or [(0.0, 0.0, 0.0)])):
            own, end = (mm * np.array((given.get(key) or {k: np.zeros(3)})[k]) for key in ("carriage", "platform"))
            start = foot + offset + mm * np.array(given.get("rail", (0.0, 0.0, 0.0))) + turn @ (shift - offset)
            arms = rotations(u, np.array([more]))[0] @ (turn @ arm + guide @ own)
            start = start + (0.0 if drive == "arm" else guide @ own + (drive == "slide") * more * u)
            rod = size + mm * (given.get("length") or {k: 0.0})[k] + (drive == "length") * more
            swing = _turned(own_bar.get("hinge_turn"), rad)
            swung.append((hung, swing @ _axis(nominal.turns), swing @ (kept + shift + end)))
            at = mm * np.array(own_bar.get("hinge", (0.0, 0.0, 0.0))) if hung >= 0 else shift + end
            found.append((name, drive, np.array([start, u, joint + at, arms, kept * (hung < 0), *plane]), rod, root))
    due = len(nominal.legs) if bars or nominal.besides.any or nominal.rings else 6 - 2 * nominal.held[2] + len(names)
    rings = {name: radius + mm * model.get("legs", {}).get(name, {}).get("ring", 0.0)
             for name, radius in nominal.rings.items()}
    besides = wrongly_held(nominal.besides, list(kinematics.get("passive", {})), model.get("passive", {}), mm,
                           lambda given: _turned(given, rad))
    hung_on = Bars(*(np.array(part) for part in zip(*swung, strict=True))) if exact else None
    return replace(nominal, legs=tuple(found), wrong=True, rings=rings, besides=besides, bars=hung_on) \
        if len(found) == due else None


def _turned(given: Any, rad: float) -> Array:
    """(3, 3) of three turns about x, y, z."""
    return _displaced(rad * np.array([[0.0] * 3 + list(given or (0.0, 0.0, 0.0))]), np.zeros(3))[0, :3, :3]


def _axis(turns: str) -> Array:
    return np.eye(3)["abc".index(turns[-1])] if turns else np.zeros(3)


def error_chain(table: dict[str, Any], model: dict[str, Any], files: dict[str, bytes]) -> ErrorChain | Rods | None:
    """The machine of a machine file with the errors of a model file over its CSV tables; None for one that is not known."""
    kind = table.get("kinematics", {}).get("kind", table.get("kinematics", {}).get("family"))
    if kind != "serial":
        return error_rods(table, model) if kind in ("legs", "linear-delta", "h4-linear") and any(
            model.get(key) for key in ("legs", "bars", "passive")) else None
    machine, structure = chain(table), table["kinematics"]["structure"]
    units = [_UNITS[model.get("length_unit", "um")]] * 3 + [_UNITS[model.get("angle_unit", "arcsec")]] * 3
    components: dict[str, list[tuple[int, ComponentError]]] = {}
    for name, given in (model.get("components") or {}).items():
        part = _PARTS.index(name[1])
        components.setdefault(name[-1], []).append((part, curve_of(name, given, units[part], files)))
    location, zero = dict[str, Array](), dict[str, float]()
    for name, value in (model.get("location") or {}).items():
        letter, part = name[-1], _PARTS.index(name[1])
        if letter != "S" and name[1] == _OWN[letter]:
            zero[letter] = math.copysign(1.0, machine.direction[letter][part % 3] or 1.0) * units[part] * float(value)
        else:
            location.setdefault(letter, np.zeros(6))[part] = units[part] * float(value)
    stated = model.get("reference") or {}
    reference = {k: np.array(v["point"], np.float64) for k, v in stated.items() if v.get("point") is not None}
    reference = {**machine.point, **reference}
    frames = {n: (stated.get(n) or {}).get("frame", "bed") for n in machine.letters if n in "ABC"}
    before = {n for n, f in frames.items() if f == "fixed" or (f == "bed" and f"{n}'" not in structure)}
    error_map = _map(model["map"], structure, machine.letters, files) if model.get("map") else None
    return ErrorChain(machine, components, location, zero, reference, frozenset(before), error_map)
