"""The uncertainty of a model whose values are means of readings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.exchange.exports import MOST_UNCERTAINTY
from machines.geometric_error.tables.averages import Averaged, levels_of
from machines.geometric_error.tables.csv_table import UNITS
from machines.geometric_error.tables.lattice import COLUMNS
from machines.geometric_error.tables.lattice_file import zeroed_covariance
from machines.kinematics.chain import ROTARY
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, info


def with_scatter(model: ErrorModel, read: Averaged,
                 zero: Mapping[str, float]) -> tuple[ErrorModel, Diagnostic]:
    """The model with the uncertainty of its means, and what is reported of it; none is written of more than
    `MOST_UNCERTAINTY` values."""
    units = {name: UNITS["arcsec" if name[0] == "r" or name[1] in ROTARY else "um"] for name in read.scatter}
    spread = ", ".join(f"{name} {value / units[name]:.3g}" for name, value in read.scatter.items())
    noted = info("error-import.averaged", f"{read.rows} readings at {len(read.table)} places; standard deviation "
                 f"of one: {spread} (um, arcsec)", file=read.table.file)
    if len(model.names) > MOST_UNCERTAINTY:
        return model, replace(noted, message=f"{noted.message}; no uncertainty of {len(model.names)} values is written")
    covariance = np.diag(_variances(model, read))
    if model.map is not None and zero:
        covariance = zeroed_covariance(covariance, model.map, zero)
    return replace(model, covariance=covariance), noted


def _variances(model: ErrorModel, read: Averaged) -> Floats:
    """(P,) of the means: those of a lattice by node, those of an axis by row and approach direction."""
    if model.map is not None:
        whole = [len(levels_of(read.table.columns[letter])[0]) for letter in model.map.letters]
        inner = tuple(slice(len(nodes)) for nodes in model.map.nodes)  # less the end of a period
        parts = [read.variance(c) for c in COLUMNS]
        return np.stack([part.reshape(whole)[inner].ravel() for part in parts], axis=1).ravel()
    found = []
    for component in model.axes.components:
        approaches = [c for c in (f"{component.name}+", f"{component.name}-", str(component.name)) if c in read.runs]
        rows = len(component.curve.values) // len(approaches)
        found += [read.variance(c)[:rows] for c in approaches]
    return np.concatenate(found)
