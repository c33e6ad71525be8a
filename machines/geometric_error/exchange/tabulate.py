"""Any curves as linear tables, as controls and tables per axis hold them; the covariance goes along, the loss
is reported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import Component, ErrorFrame
from machines.geometric_error.exchange.bed_frame import RotatedCurve
from machines.geometric_error.tables.curves import Curve, Fourier, TableCurve
from machines.geometric_error.tables.names import ErrorName
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

PROBES = 16
"""places in each cell of a table at which it is compared with its curve"""
LEAST = 4096
"""such places at least"""
ROUND = 12
"""cells of one turn to begin with, where no table has rows"""


@dataclass(frozen=True)
@arrays(x="M")
class TablePositions:
    """Positions (M,) mm or rad of a table, and the period after which it repeats (0 for never)."""

    x: Floats
    period: float = 0.0

    @property
    def closed(self) -> Floats:
        """The positions, of one that repeats with the end of its period."""
        return np.append(self.x, self.x[0] + self.period) if self.period else self.x


def sampled(curve: Curve, x: Floats, period: float = 0.0) -> TableCurve:
    """A curve as a linear table at positions (M,), mm or rad, both directions where it has them."""
    if isinstance(curve, TableCurve) and curve.rule == "linear" and curve.period == period and np.array_equal(x, curve.x):
        return curve
    both = both_directions(curve)
    approaches = (1.0, -1.0) if both else (0.0,)
    return TableCurve(x, np.concatenate([curve.at(x, approach) for approach in approaches]), "linear",
                      both, period)


def both_directions(curve: Curve) -> bool:
    """True for a curve with two approach directions."""
    return isinstance(curve, TableCurve | RotatedCurve) and curve.both


def loss(curve: Curve, rows: TablePositions) -> float:
    """Largest difference of a curve and its table between the rows, mm or rad, the worse approach direction."""
    closed, table = rows.closed, sampled(curve, rows.x, rows.period)
    count = max(PROBES * (len(closed) - 1), LEAST)
    jitter = np.random.default_rng(0).uniform(0.0, 1.0, count)  # a series would hide between even places
    places = np.interp((np.arange(count) + jitter) / count * (len(closed) - 1),
                       np.arange(len(closed)), closed)
    if isinstance(curve, TableCurve):
        places = np.concatenate([places, curve.x[(curve.x >= closed[0]) & (curve.x <= closed[-1])]])
    approaches = (1.0, -1.0) if table.both else (0.0,)
    return max(float(np.abs(table.at(places, approach) - curve.at(places, approach)).max(initial=0.0))
               for approach in approaches)


def rows_for(components: Sequence[Component], travel: Mapping[str, tuple[float, float]], step: Mapping[str, float],
             length: float, angle: float, most: int, repeat: bool = True) -> dict[str, TablePositions]:
    """Rows for each component, by its name: the same for those of one axis that were measured over the same range.

    Args:
        travel: mm or rad, of axes whose curves hold everywhere and do not repeat
        step: mm or rad between rows, by axis letter; else the rows of the components' own linear tables,
            their cells divided evenly until no component loses more than `length` mm or `angle` rad
        most: rows of a table
        repeat: False where tables cannot repeat: then over the travel

    Raises:
        ValueError: more rows would be needed, or a step is for an axis without components.
    """
    groups: dict[tuple[str, tuple[float, float], float], list[Component]] = {}
    for component in components:
        period = _period(component.curve) if repeat else 0.0
        groups.setdefault((component.name.axis, component.curve.range, period), []).append(component)
    unknown = [axis for axis in step if axis not in {key[0] for key in groups}]
    if unknown:
        raise ValueError(f"a step is given for {', '.join(unknown)}, of which the model has no errors that are written")
    found: dict[str, TablePositions] = {}
    for (axis, span, period), mine in groups.items():
        lower, upper = (0.0, period) if period else span if np.isfinite(span).all() else travel[axis]
        ends = _ends(mine, lower, upper, period)
        rows = _even(ends, step[axis], period) if axis in step else _fine(mine, ends, period, length, angle, most)
        if len(rows.x) > most:
            raise ValueError(f"{len(rows.x)} rows for {axis}, {most} are held; take a longer step")
        found |= {str(component.name): rows for component in mine}
    return found


def _period(curve: Curve) -> float:
    if isinstance(curve, TableCurve | Fourier | RotatedCurve) and not np.isfinite(curve.range).any():
        return curve.period
    return 0.0


def _ends(components: Sequence[Component], lower: float, upper: float, period: float) -> Floats:
    """Rows that the components' own tables have, closed where they repeat; else an even few."""
    tables = [c.curve for c in components if isinstance(c.curve, TableCurve) and c.curve.period == period]
    own = [TablePositions(table.x, period).closed for table in tables]
    if own and len({x[0] for x in own}) == 1:
        return np.unique(np.concatenate(own))
    return np.linspace(lower, upper, ROUND + 1 if period else 2)


def _even(ends: Floats, step: float, period: float) -> TablePositions:
    x = np.linspace(ends[0], ends[-1], 1 + max(int(np.ceil((ends[-1] - ends[0]) / step - 1e-9)), 1))
    return TablePositions(x[:-1] if period else x, period)


