"""A box of tips of a chain of axes, proved to be in reach wherever its rotary axes stand in a range.

The largest cube, or box of given sides, is found by linear programming: at fixed rotary axes the slides are affine in the
tip, so that centre and size of a box keep linear bounds (Boyd and Vandenberghe, Convex Optimization, 8.4). What is found
at some hundred positions of the rotary axes is then proved for all of them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np
from scipy.optimize import linprog

from machines.certificate.certificate_file import DIGITS, FORM, SHARE
from machines.certificate.chains import (
    CHAIN_NAMES,
    NO_SLIDES,
    AskedOfChain,
    ChainOfAxes,
    ProvedChain,
    prove_chain,
)
from machines.certificate.lookup import key_of
from machines.certificate.spans import spanned
from machines.loader import values_of_machine
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, DiagnosticError, error
from toolpaths.shapes import arrays
from toolpaths.units import DEG

LOOKS, PER_AXIS, SPARE = 20_001, 25, 0.9
"""positions of the second rotary axis looked at for a margin; positions per rotary axis for the largest box, and the part
of it that is asked"""
LEAST = 1e-3
"""least sine of the pole's angle that counts as none"""
NO_BOX = 1.0
"""mm: half a cube smaller than this is none"""
NARROWED = (1.0, 0.75, 0.5, 0.25, 0.1, 0.0)
"""parts of the travel of rotary axes, about home, at which a box is looked for"""


@dataclass(frozen=True)
@arrays(box="*3", size="3")
class WantedOfChain:
    """What is to be certified of a chain.

    Attributes:
        box: (lower, upper) of the tip in the table frame, mm; None: the largest of the proportions `size`
        size: (3,) mm, sides of a box whose place is looked for; None with a `box`, or for the largest cube
        tool: mm
        turns: (lowest, highest) of rotary axes by letter, rad; of others their travel, at most one turn. Where none is given
            and no box is in reach at all of it, the largest of NARROWED parts of it at which one is
        margin: least sine of the angle between the tool and the rotary axis nearest the part; None: where there is one
    """

    box: tuple[Floats, Floats] | None = None
    size: Floats | None = None
    tool: float = 0.0
    turns: Mapping[str, tuple[float, float]] | None = None
    margin: float | None = None


@dataclass(frozen=True)
@arrays(pole_at="R")
class CertifiedChain:
    """A proof, and where the tool is nearest to lie along a rotary axis."""

    machine: Machine
    asked: AskedOfChain
    proved: ProvedChain
    pole: float
    """least sine seen"""
    pole_at: Floats
    """(R,) rad, the rotary positions there"""

    @cached_property
    def content(self) -> dict[str, Any]:
        """Of the certificate's file."""
        asked, chain = self.asked, self.asked.chain
        bounds = np.floor(SHARE * self.proved.bounds * DIGITS) / DIGITS
        bounds = np.maximum(bounds, [asked.margin, NO_SLIDES, 0.0])
        boxes = [f"{path or '.'} {' '.join(map(repr, row))}" for path, row in zip(self.proved.paths, bounds.tolist(),
                                                                                 strict=True)]
        region: dict[str, Any] = {"of": "tip", "tool_mm": chain.tool}
        region |= {f"{name}_mm": [float(lo), float(hi)] for name, lo, hi in zip("xyz", asked.lower, asked.upper,
                                                                                strict=True)}
        region["turns_rad"] = {joint.name: row.tolist() for joint, row in zip(chain.turns, asked.turns, strict=True)}
        travel = dict(zip((joint.name for joint in chain.slides), chain.travel, strict=True))
        return {
            "certificate": FORM, "key": key_of(values_of_machine(self.machine)), "covers": "region",
            "machine": self.machine.name,
            "chain": {"tool_axis": chain.tool_axis.tolist(), "axes": [
                {"letter": joint.name, "rotary": joint.rotary, "direction": joint.direction.tolist(),
                 "point": joint.point.tolist(),
                 "travel": None if joint.rotary else [float(v) if np.isfinite(v) else None for v in travel[joint.name]]}
                for joint in chain.joints]},
            "region": region, "margin": asked.margin, "slides_margin": NO_SLIDES,
            "proved": dict(zip(CHAIN_NAMES, bounds.min(axis=0).tolist(), strict=True)),
            "digest": sha256("\n".join(boxes).encode()).hexdigest(), "boxes": boxes}

    @property
    def text(self) -> str:
        """The certificate's file."""
        return json.dumps(self.content, indent=1) + "\n"

    @property
    def figures(self) -> dict[str, Any]:
        """Region, what is proved, number of boxes; where the chain is singular inside."""
        content, asked = self.content, self.asked
        region = {key: value for key, value in content["region"].items() if key != "turns_rad"}
        turns = content["region"]["turns_rad"]
        region["turns_deg"] = {name: [round(v / DEG, 6) for v in row] for name, row in turns.items()}
        found = {"machine": self.machine.name, "key": content["key"], "covers": "region", "region": region,
                 "travel_left_mm": content["proved"]["travel"], "slides_span": content["proved"]["slides"]}
        if asked.chain.turns:
            found["free_of_singular_positions"] = asked.margin > 0.0
            if asked.margin > 0.0:
                found |= {"margin": asked.margin, "proved_pole": content["proved"]["pole"]}
            else:
                found["singular_at"] = f"{turn_words(asked.chain, self.pole_at)}: the tool lies along " \
                                       f"{asked.chain.turns[0].name} (sine {self.pole:.2g})"
        return found | {"boxes": len(self.proved.paths), "boxes_looked_at": self.proved.tried}


