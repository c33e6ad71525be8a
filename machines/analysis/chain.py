"""Condition number, conditioning factor and manipulability of a chain of axes, and where they are worst.

Rates of the tip in mm, of the direction of the tool and of rotary axes by a lever in mm: all of J is mm per mm. J has a
column an axis; turns about the tool count for nothing. Source: Company 2000, II-19, II-23, II-24.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from machines.analysis.certify_chain import chain_of, rotary_ranges
from machines.analysis.chain_extreme import largest_condition
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.units import DEG

LEVER, LOOKS = 100.0, 2000
"""mm; random positions of the rotary axes, with all combinations of home and ends of travel"""
NONE = 1e-9
"""least singular value that is one"""


def indices(jacobian: Floats) -> tuple[Floats, Floats, Floats]:
    """(condition number, conditioning factor, manipulability), each (N,), of J (N, 6, J); infinite, 0, 0 where singular."""
    values = np.linalg.svd(jacobian, compute_uv=False)
    least = values[:, -1]
    lengths = np.linalg.norm(jacobian, axis=1)
    size = np.prod(values, axis=1)
    with np.errstate(divide="ignore"):
        condition = np.where(least > NONE, values[:, 0] / np.where(least > NONE, least, 1.0), np.inf)
    return condition, np.asarray(size / np.prod(np.where(lengths > 0.0, lengths, 1.0), axis=1)), np.asarray(size)


def scaled_jacobian(machine: Machine, q: Floats) -> Floats:
    """J (N, 6, J) with all of it as mm per mm."""
    j = np.array(machine.kinematics.jacobian(q))
    j[:, 3:] *= LEVER
    j[:, :, np.array(machine.rotary)] /= LEVER
    return j


def chain_figures(machine: Machine) -> dict[str, Any]:
    """Indices at home, and at the worst of the positions looked at; of a machine with rotary axes where it is singular."""
    q = rotary_positions(machine)
    tip, _ = machine.kinematics.forward(q)
    q = q[np.isfinite(tip).all(axis=1)]
    if not len(q):
        return {}
    condition, factor, size = indices(scaled_jacobian(machine, q))
    worst, least = int(condition.argmax()), int(factor.argmin())
    singular = machine.kinematics.singular(q)
    found: dict[str, Any] = {"indices": {
        "lever_mm": LEVER, "positions": len(q), "condition_number_at_home": _finite(condition[0]),
        "condition_number_worst": _finite(condition[worst]), "worst_at": _words(machine, q[worst]),
        "conditioning_factor_at_home": float(factor[0]), "conditioning_factor_least": float(factor[least]),
        "manipulability_at_home": float(size[0]), "manipulability_range": [float(size.min()), float(size.max())]}}
    if singular.any():
        found["indices"]["singular_at"] = _words(machine, q[int(np.flatnonzero(singular)[0])])
    if machine.kinematics.chain and not singular.any():
        found["indices"] |= _proved(machine)
    return found


def _proved(machine: Machine) -> dict[str, Any]:
    """What the condition number exceeds at no position of the rotary axes, slides at home."""
    chain, at = chain_of(machine, machine.kinematics.tool_length), machine.axis_names.index
    home = np.array([machine.home[at(joint.name)] for joint in chain.slides])
    most = largest_condition(chain, home, rotary_ranges(machine, chain, {}), LEVER)
    return {"condition_number_nowhere_more_than": _finite(most.most), "boxes_of_the_proof": most.boxes}


def rotary_positions(machine: Machine) -> Floats:
    """(N, J) mm and rad: home, ends of travel of the rotary axes, random ones; slides at home."""
    rotary = np.array(machine.rotary)
    low = np.where(np.isfinite(machine.limits.lower), machine.limits.lower, -np.pi)
    high = np.where(np.isfinite(machine.limits.upper), machine.limits.upper, np.pi)
    spans = np.stack([low, np.zeros_like(low), high])[:, rotary]
    ends = np.stack(np.meshgrid(*spans.T), axis=-1).reshape(-1, int(rotary.sum())) if rotary.any() else np.zeros((1, 0))
    some = np.random.default_rng(0).uniform(low, high, (LOOKS if rotary.any() else 1, len(low)))[:, rotary]
    turned = np.concatenate([ends, some])
    q = np.tile(machine.home, (1 + len(turned), 1))
    q[1:, rotary] = turned
    return q


def _words(machine: Machine, q: Floats) -> dict[str, float]:
    return {letter: round(float(value) / DEG, 4) for letter, value, turns in zip(
        machine.axis_names, q, machine.rotary, strict=True) if turns}


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