def _fine(components: Sequence[Component], ends: Floats, period: float, length: float, angle: float,
          most: int) -> TablePositions:
    parts = 1
    while True:
        x = np.interp(np.arange((len(ends) - 1) * parts + 1) / parts, np.arange(len(ends)), ends)
        rows = TablePositions(x[:-1] if period else x, period)
        worst = max(loss(c.curve, rows) / (angle if c.name.angular else length) for c in components)
        if worst <= 1.0:
            return rows
        if len(x) > most:
            raise ValueError(f"{components[0].name.axis}: {len(x)} rows still lose {worst:.3g} times what was asked for, "
                             f"{most} are held; allow a greater loss")
        parts = max(parts + 1, min(2 * parts, int(parts * np.sqrt(worst))))


def tabulated(model: ErrorModel, components: Sequence[Component], frame: Mapping[str, ErrorFrame],
              rows: Mapping[str, TablePositions],
              most: int) -> ErrorModel:
    """The model with components as linear tables, and the covariance of their values.

    The values of a table are linear in the parameters of its curve, so that covariance is A Sigma A^T. It is
    left out where tables differ from their curves and there are more than `most` parameters.

    Args:
        components: the model's own, or `RotatedCurve` of them, in directions of `frame`
        rows: by name of the component
    """
    made = [Component(c.name, sampled(c.curve, rows[str(c.name)].x, rows[str(c.name)].period)) for c in components]
    axes = replace(model.axes, components=tuple(made), frame=frame)
    result = replace(model, axes=axes, covariance=None)
    if model.covariance is None or all(a.curve is b.curve for a, b in zip(made, model.axes.components, strict=False)):
        return replace(result, covariance=model.covariance)
    if len(result.names) > most:
        return result
    by = _derivatives(model, components, made)
    return replace(result, covariance=by @ model.covariance @ by.T)


def _derivatives(model: ErrorModel, components: Sequence[Component], made: Sequence[Component]) -> Floats:
    """(P', P) of the values of tables `made` of `components` by the parameters of the model."""
    first = 0 if model.rods is None else len(model.rods.names)
    starts, at = {}, first
    for old in model.axes.components:
        starts[old.name] = np.arange(at, at + len(old.curve.values))
        at += len(old.curve.values)
    constants = len(model.axes.constants)
    result = np.zeros((first + sum(len(c.curve.values) for c in made) + constants, at + constants))
    result[:first, :first], row = np.eye(first), first
    for component, table in zip(components, made, strict=True):
        curve = component.curve
        own = [part.name for _, part in curve.parts] if isinstance(curve, RotatedCurve) else [component.name]
        block = _basis(curve, table.curve.x) if isinstance(table.curve, TableCurve) else np.eye(len(curve.values))
        result[row:row + len(block), np.concatenate([starts[name] for name in own])] = block
        row += len(block)
    result[row:, at:] = np.eye(constants)
    return result


def _basis(curve: Curve, x: Floats) -> Floats:
    return np.concatenate([curve.basis(x, np.full(len(x), approach))
                           for approach in ((1.0, -1.0) if both_directions(curve) else (0.0,))])


# ---- parts of models ---------------------------------------------------------------------------------------

def without(model: ErrorModel, names: Sequence[ErrorName]) -> ErrorModel:
    """The model less some components; the covariance of the others stays."""
    kept = tuple(c for c in model.axes.components if c.name not in names)
    return _with_axes(model, replace(model, axes=replace(model.axes, components=kept), covariance=None))


def merged(model: ErrorModel, more: ErrorModel) -> ErrorModel:
    """The model with the components and constants of `more` put in or replaced.

    Covariances stay where either has one; parameters of the other have none, and no correlation is known between the two.
    """
    new = {c.name for c in more.axes.components}
    components = (*(c for c in model.axes.components if c.name not in new), *more.axes.components)
    axes = replace(model.axes, components=components, constants={**model.axes.constants, **more.axes.constants},
                   reference={**model.axes.reference, **more.axes.reference},
                   frame={**model.axes.frame, **more.axes.frame})
    both = replace(model, axes=axes, covariance=None, large=model.large or more.large)
    result = _with_axes(model, both, replaced(model, more))
    return _with_axes(more, result)


def replaced(model: ErrorModel, more: ErrorModel) -> set[str]:
    """Parameters of a model that another one gives again."""
    whole = {str(c.name) for c in more.axes.components}
    mine = [(str(c.name), label) for c in model.axes.components for label in c.curve.labels()]
    return {name + label for name, label in mine if name in whole} | (set(model.axes.constants) & set(more.axes.constants))


def _with_axes(source: ErrorModel, target: ErrorModel,
               lost: set[str] | frozenset[str] = frozenset()) -> ErrorModel:
    """`target` with the covariance that `source` has of the parameters that both have, apart from those `lost`."""
    if source.covariance is None:
        return target
    names = target.names
    place = {name: k for k, name in enumerate(names)}
    shared = [(k, place[name]) for k, name in enumerate(source.names) if name in place and name not in lost]
    old, new = (np.array(x, dtype=np.int64) for x in zip(*shared, strict=True)) if shared else (np.zeros(0, int),) * 2
    covariance = np.zeros((len(names), len(names))) if target.covariance is None else target.covariance.copy()
    covariance[np.ix_(new, new)] = source.covariance[np.ix_(old, old)]
    return replace(target, covariance=covariance)