def certify_chain(machine: Machine, wanted: WantedOfChain) -> CertifiedChain:
    """The certificate, of a machine that is a chain of axes.

    Raises:
        DiagnosticError: where it cannot be had, with the place and what stands against it.
    """
    chain = chain_of(machine, wanted.tool)
    turns = rotary_ranges(machine, chain, wanted.turns or {})
    (lower, upper), turns = (wanted.box, turns) if wanted.box is not None else _with_box(machine, chain, turns, wanted)
    value, at = _nearest_pole(chain, turns)
    margin = wanted.margin if wanted.margin is not None else (0.0 if value < LEAST else float(np.floor(5e3 * value) / 1e4))
    asked = AskedOfChain(chain, lower, upper, turns, margin)
    proved = prove_chain(asked)
    if proved.lack:
        raise DiagnosticError([_refusal(machine, asked, proved)])
    return CertifiedChain(machine, asked, proved, value, at)


def chain_of(machine: Machine, tool: float) -> ChainOfAxes:
    """The chain of a serial machine with a tool, mm."""
    kinematics = machine.kinematics
    at = [machine.axis_names.index(joint.name) for joint in kinematics.chain if not joint.rotary]
    travel = np.stack([machine.limits.lower[at], machine.limits.upper[at]], axis=1)
    return ChainOfAxes(kinematics.chain, kinematics.tool_axis, tool, travel)


def _with_box(machine: Machine, chain: ChainOfAxes, turns: Floats,
              wanted: WantedOfChain) -> tuple[tuple[Floats, Floats], Floats]:
    """The largest box, and the rotary positions at which it is in reach."""
    home = np.array([machine.home[machine.axis_names.index(joint.name)] for joint in chain.turns])
    middle = np.clip(home, turns[:, 0], turns[:, 1])[:, None]
    for part in NARROWED if not wanted.turns else ():
        narrow = middle + part * (turns - middle)
        if (found := largest_box(chain, narrow, wanted.size)) is not None:
            return found, narrow
    if (found := largest_box(chain, turns, wanted.size)) is not None:
        return found, turns
    what = "no cube of tips" if wanted.size is None else f"no box of {' x '.join(f'{v:g}' for v in wanted.size)} mm"
    raise DiagnosticError([error("certificate.box", f"{what} of {machine.name} is in reach with a tool of {chain.tool:g} "
                                                    "mm at "
                                 f"all of {range_words(chain, turns)}", file=machine.file,
                                 hint="narrow the rotary axes with --turn A=-30:30, or ask for a smaller --box")])


def rotary_ranges(machine: Machine, chain: ChainOfAxes, given: Mapping[str, tuple[float, float]]) -> Floats:
    """(R, 2) rad; an axis of more than a turn counts from -180 to 180 degrees, or from its lower end."""
    found = []
    for joint in chain.turns:
        j = machine.axis_names.index(joint.name)
        own = np.array([machine.limits.lower[j], machine.limits.upper[j]])
        own = np.where(np.isfinite(own), own, [-np.pi, np.pi])
        turn = own if np.ptp(own) <= 2.0 * np.pi else np.clip([-np.pi, np.pi], own[0], None)
        turn = turn if turn[1] <= own[1] and np.ptp(turn) > 0.0 else np.array([own[0], own[0] + 2.0 * np.pi])
        low, high = given.get(joint.name, tuple(turn.tolist()))
        if np.isfinite(machine.limits.lower[j]) and not (own[0] - 1e-9 <= low <= high <= own[1] + 1e-9):
            raise DiagnosticError([error("certificate.turns", f"{joint.name} from {low / DEG:g} to {high / DEG:g} degrees "
                                                              "is "
                                         f"outside its travel of {own[0] / DEG:g} to {own[1] / DEG:g}", file=machine.file,
                                         hint="ask for a range inside the travel with --turn")])
        found.append([low, high])
    return np.array(found).reshape(-1, 2)


def _positions(turns: Floats, per_axis: int) -> Floats:
    """(N, R): an even grid of rotary positions, ends and zero included."""
    sides = [np.unique([*np.linspace(lo, hi, per_axis), min(max(0.0, lo), hi)]) for lo, hi in turns]
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(turns)) if len(turns) else np.zeros((1, 0))


def _nearest_pole(chain: ChainOfAxes, turns: Floats) -> tuple[float, Floats]:
    """(least sine between the tool and the rotary axis nearest the part, the position (R,)); it is the second's alone."""
    at = np.tile(np.clip(0.0, *turns.T), (LOOKS, 1))
    if len(turns) > 1:
        at[:, 1] = np.linspace(float(turns[1, 0]), float(turns[1, 1]), LOOKS)
    pole = chain.reached(np.zeros((1, 3)), spanned(at))[1].lo
    k = int(pole.argmin())
    return float(pole[k]), at[k]


def largest_box(chain: ChainOfAxes, turns: Floats, size: Floats | None) -> tuple[Floats, Floats] | None:
    """(lower, upper) of the largest cube of tips, or of a box of that size where it has most room, at a grid of
    positions."""
    half = np.ones(3) if size is None else 0.5 * size
    at = spanned(_positions(turns, PER_AXIS))
    travel = np.asarray(chain.travel, dtype=np.float64)
    q = chain.reached(np.concatenate([np.zeros((1, 3)), np.eye(3)]), at)[0].middle
    first, rates = q[:, :, 0], q[:, :, 1:] - q[:, :, :1]
    across = np.abs(rates) @ half
    rows, due = [], []
    for sign, end in ((1.0, 1), (-1.0, 0)):
        known = np.isfinite(travel[:, end])
        rows.append(np.concatenate([sign * rates, across[:, :, None]], axis=2)[:, known].reshape(-1, 4))
        due.append((sign * (travel[known, end] - first[:, known])).ravel())
    found = linprog([0.0, 0.0, 0.0, -1.0], A_ub=np.concatenate(rows), b_ub=np.concatenate(due),
                    bounds=[(None, None)] * 3 + [(0.0, 1e5)])
    best = np.asarray(found.x if found.success else np.zeros(4), dtype=np.float64)
    room = float(best[3])
    scale = float(np.floor(SPARE * room)) if size is None else 1.0
    if room < scale or scale < NO_BOX:
        return None
    middle = np.round(best[:3], 1) + 0.0 if size is None else best[:3]
    return np.round(middle - scale * half, 4) + 0.0, np.round(middle + scale * half, 4) + 0.0


def _refusal(machine: Machine, asked: AskedOfChain, proved: ProvedChain) -> Diagnostic:
    chain = asked.chain
    tip = ", ".join(f"{name} {v:.4g}" for name, v in zip("xyz", proved.tip, strict=True))
    where = f"the tip at {tip} mm" + (f" and {turn_words(chain, proved.turned)}" if chain.turns else "")
    if proved.lack == "undecided":
        return error("certificate.undecided", f"{proved.tried} boxes and no end, the last round {where}: nothing keeps "
                                              "clear "
                     "by enough to prove it", file=machine.file, hint="ask for a smaller --box or --margin")
    what = {"travel": f"{proved.slide} is {-proved.value:.4g} mm outside its travel",
            "pole": f"the tool lies along {chain.turns[0].name if chain.turns else ''} (sine of the angle "
                    f"{proved.value:.4g}, "
                    f"asked for {asked.margin:g})",
            "slides": f"the slides span no space (|det| {proved.value:.4g})"}[proved.lack]
    return error("certificate.short", f"{what} with {where}", file=machine.file,
                 hint="make --box smaller, narrow the rotary axes with --turn, or ask for a smaller --margin")


def turn_words(chain: ChainOfAxes, turned: Floats) -> str:
    """Positions (R,) rad of the rotary axes in words."""
    names = [joint.name for joint in chain.turns]
    return ", ".join(f"{name} {value / DEG:.4g}" for name, value in zip(names, turned, strict=True)) + " degrees"


def range_words(chain: ChainOfAxes, turns: Floats) -> str:
    """Ranges (R, 2) rad in words; of a chain without rotary axes "its places"."""
    return ", ".join(f"{joint.name} {lo / DEG:g} to {hi / DEG:g} degrees" for joint, (lo, hi) in zip(
        chain.turns, turns, strict=True)) or "its places"

